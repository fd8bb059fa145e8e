"""A Slurm of two nodes on this machine, gone with the block: slurmctld, two slurmd and munged of Debian's packages.

Needs root and ``apt-get install slurm-wlm munge``. Memory is watched and limited by Slurm's own gathering, since
control groups may not be at hand; there is no accounting, so that jobs are asked for with squeue. A requeued job waits
until the credential of its last run has expired: ten seconds here, two minutes by default.
"""

import contextlib
import os
import secrets
import shutil
import socket
import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch")
_CONF = """
ClusterName=emafault
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={port}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket,cred_expire=10
SlurmUser=root
SlurmdUser=root
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool.%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
JobAcctGatherType=jobacct_gather/linux
JobAcctGatherFrequency=task=1
JobAcctGatherParams=OverMemoryKill
AccountingStorageType=accounting_storage/none
SchedulerParameters=sched_interval=2,bf_interval=2
MinJobAge=600
KillWait=5
ReturnToService=2
"""


@contextlib.contextmanager
def cluster(cores: int = 2, memory: int = 8000) -> Iterator[dict[str, str]]:
    """Two nodes of so many cores and megabytes in the partition ``short``; what the environment needs to use it."""
    lacking = [program for program in PROGRAMS if not shutil.which(program)]
    if lacking or os.geteuid() != 0:
        raise SystemExit(f"needs root and {', '.join(lacking) or 'nothing else'}: apt-get install slurm-wlm munge")
    with tempfile.TemporaryDirectory(prefix="slurm-") as name, contextlib.ExitStack() as stack:
        folder = Path(name)
        folder.chmod(0o755)
        (folder / "state").mkdir()
        _munge(folder, stack)
        host = socket.gethostname()
        ports = [_free_port() for _ in range(3)]
        lines = [_CONF.format(host=host, port=ports[0], folder=folder)]
        for n, port in enumerate(ports[1:], start=1):
            node = f"NodeName=node{n} NodeHostname={host} NodeAddr=127.0.0.1 Port={port}"
            lines.append(f"{node} CPUs={cores} RealMemory={memory} State=UNKNOWN")
        lines.append("PartitionName=short Nodes=node[1-2] Default=YES MaxTime=240 State=UP")
        conf = folder / "slurm.conf"
        conf.write_text("\n".join(lines) + "\n")
        _stand_in(conf, stack)
        environment = {"SLURM_CONF": str(conf)}
        _started(["slurmctld", "-D", "-f", str(conf)], environment, folder, stack)
        for n in (1, 2):
            _started(["slurmd", "-D", "-N", f"node{n}", "-f", str(conf)], environment, folder, stack)
        _wait_until_idle(environment, folder)
        yield environment


def _stand_in(conf: Path, stack: contextlib.ExitStack) -> None:
    """Put the configuration where jobs look for it, since they do not inherit SLURM_CONF."""
    place = Path("/etc/slurm/slurm.conf")
    if os.path.lexists(place):
        raise SystemExit(f"{place} exists: this machine belongs to a cluster already")
    place.parent.mkdir(exist_ok=True)
    place.symlink_to(conf)
    stack.callback(place.unlink)


def _munge(folder: Path, stack: contextlib.ExitStack) -> None:
    key = folder / "munge.key"
    key.write_bytes(secrets.token_bytes(128))
    key.chmod(0o600)
    files = [
        f"--{what}={folder}/munge.{what.split('-')[0]}" for what in ("socket", "pid-file", "log-file", "seed-file")
    ]
    _started(["munged", "--foreground", "--force", f"--key-file={key}", *files], {}, folder, stack)
    deadline = time.monotonic() + 20.0
    while not (folder / "munge.socket").exists():
        assert time.monotonic() < deadline, "munged does not start"
        time.sleep(0.1)


def _started(command: list[str], environment: dict[str, str], folder: Path, stack: contextlib.ExitStack) -> None:
    log = stack.enter_context(open(folder / f"{command[0]}.said", "ab"))
    process = subprocess.Popen(
        command, env={**os.environ, **environment}, stdout=log, stderr=log, start_new_session=True
    )

    def end() -> None:
        process.terminate()
        try:
            process.wait(timeout=10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()

    stack.callback(end)


def _free_port() -> int:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


def _wait_until_idle(environment: dict[str, str], folder: Path) -> None:
    deadline, said = time.monotonic() + 60.0, ""
    while time.monotonic() < deadline:
        said = subprocess.run(
            ["sinfo", "-h", "-o", "%t %D"], env={**os.environ, **environment}, capture_output=True, text=True
        ).stdout.strip()
        if said == "idle 2":
            return
        time.sleep(0.5)
    logs = "\n".join(path.read_text()[-1500:] for path in folder.glob("*.log") if path.is_file())
    raise SystemExit(f"the nodes do not come up ({said}):\n{logs}")

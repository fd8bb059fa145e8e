"""The workflow on a Slurm of two nodes on this machine: the same bits as here, and what becomes of jobs that fail.

    python benchmarks/cluster.py [--log FILE] [results scancel drain time memory line]

Needs root, ``apt-get install slurm-wlm munge`` and ``pip install ".[slurm]"``. The nodes have two cores each and no
accounting. Prints a line for each thing that was tried; exit code 1 where one does not hold.
"""

import argparse
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from house import SMALL, build, environment
from house import snakemake as local
from kills import of_the_study, plain
from slurm import cluster

PROFILE = ("--profile", "profiles/slurm", "--slurm-no-account", "--slurm-status-command", "squeue")
SHARD = "results/datasets/smoke/{}/shard_0.nc"
LOG = Path(os.devnull)


def run(house: Path, nodes: dict[str, str], *arguments: str) -> subprocess.Popen:
    """The workflow on the cluster, what it says kept in a file beside the results."""
    command = [sys.executable, "-m", "snakemake", *PROFILE, *arguments]
    said = open(house / "said.log", "w")
    return subprocess.Popen(command, cwd=house, env=environment(house, **nodes), stdout=said, stderr=subprocess.STDOUT)


def ended(house: Path, process: subprocess.Popen, within: float = 900.0) -> tuple[int, str]:
    """Exit code and what was said."""
    code = process.wait(timeout=within)
    said = (house / "said.log").read_text()
    with open(LOG, "a") as log:
        log.write(said)
    return code, said


def slurm(nodes: dict[str, str], *command: str) -> str:
    """A command of Slurm."""
    return subprocess.run(command, env={**os.environ, **nodes}, capture_output=True, text=True).stdout


def running_job(nodes: dict[str, str], within: float = 240.0) -> tuple[str, str]:
    """Number and node of a job that runs."""
    deadline = time.monotonic() + within
    while time.monotonic() < deadline:
        lines = slurm(nodes, "squeue", "-h", "-t", "R", "-o", "%i %N").split("\n")
        if lines[0]:
            number, node = lines[0].split()
            return number, node
        time.sleep(0.1)
    raise SystemExit("no job begins to run")


def results(house: Path) -> dict[str, bytes]:
    """What the study made, without times."""
    folder = house / "results"
    files = sorted(p for p in folder.rglob("*") if p.is_file() and of_the_study(p))
    return {str(p.relative_to(folder)): plain(p) for p in files}


def try_results(house: Path, nodes: dict[str, str]) -> str:
    """A small study, here and on the cluster."""
    with tempfile.TemporaryDirectory() as name:
        here = build(Path(name) / "here")
        subprocess.run(local(*SMALL), cwd=here, env=environment(here), check=True, capture_output=True)
        expected = results(here)
    start = time.monotonic()
    code, said = ended(house, run(house, nodes, *SMALL))
    assert code == 0, said[-3000:]
    got = results(house)
    different = [n for n in expected | got if expected.get(n) != got.get(n)]
    assert not different, f"differ: {different}"
    jobs = len(re.findall(r"has been submitted with SLURM jobid", said))
    return f"{len(got)} files the same bits, {jobs} jobs, {time.monotonic() - start:.0f} s"


def try_scancel(house: Path, nodes: dict[str, str]) -> str:
    """A job that is cancelled is done again."""
    process = run(house, nodes, SHARD.format("training"), *SMALL, "--forcerun", "simulate_shard")
    number, _ = running_job(nodes)
    slurm(nodes, "scancel", number)
    code, said = ended(house, process)
    assert code == 0 and "Trying to restart" in said, said[-3000:]
    return "done again by itself"


def try_drain(house: Path, nodes: dict[str, str]) -> str:
    """A node that goes down takes a job with it, which is done on the other."""
    process = run(house, nodes, SHARD.format("fresh"), *SMALL, "--forcerun", "simulate_shard")
    number, node = running_job(nodes)
    slurm(nodes, "scontrol", "update", f"NodeName={node}", "State=DRAIN", "Reason=trial")
    slurm(nodes, "scontrol", "requeue", number)
    code, said = ended(house, process)
    after = slurm(nodes, "squeue", "-h", "-t", "all", "-j", number, "-o", "%N").strip()
    slurm(nodes, "scontrol", "update", f"NodeName={node}", "State=RESUME")
    assert code == 0 and after != node, (node, after, said[-3000:])
    return f"{node} drained, its job done on {after}"


def try_time(house: Path, nodes: dict[str, str]) -> str:
    """A job that takes longer than its limit gets more at the next attempt."""
    more = ("--set-resources", "simulate_shard:runtime=1 if attempt == 1 else 30")
    target = "results/datasets/long/training/shard_0.nc"
    slow = "overrides=search.workers=1 sampling.runs=100000 sampling.fresh=10 sampling.shards=1 name=long dataset=long"
    process = run(house, nodes, target, "--config", "experiment=smoke", slow, *more)
    code, said = ended(house, process, 1800.0)
    assert "TIMEOUT" in said and code == 0, said[-3000:]
    return "past its limit of 1 min, done with 30"


def try_memory(house: Path, nodes: dict[str, str]) -> str:
    """A job that takes more memory than it asked for gets more at the next attempt."""
    more = ("--set-resources", "simulate_shard:mem_mb=60 if attempt == 1 else 1000")
    process = run(house, nodes, SHARD.format("training"), *SMALL, *more, "--forcerun", "simulate_shard")
    code, said = ended(house, process)
    assert code == 0 and "Trying to restart" in said, said[-3000:]
    return "more than its 60 MB, done with 1000"


def try_line(house: Path, nodes: dict[str, str]) -> str:
    """A job that fails at every attempt ends in one line, and nothing made is lost."""
    before = results(house)
    more = ("--set-resources", "simulate_shard:mem_mb=60")
    process = run(house, nodes, SHARD.format("training"), *SMALL, *more, "--forcerun", "simulate_shard")
    code, said = ended(house, process)
    lines = [line for line in said.splitlines() if line.startswith("emafault: ")]
    assert code != 0 and len(lines) == 1, said[-3000:]
    assert all(n in results(house) for n in before if "shard_0" not in n)
    return lines[0]


def main() -> None:
    global LOG
    parser = argparse.ArgumentParser(description=__doc__)
    every = {name.removeprefix("try_"): f for name, f in globals().items() if name.startswith("try_")}
    parser.add_argument("tries", nargs="*", default=list(every))
    parser.add_argument("--log", type=Path, default=LOG, help="file to which all that Snakemake says is added")
    args = parser.parse_args()
    LOG, failed = args.log, 0
    with tempfile.TemporaryDirectory() as name, cluster() as nodes:
        house = build(Path(name) / "house")
        for word in args.tries:
            try:
                print(f"{word}: {every[word](house, nodes)}", flush=True)
            except AssertionError as error:
                failed += 1
                print(f"{word}: FAILED {error}", flush=True)
    sys.exit(min(failed, 1))


if __name__ == "__main__":
    main()

"""The workflow on a Slurm of two nodes on this machine: the same bits as here, and what becomes of jobs that fail.

    python benchmarks/cluster.py [--log FILE] [results grouped scancel drain down requeued time memory refused]

Needs root, ``apt-get install slurm-wlm munge`` and ``pip install ".[slurm]"``. The nodes have two cores each and no
accounting. Prints a line for each thing that was tried; exit code 1 where one does not hold.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from emafault.reporting.failures import RESTARTS
from house import SMALL, build, environment
from house import snakemake as local
from kills import of_the_study, plain
from slurm import cluster

PROFILE = ("--profile", "profiles/slurm", "--slurm-no-account", "--slurm-status-command", "squeue")
# some 100 s of training
SLOW = (
    "overrides=search=none sampling.runs=60 evaluation.seeds=13 training=adam training.epochs=300 training.max_fail=300"
)
# as many shards as a study of 8000 runs has
MANY = (*SMALL[:2], f"{SMALL[2]} sampling.shards=8")
SHARD = "results/datasets/smoke/{}/shard_0.nc"
LOG = Path(os.devnull)
STARTED: list[subprocess.Popen] = []


def run(house: Path, nodes: dict[str, str], *arguments: str) -> subprocess.Popen:
    """The workflow on the cluster, what it says kept in a file beside the results."""
    command = [sys.executable, "-m", "snakemake", *PROFILE, *arguments]
    said = open(house / "said.log", "w")
    started = subprocess.Popen(
        command, cwd=house, env=environment(house, **nodes), stdout=said, stderr=subprocess.STDOUT
    )
    STARTED.append(started)
    return started


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


def running_job(nodes: dict[str, str], rule: str, but: str = "", within: float = 240.0) -> tuple[str, str]:
    """Number and node of a job of a rule that runs, other than one that is over."""
    deadline = time.monotonic() + within
    while time.monotonic() < deadline:
        for line in slurm(nodes, "squeue", "-h", "-t", "R", "-o", "%i %N %k").splitlines():
            number, node, comment = line.split(maxsplit=2)
            if re.match(rf"rule_(\w+_)?{rule}", comment) and number != but:  # alone or in a group
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


def try_grouped(house: Path, nodes: dict[str, str]) -> str:
    """The profile's grouping of short jobs, beside none: as many results, fewer of Slurm's jobs."""
    found, told = [], []
    profile = house / "profiles" / "slurm" / "config.yaml"
    grouped = profile.read_text()
    for text, word in ((re.sub(r"^group.*\n( .*\n)*", "", grouped, flags=re.M), "each alone"), (grouped, "grouped")):
        profile.write_text(text)
        shutil.rmtree(house / "results", ignore_errors=True)
        start = time.monotonic()
        code, said = ended(house, run(house, nodes, *MANY))
        assert code == 0, said[-3000:]
        took = time.monotonic() - start
        found.append(results(house))
        jobs = len(re.findall(r"has been submitted with SLURM jobid", said))
        assert "group_" in said if word == "grouped" else "group_" not in said, f"{word}: {said[-3000:]}"
        told.append(f"{word} {jobs} jobs, {took:.0f} s")
    alone, together = found
    different = [n for n in alone | together if alone.get(n) != together.get(n)]
    assert not different, f"differ: {different}"
    return f"{'; '.join(told)}; {len(together)} files the same bits"


def try_scancel(house: Path, nodes: dict[str, str]) -> str:
    """A job that is cancelled is done again; where that is cancelled too, a line says so."""
    target = (SHARD.format("training"), *SMALL, "--forcerun", "simulate_shard")
    process = run(house, nodes, *target)
    slurm(nodes, "scancel", running_job(nodes, "simulate_shard")[0])
    code, said = ended(house, process)
    assert code == 0 and "Trying to restart" in said, said[-3000:]
    process = run(house, nodes, *target)
    first, _ = running_job(nodes, "simulate_shard")
    slurm(nodes, "scancel", first)
    slurm(nodes, "scancel", running_job(nodes, "simulate_shard", first)[0])
    line = _only_line(*ended(house, process))
    assert line.startswith("emafault: simulate_shard: cancelled, after 2 attempts"), line
    return f"done again by itself; cancelled twice\n  {line}"


def try_drain(house: Path, nodes: dict[str, str]) -> str:
    """A job that is taken from a node to be drained is done on the other."""
    return _moved(house, nodes, "DRAIN", "requeue")


def try_down(house: Path, nodes: dict[str, str]) -> str:
    """A node that fails takes a job with it, which is done again, there if it is back by then."""
    return _moved(house, nodes, "DOWN")


def _moved(house: Path, nodes: dict[str, str], state: str, *job: str) -> str:
    process = run(house, nodes, SHARD.format("fresh"), *SMALL, "--forcerun", "simulate_shard")
    number, node = running_job(nodes, "simulate_shard")
    slurm(nodes, "scontrol", "update", f"NodeName={node}", f"State={state}", "Reason=trial")
    if job:
        slurm(nodes, "scontrol", *job, number)
    code, said = ended(house, process)
    told = slurm(nodes, "scontrol", "show", "job", number)
    slurm(nodes, "scontrol", "update", f"NodeName={node}", "State=RESUME")
    after = re.findall(r"\bNodeList=(\S+)", told)
    assert code == 0 and "Restarts=1" in told and after, (told, said[-3000:])
    assert after[0] != node or state == "DOWN", f"done on {node}, which was drained"
    return f"{node} in state {state}, its job begun again by Slurm on {after[0]}"


def try_requeued(house: Path, nodes: dict[str, str]) -> str:
    """A job that Slurm begins again too often is ended, and takes an attempt."""
    process = run(house, nodes, SHARD.format("fresh"), *SMALL, "--forcerun", "simulate_shard")
    first, _ = running_job(nodes, "simulate_shard")
    for begun in range(RESTARTS + 1):
        _begun_again(nodes, first, begun)
        slurm(nodes, "scontrol", "requeue", first)
    code, said = ended(house, process)
    assert code == 0 and said.count("Trying to restart") == 1, said[-3000:]
    line = re.findall(r"begun again by Slurm \d+ times", said)
    assert line == [f"begun again by Slurm {RESTARTS + 1} times"], said[-3000:]
    return f"done by a second attempt after {line[0]}"


def _begun_again(nodes: dict[str, str], number: str, times: int, within: float = 120.0) -> None:
    deadline = time.monotonic() + within
    while time.monotonic() < deadline:
        told = slurm(nodes, "scontrol", "show", "job", number)
        if f"Restarts={times} " in told and "JobState=RUNNING" in told:
            return
        time.sleep(0.1)
    raise AssertionError(f"job {number} does not begin again:\n{told}")


def try_time(house: Path, nodes: dict[str, str]) -> str:
    """A job that takes longer than its limit gets more; where that is too little again, a line says so."""
    slow = (*SMALL[:2], SLOW)
    target = "results/experiments/smoke/identifiers/weighted_floating/network"
    return _short_of("time limit", "train_identifier:runtime", (1, 30), "min", house, nodes, target, *slow)


def try_memory(house: Path, nodes: dict[str, str]) -> str:
    """A job that takes more memory than it asked for gets more; where that is too little again, a line says so."""
    shard = SHARD.format("training")
    again = ("--forcerun", "simulate_shard")
    return _short_of("out of memory", "simulate_shard:mem_mb", (60, 1000), "MB", house, nodes, shard, *SMALL, *again)


def _short_of(
    reason: str, resource: str, limits: tuple[int, int], unit: str, house: Path, nodes: dict[str, str], *target: str
) -> str:
    rule, (few, enough) = resource.split(":")[0], limits
    code, said = ended(house, run(house, nodes, *target, "--set-resources", f"{resource}={few}"))
    line = _only_line(code, said)
    assert line.startswith(f"emafault: {rule}: {reason} at {few} {unit}, after 2 attempts"), line
    more = f"{resource}={few} if attempt == 1 else {enough}"
    code, said = ended(house, run(house, nodes, *target, "--set-resources", more))
    assert code == 0 and said.count("Trying to restart") == 1 and "emafault: " not in said, said[-3000:]
    # what was not set here has doubled by the rule's own count of attempts; a failed job's log repeats what it had
    other = "mem_mb" if unit == "min" else "runtime"
    asked = re.findall(rf"^ *rule {rule}:$.*?{other}=(\d+)", said, re.M | re.S)
    assert asked and int(asked[-1]) == 2 * int(asked[0]), asked
    return f"done with {enough} {unit} after {few}; with {few} twice\n  {line}"


def try_refused(house: Path, nodes: dict[str, str]) -> str:
    """A job that needs more than any node has is refused, which a line says."""
    more = ("--set-resources", "simulate_shard:mem_mb=60 if attempt == 1 else 100000", "--forcerun", "simulate_shard")
    code, said = ended(house, run(house, nodes, SHARD.format("training"), *SMALL, *more))
    line = _only_line(code, said)
    assert line.startswith("emafault: simulate_shard: refused by Slurm"), line
    return line


def _only_line(code: int, said: str) -> str:
    lines = [line for line in said.splitlines() if line.startswith("emafault: ")]
    assert code != 0 and len(lines) == 1, said[-3000:]
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
        try:
            for word in args.tries:
                try:
                    print(f"{word}: {every[word](house, nodes)}", flush=True)
                except AssertionError as error:
                    failed += 1
                    print(f"{word}: FAILED {error}", flush=True)
        finally:
            for process in STARTED:
                process.kill()
    sys.exit(min(failed, 1))


if __name__ == "__main__":
    main()

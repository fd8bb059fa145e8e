"""Commands killed at random moments and run again: nothing is lost, nothing is left over, results are the same bits.

    python benchmarks/kills.py [study diagnosis import identification calibration] [--kills 50] [--seed 0]

Each command is started in a copy of the project, killed, started again where it was and killed again, until it gets
to its end, then from the beginning, until it was killed so often: by turns with SIGKILL and SIGTERM, the whole group
of processes or the one that was started alone. The identification is ``identify --reference``, with the study's
results; the calibration is ``snakemake calibration`` on four cases. Prints a table in Markdown.
"""

import argparse
import json
import os
import random
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from diagnosis import Case, simulate_bench
from house import NOT_RESULTS, ROOT, build, environment, snakemake

#: every stage, small; one worker, so that the search is the same one each time
STUDY = (
    "--config",
    "experiment=smoke",
    "overrides=search.workers=1 search.trials=3 sampling.runs=60 evaluation.seeds=1 training.epochs=30",
)
CASES = "cases: {T0: 4, T1: 0, T2: 0}\nfirst_seed: 40000\nbatch: {T0: 2, T1: 1, T2: 1}\nmeasured: false\n"
#: who is killed, and how
KILLS = [(kind, whole) for kind in (signal.SIGKILL, signal.SIGTERM) for whole in (True, False)]
GONE_WITHIN = 300.0  # s that a job which outlives its killed study may take to end
PATIENCE = 10.0  # s after SIGTERM


@dataclass
class Target:
    """A command, where it writes, and what must be the same at its end."""

    command: list[str]
    house: Path
    out: Path
    kept: Callable[[Path], bool] = lambda path: True
    longest: float = 1.1  # of the time that it takes, after which it is killed at the latest; results are written last
    reference: dict[str, bytes] = field(default_factory=dict)

    def start(self) -> subprocess.Popen:
        """Start it in a group of its own."""
        log = open(self.house / "said.log", "ab")
        return subprocess.Popen(
            self.command, cwd=self.house, env=self.environment(), stdout=log, stderr=log, start_new_session=True
        )

    def environment(self) -> dict[str, str]:
        """With temporary files beside the results, where they are seen."""
        (self.house / "temporary").mkdir(exist_ok=True)
        return environment(self.house, TMPDIR=str(self.house / "temporary"))

    def results(self) -> dict[str, bytes]:
        """Content of every result, without times and numbers of runs."""
        files = [p for p in self.out.rglob("*") if p.is_file()]
        return {str(p.relative_to(self.out)): plain(p) for p in sorted(files) if self.kept(p)}


def plain(path: Path) -> bytes:
    """What a file holds; of trials and cases without how long they took, of trials without their numbers."""
    if path.name == "calibration.json":
        return json.dumps({k: v for k, v in json.loads(path.read_text()).items() if k != "seconds"}).encode()
    if path.name not in ("trials.json", "chosen.json"):
        return path.read_bytes()
    read = json.loads(path.read_text())
    trials = read if isinstance(read, list) else [read]
    return json.dumps([{k: v for k, v in t.items() if k not in ("seconds", "number")} for t in trials]).encode()


def of_the_study(path: Path) -> bool:
    """Whether a file is a result of the study that holds neither times nor numbers of runs."""
    hold_times = ("tracked.json", "tracking.json", "journal.log", "report.html", "search.png", "mlflow.db", "pace.json")
    aside = path.name.startswith((".", "worker_")) or path.name in hold_times
    return not aside and not set(NOT_RESULTS) & set(path.parts)


def targets(folder: Path, names: list[str]) -> dict[str, Target]:
    """What is to be killed, with what it needs made beforehand."""
    house = build(folder / "house")
    emafault = [sys.executable, "-m", "emafault"]
    bench, healthy = house / "bench", house / "healthy"
    simulate_bench(bench, Case(3, 1.0, ("effects.cogging.a=0.01",)))
    simulate_bench(healthy, Case(1, 1.0, healthy=True))
    (house / "conf" / "withheld" / "own.yaml").write_text(CASES)
    given = measured(house / "measured")
    every = {
        "study": Target(snakemake(*STUDY), house, house / "results", of_the_study, 0.3),
        "diagnosis": Target([*emafault, "diagnose", "bench", "--out", "diagnosed"], house, house / "diagnosed"),
        "import": Target(
            [*emafault, "import", "--map", str(given), "--out", "imported", "--force"], house, house / "imported"
        ),
        "calibration": Target(snakemake("calibration"), house, house / "results", of_the_study, 0.6),
        "identification": Target(
            [
                *emafault,
                "identify",
                "bench",
                "--reference",
                "healthy",
                "--experiment",
                "smoke",
                "--json",
                "estimates/e.json",
                "--force",
            ],
            house,
            house / "estimates",
        ),
    }
    return {name: every[name] for name in names}


def measured(folder: Path) -> Path:
    """A log of a simulated actuator with its map."""
    import yaml

    sys.path.insert(0, str(ROOT))
    from tests.imports import measured as logs
    from tests.imports import writers

    folder.mkdir()
    writers.csv(folder / "one.csv", logs.log(logs.simulated(2e-5)))
    entry = {"name": "one", "file": "one.csv", "health": "unknown", "ambient": "24 degC", "command": "reversal"}
    (folder / "map.yaml").write_text(yaml.safe_dump(logs.map_of() | {"recordings": [entry]}))
    return folder / "map.yaml"


def finished(target: Target) -> float:
    """Run the command to its end; how long it took (s)."""
    start = time.monotonic()
    code = target.start().wait(timeout=1200)
    assert code == 0, (target.house / "said.log").read_text()[-3000:]
    return time.monotonic() - start


def left_running(house: Path) -> list[int]:
    """Processes at work in a folder."""
    found = []
    for entry in Path("/proc").iterdir():
        try:
            if (
                entry.name.isdigit()
                and os.readlink(entry / "cwd").startswith(str(house))
                and (entry / "cmdline").read_bytes()
            ):
                found.append(int(entry.name))
        except OSError:
            continue
    return found


def check_whole(target: Target) -> None:
    """After a kill: no result is half written, and where a verdict is, its report is."""
    for path in target.out.rglob("*"):
        if not path.is_file() or path.name.startswith("."):
            continue
        if path.suffix == ".nc":
            assert path.read_bytes()[:4] == b"\x89HDF", path
        if path.suffix == ".json":
            json.loads(path.read_text())
        if path.name == "diagnosis.json" and "cases_" not in str(path):  # blind cases have no report
            assert (path.parent / "report.html").read_text().endswith("</html>\n"), path


def check_end(target: Target) -> None:
    """After the last run: the same results, nothing left over."""
    results = target.results()
    different = [n for n in target.reference | results if results.get(n) != target.reference.get(n)]
    assert not different, f"differ: {different}"
    deadline = time.monotonic() + GONE_WITHIN
    while left_running(target.house) and time.monotonic() < deadline:
        time.sleep(0.2)
    left = [str(p) for p in target.out.rglob("*.part")] + [f"process {n}" for n in left_running(target.house)]
    assert not left, f"left over: {left}"
    database = target.house / "results" / "mlflow.db"
    if database.exists():
        with sqlite3.connect(database) as runs:
            (running,) = runs.execute("select count(*) from runs where status = 'RUNNING'").fetchone()
        assert running == 0, f"{running} runs of a killed process are still called running"


def kill(process: subprocess.Popen, kind: signal.Signals, whole: bool) -> None:
    """Kill a process, or it and all that it has started; what SIGTERM has not ended is killed, as services are."""
    (os.killpg if whole else os.kill)(process.pid, kind)
    try:
        process.wait(timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def bombard(target: Target, kills: int, rng: random.Random) -> dict[str, float]:
    """Kill a command so often; how often it got to its end, and how long it takes."""
    shutil.rmtree(target.out, ignore_errors=True)
    finished(target)
    target.reference = target.results()
    shutil.rmtree(target.out)
    takes = finished(target)  # without what the first run compiles
    check_end(target)
    done, ends = 0, 0
    shutil.rmtree(target.out)
    while done < kills:
        kind, whole = KILLS[done % len(KILLS)]
        process = target.start()
        try:
            code = process.wait(timeout=rng.uniform(0.02, target.longest) * takes)
        except subprocess.TimeoutExpired:
            kill(process, kind, whole)
            done += 1
            check_whole(target)
            print(f"\r{done}", end="", file=sys.stderr, flush=True)
            continue
        assert code == 0, (target.house / "said.log").read_text()[-3000:]
        check_end(target)
        ends += 1
        shutil.rmtree(target.out)
    finished(target)
    check_end(target)
    return {"takes": takes, "kills": done, "ends": ends + 1}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    names = ["study", "diagnosis", "import", "identification", "calibration"]
    parser.add_argument("targets", nargs="*", default=names, help=f"any of {', '.join(names)}")
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        made = targets(Path(name), names)
        if "identification" in args.targets and "study" not in args.targets:
            finished(made["study"])
        print("| command | takes (s) | kills | runs to the end, all the same bits |\n|---|---|---|---|", flush=True)
        for target in sorted(args.targets, key=names.index):  # the identification has the study's results
            found = bombard(made[target], args.kills, random.Random(args.seed))
            print(f"| {target} | {found['takes']:.1f} | {found['kills']} | {found['ends']} |", flush=True)


if __name__ == "__main__":
    main()

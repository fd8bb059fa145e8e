"""One search by workers on two nodes that share a file system: two hosts of this machine's, made of namespaces.

    python benchmarks/nodes.py [together killed stopped]

Each worker runs under a host name and among processes of its own (``unshare --uts --pid``, as root), so that none can
ask for the other's process and only its trials' signs of life tell of it. ``together``: both to the end. ``killed``:
one is killed within a trial, which the other runs itself once no sign has come for long enough. ``stopped``: one is
stopped for longer than that and goes on, told late that its trial was given up.
"""

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np

TRIALS = 24
SETTINGS = {
    "space": {"network.width": {"low": 2, "high": 40}, "training.reweight": [0, 1, 2]},
    "trials": TRIALS, "repeats": 2, "seed": 3, "training": {"epochs": 200},
}  # fmt: skip
ROWS = 3000


def data() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Features (row, 6), faults (row, 6) and their width (6,) of a smooth map."""
    rng = np.random.default_rng(0)
    faults = rng.uniform(0.0, 1.0, (ROWS, 6))
    features = np.tanh(faults @ rng.normal(0.0, 1.0, (6, 6))) + 0.01 * rng.standard_normal((ROWS, 6))
    return features, faults, np.ones(6)


def work(journal: str, worker: int) -> None:
    """One worker, to the end of the search; prints how many trials it ran."""
    from emafault.identification.search import SearchSettings, run_worker

    print(run_worker(journal, SearchSettings(**SETTINGS), *data(), worker=worker))


def started(journal: Path, node: int) -> subprocess.Popen:
    """A worker on a node."""
    command = f"hostname node{node} && exec {sys.executable} {Path(__file__).resolve()} --worker {journal} {node}"
    return subprocess.Popen(
        ["unshare", "--uts", "--pid", "--fork", "--kill-child", "--mount-proc", "sh", "-c", command],
        stdout=subprocess.PIPE, text=True, env=os.environ | {"OMP_NUM_THREADS": "1"}, start_new_session=True,
    )  # fmt: skip


def of_study(journal: Path) -> list:
    """All trials of the search so far."""
    from emafault.identification.search import SearchSettings, open_study, study_name

    return open_study(journal, study_name(SearchSettings(**SETTINGS), *data())).get_trials(deepcopy=False)


def owned(journal: Path, node: int) -> list:
    """Trials that a node has begun."""
    return [t for t in of_study(journal) if t.user_attrs.get("owner", [""])[0] == f"node{node}"]


def within_a_trial(journal: Path, node: int) -> int:
    """Waits until a node has finished a trial and is at another, whose number it returns."""
    while True:
        states = {t.number: t.state.name for t in owned(journal, node)} if journal.exists() else {}
        running = [n for n, state in states.items() if state == "RUNNING"]
        if running and "COMPLETE" in states.values():
            return running[0]
        time.sleep(0.2)


def signalled(process: subprocess.Popen, number: int) -> None:
    """Sends a signal to a worker and what started it."""
    os.killpg(process.pid, number)


def main() -> None:
    """Run each case and print what came of it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    cases = ("together", "killed", "stopped")
    parser.add_argument("cases", nargs="*", default=cases, help=f"any of {', '.join(cases)}")
    parser.add_argument("--worker", nargs=2, metavar=("JOURNAL", "NODE"), help="be a worker; used by this script")
    args = parser.parse_args()
    if args.worker:
        work(args.worker[0], int(args.worker[1]))
        return
    for case in args.cases:
        with tempfile.TemporaryDirectory() as scratch:
            run(case, Path(scratch) / "journal.log")


def run(case: str, journal: Path) -> None:
    """One search by two nodes."""
    begun = time.monotonic()
    workers = {node: started(journal, node) for node in (1, 2)}
    given_up = None
    if case != "together":
        given_up = within_a_trial(journal, 1)
        signalled(workers[1], signal.SIGKILL if case == "killed" else signal.SIGSTOP)
    if case == "stopped":
        while next(t for t in of_study(journal) if t.number == given_up).state.name == "RUNNING":
            time.sleep(0.5)
        signalled(workers[1], signal.SIGCONT)
    ran = {node: w.communicate()[0].strip() for node, w in workers.items()}
    trials = of_study(journal)
    states = Counter(t.state.name for t in trials)
    told = {t.number: t.state.name for t in trials}
    distinct = len({json.dumps(t.params, sort_keys=True) for t in trials if t.state.name == "COMPLETE"})
    by_node = ", ".join(f"node{n} {r or 'killed'}" for n, r in ran.items())
    late = f"; trial {given_up} of node1 told {told[given_up]}" if given_up is not None else ""
    print(
        f"{case}: {states['COMPLETE']} of {TRIALS} trials finished, {distinct} settings, run by {by_node}, "
        f"{states['RUNNING']} left running{late}; {time.monotonic() - begun:.0f} s",
        flush=True,
    )
    assert states["COMPLETE"] >= TRIALS and states["RUNNING"] == 0


if __name__ == "__main__":
    main()

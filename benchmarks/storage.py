"""Results in a store of their own (``--default-storage-provider fs``): every rule run in another working folder.

    python benchmarks/storage.py [study retrain withheld]

What a rule reads without declaring it is not there in the folder where it runs. At the end the store is compared with
the results of a working folder without one. Needs ``pip install ".[slurm]"`` and rsync.
"""

import argparse
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

from diagnosis import Case, simulate_bench
from house import build, environment, snakemake
from kills import of_the_study, plain

SMOKE = ("--config", "experiment=smoke", "overrides=search.workers=1 training.epochs=100")
#: branch -> its target and the rules that lead to it, in order
BRANCHES = {
    "study": (
        "study",
        "compile_simulation simulate_shard reconstruct_features compute_bound simulate_examples write_configuration "
        "search_network choose_network train_identifier export_network evaluate_identification draw_report "
        "prepare_tracking track_evaluation",
    ),
    "retrain": ("retrain", "diagnose_gap retrain_network"),
    "withheld": ("withheld_smallest", "diagnose_cases score_cases"),
}


def kept(folder: Path) -> dict[str, bytes]:
    """Results that hold no times; what a job keeps for itself to go on with after a kill is none."""
    files = [p for p in folder.rglob("*") if p.is_file() and ".snakemake" not in p.name and _compared(p)]
    return {str(p.relative_to(folder)): plain(p) for p in sorted(files)}


def _compared(path: Path) -> bool:
    scratch = any(part.startswith("cases_") for part in path.parts)
    return not scratch and (of_the_study(path) or ("diagnoses" in path.parts and path.suffix in (".json", ".yaml")))


def run(folder: Path, command: list[str], package: Path) -> None:
    """Run a command in a folder, with the package and the compiled code of another."""
    ran = subprocess.run(command, cwd=folder, env=environment(package), capture_output=True, text=True)
    assert ran.returncode == 0, (ran.stdout + ran.stderr)[-4000:]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("branches", nargs="*", default=list(BRANCHES), help=f"of {', '.join(BRANCHES)}")
    args = parser.parse_args()
    if not shutil.which("rsync"):
        raise SystemExit("needs rsync, with which Snakemake copies from and to the store: apt-get install rsync")
    with tempfile.TemporaryDirectory() as name:
        top = Path(name)
        bench, store = top / "bench", top / "store"
        simulate_bench(bench, Case(3, 1.0, ("effects.cogging.a=0.01",)))
        local = build(top / "local")
        for branch in args.branches:
            target, rules = BRANCHES[branch][0], BRANCHES[branch][1].split()
            settings = (*SMOKE, f"bench={bench}") if branch == "retrain" else SMOKE
            start = time.monotonic()
            run(local, snakemake(target, *settings), local)
            alone, start = time.monotonic() - start, time.monotonic()
            for rule in rules:
                elsewhere = build(top / f"folder_{rule}", local)
                stored = ("--default-storage-provider", "fs", "--default-storage-prefix", str(store))
                run(elsewhere, snakemake(target, "--until", rule, *stored, *settings), local)
                shutil.rmtree(elsewhere)
            took = time.monotonic() - start
            expected, got = kept(local / "results"), kept(store / "results")
            different = [n for n in expected | got if expected.get(n) != got.get(n)]
            assert not different, f"{branch}: differ: {different}"
            done = f"{len(got)} files the same bits, {len(rules)} folders"
            print(f"{branch}: {done}, {took:.0f} s, {alone:.0f} s in one", flush=True)


if __name__ == "__main__":
    main()

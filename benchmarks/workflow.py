"""Times of the workflow in a copy of its own: 600 runs simulated and written, the default study; memory by runs.

    python benchmarks/workflow.py [--study]

Prints a table in Markdown. Compilation is done beforehand and timed by itself.
"""

import argparse
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def snakemake(house: Path, *arguments: str) -> tuple[float, float]:
    """Run the workflow; elapsed and processor seconds."""
    environment = {**os.environ, "PYTHONPATH": str(house / "src"), "OMP_NUM_THREADS": "1"}
    environment["NUMBA_CACHE_DIR"] = str(house / "compiled")
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    command = [sys.executable, "-m", "snakemake", "--cores", "all", "--quiet=all", *arguments]
    subprocess.run(command, cwd=house, env=environment, check=True, stderr=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.perf_counter() - start, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def peak_memory(house: Path, runs: int) -> float:
    """Largest resident size (MB) of a job that simulates one shard of a part of so many runs."""
    code = (
        "import resource, sys\nfrom emafault import config, dataset\n"
        f"spec = config.dataset_spec(config.compose('paper', ['sampling.runs={runs}', 'recording.duration=0.2',"
        " 'recording.discard=0.02']), 'training')\n"
        "dataset.simulate_shard(sys.argv[1], spec | {'shards': 1}, 0)\n"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)"
    )
    environment = {**os.environ, "PYTHONPATH": str(house / "src"), "NUMBA_CACHE_DIR": str(house / "compiled")}
    target = str(house / "memory.nc")
    done = subprocess.run(
        [sys.executable, "-c", code, target], env=environment, check=True, capture_output=True, text=True
    )
    return float(done.stdout)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--study", action="store_true", help="time the whole default study too")
    args = parser.parse_args()
    print(f"{os.cpu_count()} cores\n\n| what | elapsed (s) | processor (s) |\n|---|---|---|")
    with tempfile.TemporaryDirectory() as name:
        house = Path(name)
        for folder in ("workflow", "profiles", "conf", "src", "data"):
            ignore = shutil.ignore_patterns("__pycache__", "*.egg-info")
            shutil.copytree(ROOT / folder, house / folder, ignore=ignore)
        shutil.copy(ROOT / "Snakefile", house)
        print("| compiling the simulation | {:.1f} | {:.1f} |".format(*snakemake(house, "results/compiled.txt")))
        shards = [f"results/datasets/paper/training/shard_{n}.nc" for n in range(4)]
        print("| 600 runs of 1 s simulated and written | {:.1f} | {:.1f} |".format(*snakemake(house, *shards)))
        if args.study:
            print("| the rest of the default study | {:.0f} | {:.0f} |".format(*snakemake(house)))
            print("| a rerun that does nothing | {:.1f} | {:.1f} |".format(*snakemake(house)))
        print("\n| runs of 0.2 s in one shard | largest resident size (MB) |\n|---|---|")
        for runs in (60, 600, 6000):
            print(f"| {runs} | {peak_memory(house, runs):.0f} |")


if __name__ == "__main__":
    main()

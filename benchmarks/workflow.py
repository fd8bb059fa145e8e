"""Times of the workflow in a copy of its own: 600 runs simulated and written, the default study; memory by runs.

    python benchmarks/workflow.py [--study] [--runs N]

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


#: stages that read or write every run -> what a job of it calls; ``folder`` and ``shards`` are where it works
STAGES = {
    "simulate": "dataset.simulate_shard(shards[0], config.dataset_spec(c, 'training') | {'shards': 1}, 0)",
    "reconstruct, paper": (
        "features.reconstruct_features(shards, config.reconstruction_spec(c, 'paper'), folder / 'p.nc')"
    ),
    "reconstruct, weighted": (
        "features.reconstruct_features(shards, config.reconstruction_spec(c, 'weighted_floating'), folder / 'w.nc')"
    ),
    "fit the closed form": (
        "networks.train_identifier('closed_form', folder / 'w.nc', config.network_spec(c, 'closed_form'),"
        " folder / 'c' / 'history.json')"
    ),
    "train one network, three epochs": (
        "networks.train_identifier('network', folder / 'w.nc', config.network_spec(c, 'network') | {'seeds': 1},"
        " folder / 'n' / 'history.json')"
    ),
}


def peak_memory(house: Path, runs: int, stage: str) -> float:
    """Largest resident size (MB) of one job of a stage with so many runs in one shard."""
    code = (
        "import resource, sys\nfrom pathlib import Path\nfrom emafault import config, dataset\n"
        "from emafault.study import features, networks\n"
        f"c = config.compose('paper', ['sampling.runs={runs}', 'recording.duration=0.2', 'recording.discard=0.02',"
        " 'training.epochs=3', 'training.reweight=0'])\n"
        f"folder = Path(sys.argv[1])\nshards = [folder / 'shard_0.nc']\n{STAGES[stage]}\n"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)"
    )
    environment = {**os.environ, "PYTHONPATH": str(house / "src"), "NUMBA_CACHE_DIR": str(house / "compiled")}
    done = subprocess.run(
        [sys.executable, "-c", code, str(house)], env=environment, check=True, capture_output=True, text=True
    )
    return float(done.stdout)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--study", action="store_true", help="time the whole default study too")
    parser.add_argument("--runs", type=int, default=6000, help="largest number of runs whose memory is measured")
    args = parser.parse_args()
    print(f"{os.cpu_count()} cores\n\n| what | elapsed (s) | processor (s) |\n|---|---|---|")
    with tempfile.TemporaryDirectory() as name:
        house = Path(name)
        for folder in ("workflow", "profiles", "conf", "src", "data"):
            ignore = shutil.ignore_patterns("__pycache__", "*.egg-info")
            shutil.copytree(ROOT / folder, house / folder, ignore=ignore)
        shutil.copy(ROOT / "Snakefile", house)
        print("| compiling the simulation | {:.1f} | {:.1f} |".format(*snakemake(house, "results/compiled.txt")))
        shards = [f"results/datasets/paper/training/shard_{n}.nc" for n in range(2)]
        print("| 600 runs of 1 s simulated and written | {:.1f} | {:.1f} |".format(*snakemake(house, *shards)))
        if args.study:
            print("| the rest of the default study | {:.0f} | {:.0f} |".format(*snakemake(house)))
            print("| a rerun that does nothing | {:.1f} | {:.1f} |".format(*snakemake(house)))
        print(f"\n| largest resident size (MB) of runs of 0.2 s in one shard | 600 | {args.runs} |\n|---|---|---|")
        used = {runs: [peak_memory(house, runs, stage) for stage in STAGES] for runs in (600, args.runs)}
        for stage, few, many in zip(STAGES, used[600], used[args.runs]):
            print(f"| {stage} | {few:.0f} | {many:.0f} |")


if __name__ == "__main__":
    main()

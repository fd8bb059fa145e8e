"""What a study takes by its number of runs, and what a million would: processor time, memory, disk; as a plot.

    python benchmarks/scale.py [--runs 600 6000 60000] [--plot docs/scale.png] [--epochs 10]

Runs of 1 s are simulated, written, reconstructed by ``weighted_floating`` and joined as the workflow's jobs do it,
shard by shard and block by block; each job is a process of its own, one after the other, and a block's shards are
removed once they are reconstructed. Then the closed form and the paper's network, one seed and so many epochs, are
trained on all runs. Prints a table in Markdown.
"""

import argparse
import os
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from emafault import config
from emafault.dataset import simulate_shard
from emafault.study.features import join_features, reconstruct_features
from emafault.study.networks import train_identifier

METHOD = "weighted_floating"
PLANNED = 1_000_000


@dataclass
class Taken:
    """What a stage took in all its jobs."""

    processor: float = 0.0  # s
    memory: float = 0.0  # MB, the largest of a job
    jobs: int = 0


def job(taken: Taken, stage: Callable, *arguments) -> None:
    """Run a stage in a process of its own and add what it took."""
    pid = os.fork()
    if pid == 0:
        with open(os.devnull, "w") as nothing:
            os.dup2(nothing.fileno(), 2)
        stage(*arguments)
        os._exit(0)
    _, status, usage = os.wait4(pid, 0)
    assert status == 0, f"{stage.__name__} failed"
    taken.processor += usage.ru_utime + usage.ru_stime
    taken.memory = max(taken.memory, usage.ru_maxrss / 1024.0)
    taken.jobs += 1


def measure(runs: int, folder: Path, epochs: int) -> tuple[dict[str, Taken], float]:
    """What every stage takes, and how much all shards would take on disk (MB)."""
    c = config.compose("paper", [f"sampling.runs={runs}", f"training.epochs={epochs}", "training.reweight=0"])
    data, how = config.dataset_spec(c, "training"), config.reconstruction_spec(c, METHOD)
    taken = {name: Taken() for name in ("simulate", "reconstruct", "join", "closed form", f"network, {epochs} epochs")}
    disk, blocks = 0.0, []
    size = config.SHARDS_OF_A_BLOCK
    for first in range(0, data["shards"], size):
        shards = [folder / f"shard_{n}.nc" for n in range(first, min(first + size, data["shards"]))]
        for n, shard in enumerate(shards, start=first):
            job(taken["simulate"], simulate_shard, shard, data, n)
        blocks.append(folder / f"block_{first}.nc")
        job(taken["reconstruct"], reconstruct_features, [str(s) for s in shards], how, blocks[-1])
        for shard in shards:
            disk += shard.stat().st_size / 1e6
            shard.unlink()
    features = folder / "features.nc"
    job(taken["join"], join_features, blocks, features)
    for name, estimator in (("closed form", "closed_form"), (f"network, {epochs} epochs", "network")):
        spec = config.network_spec(c, estimator) | ({"seeds": 1} if estimator == "network" else {})
        job(taken[name], train_identifier, estimator, str(features), spec, folder / estimator / "history.json")
    for path in (*blocks, features):
        path.unlink()
    return taken, disk


def draw(found: dict[int, dict[str, Taken]], path: Path) -> None:
    """Processor time and memory over the number of runs, with a line of slope one through the largest."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    numbers = sorted(found)
    for name in found[numbers[0]]:
        times = [found[n][name].processor for n in numbers]
        (line,) = left.loglog(numbers, times, "o-", label=name)
        left.loglog(
            [numbers[-1], PLANNED], [times[-1], times[-1] * PLANNED / numbers[-1]], "--", color=line.get_color()
        )
        right.semilogx(numbers, [found[n][name].memory for n in numbers], "o-")
    left.set(xlabel="runs", ylabel="processor time (s), dashed: planned")
    right.set(xlabel="runs", ylabel="memory of the largest job (MB)", ylim=(0, None))
    left.legend(fontsize="small")
    for axes in (left, right):
        axes.grid(alpha=0.3)
    figure.savefig(path, dpi=110)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, nargs="+", default=[600, 6000, 60000])
    parser.add_argument("--plot", type=Path, help="file for the plot")
    parser.add_argument("--epochs", type=int, default=10)
    args = parser.parse_args()
    found = {}
    print("| runs | stage | jobs | processor (s) | a run (ms) | memory (MB) |\n|---|---|---|---|---|---|", flush=True)
    for runs in args.runs:
        start = time.monotonic()
        with tempfile.TemporaryDirectory() as name:
            found[runs], disk = measure(runs, Path(name), args.epochs)
        for stage, t in found[runs].items():
            each = 1e3 * t.processor / runs
            print(f"| {runs} | {stage} | {t.jobs} | {t.processor:.1f} | {each:.2f} | {t.memory:.0f} |", flush=True)
        print(f"| {runs} | all, elapsed {time.monotonic() - start:.0f} s; shards {disk:.0f} MB | | | | |", flush=True)
        if args.plot:
            draw(found, args.plot)
    last = max(found)
    hours = sum(t.processor for t in found[last].values()) / last * PLANNED / 3600.0
    print(f"\n{PLANNED} runs: {hours:.1f} h of one core, {disk / last * PLANNED / 1e6:.2f} TB of shards")


if __name__ == "__main__":
    main()

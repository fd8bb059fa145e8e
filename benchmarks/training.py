"""What training on many runs takes in processor time and memory, without simulating them.

    python benchmarks/training.py [--runs 6000 60000 1000000] [--epochs 2]

Features are the fault laws of sampled faults with the noise of a plateau fit, written block by block as the workflow
writes them. Then the closed form and the paper's network, one seed of so many epochs with its folds, are trained on
them, each in a process of its own. Prints a table in Markdown.
"""

import argparse
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from emafault import closed_form, config
from emafault.faults import sample_faults
from emafault.reconstruction.features import Features
from emafault.study.features import FeatureTable, write_features
from emafault.study.networks import train_identifier
from scale import Taken, job

BLOCK = 2000
NOISE = np.repeat([2e-3, 1e-3], 3)  # of R and k, relative


def tables(runs: int) -> Iterator[FeatureTable]:
    """Features of sampled faults, block by block."""
    actuator, rng = config.reference_actuator(), np.random.default_rng(1)
    ranges = {"shorted_turns": (0.0, 0.1), "eccentricity": (0.0, 0.2), "temperature": (-50.0, 70.0)}
    for first in range(0, runs, BLOCK):
        count = min(BLOCK, runs - first)
        faults = sample_faults(count, **ranges, seed=first)
        six = np.concatenate(closed_form.forward(faults, actuator, 0.0, faults[:, 5]), axis=1)
        six *= 1.0 + NOISE * rng.normal(size=six.shape)
        covariance = (NOISE * six)[:, :, None] ** 2 * np.eye(6)
        R, k, none = six[:, :3], six[:, 3:], np.zeros((count, 3))
        yield FeatureTable(Features(R, k, none, none, covariance), faults, np.full(count, 20.0))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, nargs="+", default=[6000, 60_000, 1_000_000])
    parser.add_argument("--epochs", type=int, default=2)
    args = parser.parse_args()
    c = config.compose("paper", [f"training.epochs={args.epochs}", "training.reweight=0"])
    print("| runs | trained | processor (s) | memory (MB) |\n|---|---|---|---|", flush=True)
    for runs in args.runs:
        with tempfile.TemporaryDirectory() as name:
            features = Path(name) / "training_weighted.nc"
            write_features(features, tables(runs), runs)
            for estimator in ("closed_form", "network"):
                spec, taken = config.network_spec(c, estimator), Taken()
                seed = 0 if estimator == "network" else None
                history = Path(name) / estimator / "history.json"
                job(taken, train_identifier, estimator, str(features), spec, history, None, seed)
                print(f"| {runs} | {estimator} | {taken.processor:.1f} | {taken.memory:.0f} |", flush=True)


if __name__ == "__main__":
    main()

"""Makes ``examples/bench``: four recordings of one simulated unit, in which a diagnosis has something to find.

    python examples/make_bench.py

The unit is within its specification but off nominal. Its motor cogs, which the nominal simulator lacks, and a torque
waves 2.4 times a turn of the rotor, which no catalogue lists. Two recordings are healthy; two have shorted turns in
phase a.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from emafault.cli import main
from emafault.io.recording import VARIABLES, read_recording, write_recording

FOLDER = Path(__file__).with_name("bench")
UNIT = [
    "unit=tolerance", "--unit-seed", "7", "--unit", "example", "recording.duration=0.8", "recording.discard=0.05",
    "effects.cogging.a=0.005", "unlisted=[{place: torque, form: order, order: 2.4, amplitude: 0.004, phase: 0.5}]",
]  # fmt: skip
SHORTED = "Na=0.05"
RECORDINGS = {
    "healthy_cold": ["command=parabolic", "--fault", "dT=-20", "--health", "healthy"],
    "healthy_warm": ["command=reversal", "--fault", "dT=30", "--health", "healthy"],
    "shorted_cold": ["command=sine", "--fault", SHORTED, "dT=-20", "--health", "seeded"],
    "shorted_warm": ["command=parabolic", "--fault", SHORTED, "dT=30", "--health", "seeded"],
}


def make() -> None:
    """Simulate, round to single precision, which halves a file, and write."""
    FOLDER.mkdir(exist_ok=True)
    for seed, (name, more) in enumerate(RECORDINGS.items()):
        path = FOLDER / f"{name}.nc"
        if main(["simulate", str(path), *UNIT, *more, "--seed", str(seed), "--force"]):
            raise SystemExit(1)
        recording = read_recording(path)
        rounded = {name: getattr(recording, name).astype(np.float32).astype(float) for name in VARIABLES}
        write_recording(path, replace(recording, **rounded))


if __name__ == "__main__":
    make()

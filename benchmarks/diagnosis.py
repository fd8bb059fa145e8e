"""Time to a verdict: ``emafault diagnose`` on eight recordings of 1 s, beside simulating these recordings once.

    python benchmarks/diagnosis.py [--effects effects.stribeck.a=0.02]

The first diagnosis compiles and is not counted; the start of the interpreter is. The verdict is written and shown
first, pictures and tracking follow.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from emafault import config
from emafault.dataset import simulate_recording

COMMANDS = ("parabolic", "sine", "reversal", "ramp", "chirp", "parabolic", "sine", "reversal")
TEMPERATURES = (20.0, 20.0, 60.0, 20.0, -30.0, -30.0, 60.0, 20.0)  # degC


def simulate_bench(folder: Path, effects: list[str]) -> None:
    """Write eight recordings of one unit, each with another seed."""
    from emafault.recording import write_recording

    for n, (command, temperature) in enumerate(zip(COMMANDS, TEMPERATURES, strict=True)):
        composed = config.compose("paper", [f"command={command}", "recording.duration=1.0", "unit=tolerance", *effects])
        spec = config.dataset_spec(composed, "fresh") | {"seed": n, "unit_seed": 1}
        fault = np.array([0.01, 0.0, 0.0, 0.0, 0.01, temperature - 20.0])
        write_recording(folder / f"recording_{n}.nc", simulate_recording(spec, fault))


def watch(command: list[str], environment: dict[str, str], folder: str) -> tuple[str, tuple[float, float]]:
    """Run a diagnosis: its first line, and the seconds until that line and until the end."""
    start = time.perf_counter()
    pipe, silent = subprocess.PIPE, subprocess.DEVNULL
    with subprocess.Popen(command, env=environment, cwd=folder, stdout=pipe, stderr=silent, text=True) as running:
        assert running.stdout is not None
        first = running.stdout.readline().strip()
        verdict = time.perf_counter() - start
        running.stdout.read()
    if running.returncode:
        raise subprocess.CalledProcessError(running.returncode, command)
    return first, (verdict, time.perf_counter() - start)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--effects", nargs="*", default=["effects.stribeck.a=0.02"], metavar="OVERRIDE")
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    with tempfile.TemporaryDirectory() as scratch:
        bench = Path(scratch) / "bench"
        bench.mkdir()
        simulate_bench(bench, options.effects)
        start = time.perf_counter()
        simulate_bench(bench, options.effects)
        once = time.perf_counter() - start
        command = [sys.executable, "-c", "from emafault.cli import main; main()", "diagnose", str(bench)]
        command += ["--out", str(Path(scratch) / "out")]
        taken: list[tuple[float, float]] = []
        for _ in range(options.repeats + 1):
            shown, seconds = watch(command, environment, scratch)
            taken.append(seconds)
        print(shown)
        best = min(verdict for verdict, _ in taken[1:])
        print(f"eight recordings of 1 s made and written once: {once:.2f} s")
        worst = max(verdict for verdict, _ in taken[1:])
        print(f"from the command to the verdict: {best:.1f} s (to {worst:.1f}), {best / once:.0f} times that")
        print(f"with the report and its MLflow run: {min(whole for _, whole in taken[1:]):.1f} s")


if __name__ == "__main__":
    main()

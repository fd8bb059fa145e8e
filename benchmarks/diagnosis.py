"""Time and memory of ``emafault diagnose``, over benches of several sizes that are simulated first.

    python benchmarks/diagnosis.py [--only 8x1 8x10] [--repeats 3] [--long] [--markdown]

Times are from the command, start of the interpreter included, to the printed verdict and to the end of the command,
with its page and its MLflow run; of several repeats the least. CPU is that of all processes, memory the most that they
have at one time together, what they share counted once. The first diagnosis compiles and is not counted.
``ratio`` is CPU to the verdict over that of the first bench of the same run.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from emafault import config
from emafault.dataset import simulate_recording
from emafault.io.recording import write_recording

USUAL = ("parabolic", "sine", "reversal", "ramp", "chirp", "parabolic", "sine", "reversal")
STEPS = ("step", "parabolic", "step", "sine", "reversal", "step", "ramp", "chirp")
TEMPERATURES = (20.0, 20.0, 60.0, 20.0, -30.0, -30.0, 60.0, 20.0)  # degC
STRONG = ("effects.stribeck.a=0.02", "effects.hall_displacement.d_a=2.0", "effects.current_gain.g_b=1.02")
LOOK = 0.05  # s, between two looks at the memory
TICK = os.sysconf("SC_CLK_TCK")


@dataclass(frozen=True)
class Case:
    """A bench to be simulated: number of recordings, their length (s), effects, commands, whether it is healthy, and
    overrides of each recording's own by its number."""

    count: int
    length: float
    effects: tuple[str, ...] = ()
    commands: tuple[str, ...] = USUAL
    healthy: bool = False
    of: Callable[[int], tuple[str, ...]] | None = None


CASES = {
    "8x1": Case(8, 1.0, ("effects.stribeck.a=0.02",)),
    "8x1_none": Case(8, 1.0),
    "8x1_strong": Case(8, 1.0, STRONG),
    "8x1_steps": Case(8, 1.0, ("effects.dynamic_eccentricity.d=0.02",), STEPS),
    "3x1": Case(3, 1.0, ("effects.cogging.a=0.01",)),
    "20x1": Case(20, 1.0, ("effects.stribeck.a=0.02",)),
    "60x1": Case(60, 1.0, ("effects.stribeck.a=0.02",)),
    "3x10_none": Case(3, 10.0),
    "8x10": Case(8, 10.0, ("effects.stribeck.a=0.02",)),
}
LONG = {"60x10": Case(60, 10.0, ("effects.stribeck.a=0.02",))}


@dataclass(frozen=True)
class Taken:
    """What one diagnosis took: seconds and CPU seconds to the verdict and in all, and the most memory (MB)."""

    verdict: float
    end: float
    verdict_cpu: float
    cpu: float
    memory: float


def simulate_bench(folder: Path, case: Case) -> int:
    """Write recordings of one unit, each with another seed; number of samples in all."""
    samples = 0
    for n in range(case.count):
        changes = [f"command={case.commands[n % len(case.commands)]}", f"recording.duration={case.length}"]
        own = case.of(n) if case.of else ()
        composed = config.compose("paper", [*changes, "unit=tolerance", *case.effects, *own])
        spec = config.dataset_spec(composed, "fresh") | {"seed": n, "unit_seed": 1}
        seeded = 0.0 if case.healthy else 0.01
        fault = np.array([seeded, 0.0, 0.0, 0.0, seeded, TEMPERATURES[n % len(TEMPERATURES)] - 20.0])
        recording = simulate_recording(spec, fault)
        write_recording(folder / f"recording_{n:02d}.nc", recording)
        samples += len(recording.time)
    return samples


def family(process: int) -> list[int]:
    """A process and all that come from it."""
    out = [process]
    for tasks in Path(f"/proc/{process}/task").glob("*/children"):
        for child in tasks.read_text().split():
            out += family(int(child))
    return out


def memory_of(process: int) -> float:
    """Memory (MB) of a process and its children; what several share counts once."""
    total = 0
    for each in family(process):
        lines = Path(f"/proc/{each}/smaps_rollup").read_text().splitlines()
        total += sum(int(line.split()[1]) for line in lines if line.startswith("Pss:"))
    return total / 1024.0


def cpu_of(process: int) -> float:
    """CPU seconds of a process, its children and those that have ended."""
    total = 0
    for each in family(process):
        fields = Path(f"/proc/{each}/stat").read_text().rsplit(")", 1)[1].split()
        total += sum(int(x) for x in fields[11:15])
    return total / TICK


def watch(command: list[str], environment: dict[str, str], folder: str) -> tuple[str, Taken]:
    """Run a diagnosis: its first line, and what it took."""
    start = time.perf_counter()
    most, ended = 0.0, threading.Event()
    with subprocess.Popen(
        command, env=environment, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as running:
        assert running.stdout is not None

        def look() -> None:
            nonlocal most
            while not ended.wait(LOOK):
                try:
                    most = max(most, memory_of(running.pid))
                except OSError:  # one that ends meanwhile
                    continue

        looking = threading.Thread(target=look)
        looking.start()
        first = running.stdout.readline().strip()
        verdict, verdict_cpu = time.perf_counter() - start, cpu_of(running.pid) if first else 0.0
        running.stdout.read()
        _, status, used = os.wait4(running.pid, 0)
        running.returncode = os.waitstatus_to_exitcode(status)
        end = time.perf_counter() - start
        ended.set()
        looking.join()
    if running.returncode:
        raise subprocess.CalledProcessError(running.returncode, command)
    return first, Taken(verdict, end, verdict_cpu, used.ru_utime + used.ru_stime, most)


def row(name: str, samples: int, all_taken: list[Taken], first: float) -> list[str]:
    """A row of the table."""
    best = min(all_taken, key=lambda t: t.verdict_cpu)
    thousands = samples / 1000.0
    return [
        name, f"{thousands:.0f}", f"{min(t.verdict for t in all_taken):.1f}", f"{min(t.end for t in all_taken):.1f}",
        f"{best.verdict_cpu:.1f}", f"{best.cpu:.1f}", f"{best.verdict_cpu / first:.2f}",
        f"{1e3 * best.verdict_cpu / thousands:.0f}", f"{best.memory:.0f}", f"{best.memory / thousands:.2f}",
    ]  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=[*CASES, *LONG], metavar="BENCH", help=", ".join([*CASES, *LONG]))
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--long", action="store_true", help="60 recordings of 10 s too")
    parser.add_argument("--markdown", action="store_true", help="the table as markdown")
    options = parser.parse_args()
    cases = {
        n: c for n, c in (CASES | LONG).items() if n in (options.only or [*CASES, *(LONG if options.long else ())])
    }
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    head = ["bench", "samples (10^3)", "verdict (s)", "end (s)", "CPU to verdict (s)", "CPU (s)", "ratio"]
    head += ["CPU to verdict a 10^3 samples (ms)", "memory (MB)", "a 10^3 samples (MB)"]
    between = " | " if options.markdown else "; "
    print(
        between.join(head) if not options.markdown else f"| {between.join(head)} |\n|{'---|' * len(head)}", flush=True
    )
    first = 0.0
    with tempfile.TemporaryDirectory() as scratch:
        for n, (name, case) in enumerate(cases.items()):
            bench = Path(scratch) / name
            bench.mkdir()
            samples = simulate_bench(bench, case)
            command = [
                sys.executable,
                "-c",
                "import sys; from emafault.cli import main; sys.exit(main())",
                "diagnose",
                str(bench),
            ]
            command += ["--out", str(Path(scratch) / f"out_{name}")]
            if n == 0:
                watch(command, environment, scratch)  # compiles
            found = [watch(command, environment, scratch) for _ in range(options.repeats)]
            taken = [t for _, t in found]
            first = first or min(t.verdict_cpu for t in taken)
            text = between.join(row(name, samples, taken, first))
            print(f"| {text} |" if options.markdown else f"{text}; {found[0][0]}", flush=True)


if __name__ == "__main__":
    main()

"""What one simulated second costs, and how exact it is, by the engine: the nominal parabolic run from rest.

    python benchmarks/simulation.py [--window SECONDS]

Prints a table in Markdown. Accuracy is over the window's second half, against the fixed step of 0.1 us: of mean speed,
of mean active current (half the sum of the magnitudes of the recorded mean phase currents) and of the ripple (root mean
square of the active current at the intervals' ends about its mean). A switched loop is chaotic: two
exact engines differ by the spread of so short a window. Ratios are between engines that simulate one run alone; that
eight runs side by side cost less each is a gain of the event-driven engine's lanes and stands in a table of its own.
"""

import argparse
import time
from collections.abc import Callable

import numpy as np

from emafault.actuator.commands import command_positions
from emafault.actuator.conduction import LANES
from emafault.actuator.fixed_step import simulate_fixed_step
from emafault.actuator.parameters import make_runs
from emafault.actuator.simulate import simulate
from emafault.actuator.unlisted import term
from emafault.config import reference_actuator
from solve_ivp_engine import simulate_solve_ivp

PAPER_SECONDS = 50.0  # a run of 1 s in the seed paper, on one desktop core; quoted, not measured


def figures(signals: dict[str, np.ndarray]) -> np.ndarray:
    """Mean speed (rad/s), mean active current (A) and ripple (A) over the second half."""
    part = slice(signals["rotor_speed"].shape[1] // 2, None)
    end = np.abs(signals["phase_current_end"][0, part]).sum(1) / 2.0
    active = np.abs(signals["phase_current"][0, part]).sum(1) / 2.0
    return np.array([signals["rotor_speed"][0, part].mean(), active.mean(), end.std()])


def processor_time(engine: Callable[[float], dict], duration: float, repeats: int) -> float:
    """Least processor time (s) per simulated second."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        engine(duration)
        times.append(time.process_time() - start)
    return min(times) / duration


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--window", type=float, default=0.05, help="simulated seconds that are compared")
    window = parser.parse_args().window
    actuator, interval = reference_actuator(), 2e-4
    runs = make_runs(actuator, np.zeros((1, 6)))
    command = command_positions("parabolic", {"acceleration": 0.3}, 1.0, actuator.control_period)

    engines: dict[str, tuple[Callable[[float], dict], float, int]] = {  # engine, timed duration (s), repeats
        "event-driven, compiled": (lambda d: simulate(runs, command, d, interval), 1.0, 7),
        "fixed step 1 us, compiled": (lambda d: simulate_fixed_step(runs, command, d, interval, 1e-6), 0.5, 2),
        "fixed step 2 us, compiled": (lambda d: simulate_fixed_step(runs, command, d, interval, 2e-6), 0.5, 2),
        "SciPy solve_ivp (RK45, rtol 1e-7)": (lambda d: simulate_solve_ivp(actuator, command, d, interval), window, 0),
    }
    truth = figures(simulate_fixed_step(runs, command, window, interval, 1e-7))
    base = 0.0
    print(
        "| one run alone | processor time per simulated s (s) | ratio | speed off | active current off | ripple off |"
    )
    print("|---|---|---|---|---|---|")
    for name, (engine, duration, repeats) in engines.items():
        start = time.process_time()
        got = figures(engine(window))  # compiles what is compiled
        spent = (time.process_time() - start) / window
        if repeats:
            spent = processor_time(engine, duration, repeats)
        base = base or spent
        off = " | ".join(f"{x:.1e}" for x in got / truth - 1.0)
        print(f"| {name} | {spent:.4f} | {spent / base:.3g} | {off} |", flush=True)
    print(f"| the seed paper's block diagram (quoted) | {PAPER_SECONDS:.0f} | {PAPER_SECONDS / base:.0f} | | | |")
    print(f"\nreference: {truth[0]:.4f} rad/s, {truth[1]:.4f} A, ripple {truth[2]:.4f} A\n")

    eight = make_runs(actuator, np.zeros((LANES, 6)))
    wave = term("torque", "order", amplitude=0.01, order=2.4, phase=0.0)[None]
    print(f"| {LANES} runs | processor time per run and simulated s (s) | over one run alone |")
    print("|---|---|---|")
    many: dict[str, Callable[[float], dict]] = {
        "event-driven, side by side in lanes": lambda d: simulate(eight, command, d, interval),
        "the same with a wave in the torque that no catalogue lists": lambda d: simulate(
            eight, command, d, interval, terms=wave
        ),
        "fixed step 2 us, one after another": lambda d: simulate_fixed_step(eight, command, d, interval, 2e-6),
    }
    for name, engine in many.items():
        engine(window)
        spent = processor_time(engine, 0.5, 2) / LANES
        print(f"| {name} | {spent:.4f} | {spent / base:.3g} |", flush=True)


if __name__ == "__main__":
    main()

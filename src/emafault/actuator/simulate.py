"""Simulation of batches of runs: noise-free recorded signals from run records and a command."""

from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np

from ..errors import InputError
from .kernel import run_batch

PHASE_SIGNALS = ("phase_voltage", "phase_current", "phase_current_end")
SIGNALS = (*PHASE_SIGNALS, "rotor_speed", "rotor_angle", "output_position", "bus_voltage")


def time_axis(duration: float, interval: float) -> np.ndarray:
    """(time,) ends of the recording intervals (s)."""
    return interval * np.arange(1, round(duration / interval) + 1)


def commanded_position(command: np.ndarray, control_period: float, time: np.ndarray) -> np.ndarray:
    """Command at the recording instants (rad): linear between ticks; (run, tick+1) -> (run, time)."""
    where = np.minimum(time / control_period, command.shape[-1] - 1.000001)
    low = where.astype(int)
    part = where - low
    return command[..., low] * (1.0 - part) + command[..., low + 1] * part


def simulate(
    runs: np.ndarray, command: np.ndarray, duration: float, interval: float, threads: int = 1
) -> dict[str, np.ndarray]:
    """Simulate runs of equal length and return their recorded signals without noise.

    Parameters
    ----------
    runs : (run,) records of ``RUN_DTYPE``
    command : (tick+1,) or (run, tick+1) commanded user-shaft angle at the control ticks (rad)
    duration, interval : length of the record and of one recording interval (s)
    threads : runs are shared out over so many threads; the result does not depend on it

    Returns
    -------
    phase_voltage (V), phase_current (A), phase_current_end (A): (run, time, phase); rotor_speed (rad/s),
    rotor_angle (rad), output_position (rad), commanded_position (rad), bus_voltage (V): (run, time)

    Raises
    ------
    InputError : an interval or duration that is not positive
    """
    if not (interval > 0.0 and duration >= interval):
        raise InputError(
            f"interval {interval} s and duration {duration} s: both must be positive, the interval shorter"
        )
    time = time_axis(duration, interval)
    command = np.ascontiguousarray(np.atleast_2d(command), dtype=float)
    n = len(runs)
    out = {name: np.empty((n, len(time), 3)) for name in PHASE_SIGNALS}
    out |= {name: np.empty((n, len(time))) for name in SIGNALS[3:]}
    shared = len(command) == 1
    arrays = [out[name] for name in SIGNALS]

    def part(rows: slice) -> None:
        run_batch(runs[rows], command if shared else command[rows], shared, interval, *(a[rows] for a in arrays))

    if threads <= 1 or n < 2:
        part(slice(0, n))
    else:
        pieces = min(n, 4 * threads)
        bounds = np.linspace(0, n, pieces + 1).astype(int)
        with ThreadPoolExecutor(threads) as pool:
            list(pool.map(part, [slice(a, b) for a, b in pairwise(bounds) if b > a]))
    position = commanded_position(command, float(runs["control_period"][0]), time)
    out["commanded_position"] = np.broadcast_to(position, (n, len(time))).copy() if shared else position
    return out

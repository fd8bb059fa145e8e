"""What a converter's coarse steps add to a current that changes slowly; to others they add noise.

Where the sensors' noise shakes the current over a step, the error of its mean is a sawtooth of the true current,
rounded off (Widrow and Kollar 2008, Quantization Noise, chapter 3). The true one is what the torque balance needs at
the point. Where nothing shakes it, the error changes evenly while the recorded level stays, and an error of each such
stretch's own stands for that.
"""

from collections.abc import Callable
from copy import copy

import numpy as np
from scipy.ndimage import uniform_filter1d

from . import torque
from .dual import Dual, Number
from .point import Point, State
from .signals import Signals, odd

HARMONICS = 3  # of the sawtooth, with 83 % of its variance
CALM, PASSES = 3e-3, 3  # s, that what the torque balance needs is averaged over, so many times: its noise is steep


def harmonics(name: str, recording: str) -> list[tuple[str, int, Callable]]:
    """Names, harmonics and functions of what rounding adds to a channel."""
    return [(f"{name}.{f.__name__}_{k}@{recording}", k, f) for k in range(1, HARMONICS + 1) for f in (np.sin, np.cos)]


def names_of(rec: Signals) -> dict[str, float]:
    """Names of what a recording's currents may be off by, and the standard deviations of their priors (A)."""
    if rec.current_step == 0.0:
        return {}
    sawtooth = {n: rec.current_step / (np.sqrt(2.0) * np.pi * k) for n, k, _ in harmonics("steps", rec.name)}
    return sawtooth | dict.fromkeys(errors_of_stretches(rec), float(rec.current_step / np.sqrt(12.0)))


def errors_of_stretches(rec: Signals) -> dict[str, np.ndarray]:
    """Errors at the start and at the end of each stretch, and what each of them is along it; (sample,) by name."""
    return rec.once(("rounding",), lambda: _new_errors(rec))


def _new_errors(rec: Signals) -> dict[str, np.ndarray]:
    out: dict[str, np.ndarray] = {}
    for k, there in enumerate(rec.stretches()):
        along = np.linspace(0.0, 1.0, there.stop - there.start)
        for end, share in (("start", 1.0 - along), ("end", along)):
            column = out[f"rounded.{k}_{end}@{rec.name}"] = np.zeros(rec.size)
            column[there] = share
    return out


def error(rec: Signals, p: Point) -> Dual | None:
    """What is added to the size of the currents (A), (sample,), the same in both directions."""
    if rec.current_step == 0.0:
        return None
    place = 2.0 * np.pi * _needed(rec, p) / rec.current_step
    columns: dict[str, np.ndarray] = {n: f(k * place) for n, k, f in harmonics("steps", rec.name)}
    columns |= errors_of_stretches(rec.rows_from)
    value = np.zeros(rec.size)
    slopes: dict[str, Number] = {}
    for name, column in columns.items():
        off = p(name)
        if off.value:
            value += off.value * column
        slopes |= dict.fromkeys(off.slopes, column)
    return Dual(value, slopes)


def _needed(rec: Signals, p: Point) -> np.ndarray:
    """(sample,) level of the currents (A) that the torque balance needs at a point, whatever is recorded."""
    state = State(copy(rec.rows_from), Point(p.values, rec.name, ()), rounds=False)
    lacking = np.asarray(torque.residual(state).value) * state.inertia
    level = 0.5 * np.abs([np.asarray(i.value) for i in state.current]).sum(axis=0)
    calm = odd(CALM / rec.interval)
    drive = state.drive
    for _ in range(PASSES):
        level, drive, lacking = (uniform_filter1d(x, calm, mode="nearest") for x in (level, drive, lacking))
    # where hardly any current flows its error is none
    least = rec.actuator.back_emf * rec.current_step
    return level * (1.0 + lacking / np.where(np.abs(drive) > least, drive, np.inf))

"""Noise levels of the recorded values: as stated, or estimated from the record itself."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..errors import InputError
from .features import Signals
from .rows import Rows

LEAST_VOLTAGE = 1e-6  # V; a record without noise is weighted as if it had this
USUAL_VOLTAGE = 0.05  # V; for the first weights of a record whose noise is to be estimated


@dataclass(frozen=True)
class NoiseLevels:
    """Standard deviations of the recorded values that enter the voltage equation (SI)."""

    voltage: float
    current: float
    current_end: float
    speed: float


def stated_noise(noise: Mapping[str, Any]) -> NoiseLevels:
    """Noise levels from settings; entries of other sensors are ignored.

    Raises
    ------
    InputError : a level that is missing or negative
    """
    levels = {}
    for key in ("voltage", "current", "current_end", "speed"):
        value = noise.get(key)
        if not isinstance(value, int | float) or not value >= 0.0:
            raise InputError(f"reconstruction.noise.{key}: got {value!r}, a standard deviation >= 0 is accepted")
        levels[key] = float(value)
    return replace(NoiseLevels(**levels), voltage=max(levels["voltage"], LEAST_VOLTAGE))


def sensor_noise(signals: Signals, run: int, rows: Sequence[Rows]) -> NoiseLevels:
    """Current and speed noise of one run from its record; the voltage noise is left to the residuals of a fit.

    Currents: their scatter where the phase floats, so ``rows`` must hold floating samples. Speed: its difference from
    the angle turned, whose own noise shows as the covariance of neighbours.
    """
    mean, end = [], []
    for j, r in enumerate(rows):
        zero = r.index[r.floating]
        if len(zero) > 10:
            mean.append(np.var(signals.current[run, zero, j]))
            if signals.current_end is not None:
                end.append(np.var(signals.current_end[run, zero, j]))
    difference = signals.speed[run, 1:] - np.diff(signals.angle[run]) / signals.interval
    difference = difference - np.mean(difference)
    speed = np.mean(difference**2) + 2.0 * np.mean(difference[1:] * difference[:-1])
    return NoiseLevels(
        voltage=USUAL_VOLTAGE,
        current=float(np.sqrt(np.mean(mean))) if mean else 0.0,
        current_end=float(np.sqrt(np.mean(end))) if end else 0.0,
        speed=float(np.sqrt(max(speed, 0.0))),
    )

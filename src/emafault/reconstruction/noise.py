"""Noise levels of the recorded values: as stated, or estimated from the record itself."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from ..errors import InputError
from .features import Signals
from .rows import Rows

LEAST_VOLTAGE = 1e-6  # V; a record without noise is weighted as if it had this
USUAL_VOLTAGE = 0.05  # V; for the first weights of a record whose noise is to be estimated
LEAST_RATE = 1e-18  # (rad/s)^2, below which speed and angle agree but for rounding
FEWEST_FREQUENCIES = 10
RATIOS = (-14.0, 14.0)  # logarithm of the angle's noise over the speed's, variances


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
    the angle turned, see ``split_noise``.
    """
    mean, end = [], []
    for j, r in enumerate(rows):
        zero = r.index[r.floating]
        if len(zero) > 10:
            mean.append(np.var(signals.current[run, zero, j]))
            if signals.current_end is not None:
                end.append(np.var(signals.current_end[run, zero, j]))
    speed, _ = split_noise(signals.speed[run], signals.angle[run], signals.interval)
    return NoiseLevels(
        voltage=USUAL_VOLTAGE,
        current=float(np.sqrt(np.mean(mean))) if mean else 0.0,
        current_end=float(np.sqrt(np.mean(end))) if end else 0.0,
        speed=float(np.sqrt(speed)),
    )


def split_noise(speed: np.ndarray, angle: np.ndarray, interval: float) -> tuple[float, float]:
    """Variances of recorded speeds and of recorded angles over the interval ((rad/s)^2), from how both differ.

    The difference has the spectrum s^2 + 4 a^2 sin^2(x/2). Its likelihood (Whittle, Arkiv for Matematik 2, 1953, 423)
    takes the speed's noise from low frequencies: of short intervals, where the angle's is most of all, the difference
    of mean squares would leave nothing or less by chance.
    """
    difference = speed[1:] - np.diff(angle) / interval
    difference = difference - np.mean(difference)
    power = np.abs(np.fft.rfft(difference)[1:]) ** 2 / max(len(difference), 1)
    total = float(np.mean(difference**2)) if len(difference) else 0.0
    if len(power) < FEWEST_FREQUENCIES or total < LEAST_RATE:
        return 0.0, 0.0
    wave = 4.0 * np.sin(np.pi * np.arange(1, len(power) + 1) / len(difference)) ** 2

    def misfit(log_ratio: float) -> float:
        shape = 1.0 + np.exp(log_ratio) * wave
        return float(np.mean(np.log(shape)) + np.log(np.mean(power / shape)))

    ratio = float(np.exp(minimize_scalar(misfit, bounds=RATIOS, method="bounded", options={"xatol": 0.01}).x))
    of_speed = float(np.mean(power / (1.0 + ratio * wave)))
    return of_speed, ratio * of_speed


def likeliest_voltage(misfit: Callable[[float], float], most: float) -> float:
    """Standard deviation (V) of the voltages' noise, up to ``most``, with the least misfit.

    What the mean square of the residuals leaves once the noise of end currents is taken off is little and uncertain at
    short intervals; the likelihood reads it where it shows, in what many intervals have in common.
    """
    low, high = np.log(LEAST_VOLTAGE), np.log(max(most, 2.0 * LEAST_VOLTAGE))
    found = minimize_scalar(lambda x: misfit(float(np.exp(x))), bounds=(low, high), method="bounded",
                            options={"xatol": 0.02})  # fmt: skip
    return float(np.exp(found.x))

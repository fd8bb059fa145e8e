"""An angle that is recorded late, or whose zero drifts: what is to be added to it, to the second order of the lag.

Terms of the signals w, by how much a smoothed angle changes in an interval, and b, by how much that changes; t is the
time, all in intervals; of a drift one and the time in seconds. The noise of the recorded angle is that of the
equations, which differences of it would add to.
"""

from collections.abc import Mapping

import numpy as np

from .acquisition import CLOCKS, RATE, clock_names, drifting
from .signals import Signals

LAGS = {"lag.angle_late": 1.0, "lag.angle_early": -1.0}  # parameters of all recordings alike, with their sides
TERMS = 7  # w, b, t w, t b, t^2 b, one, time
DRIFTED = 5  # the first of those of a drift


def names(recording: str) -> tuple[str, ...]:
    """Parameters that a recording's angle may be late or off by."""
    return (*LAGS, *(n for of in _loggers() for n in clock_names(of, recording)), *_drifts(recording))


def terms(rec: Signals) -> np.ndarray:
    """(TERMS, sample) signals (rad)."""
    h = rec.interval
    t = np.arange(1.0, rec.size + 1.0)
    bend = rec.acceleration * h**2
    turned = rec.speed * h + 0.5 * bend
    return np.array([turned, bend, t * turned, t * bend, t * t * bend, np.ones(rec.size), rec.time])


def correction(values: Mapping[str, float], recording: str) -> np.ndarray:
    """(TERMS,) coefficients of what is to be added to the recorded angle.

    One that is late by a share l is recorded as (1 - l) y[n] + l y[n - 1], or with n + 1, one of another logger as it
    was a time before.
    """
    out = np.zeros(TERMS)
    for name, side in LAGS.items():
        lag = values.get(name, 0.0)
        out[:2] += side * lag, lag * lag - 0.5 * lag
    start, rate = _behind(values, recording)
    out[:DRIFTED] += start, 0.5 * start * start, rate, start * rate, 0.5 * rate * rate
    for name, term in _drifts(recording).items():
        out[term] -= values.get(name, 0.0)
    return out


def derivatives(values: Mapping[str, float], recording: str) -> dict[str, np.ndarray]:
    """(TERMS,) the same coefficients, differentiated by each parameter."""
    out = {name: np.zeros(TERMS) for name in names(recording)}
    for name, side in LAGS.items():
        out[name][:2] = side, 2.0 * values.get(name, 0.0) - 0.5
    start, rate = _behind(values, recording)
    for of in _loggers():
        by_start, by_rate = clock_names(of, recording)
        out[by_start][:4] = 1.0, start, 0.0, rate
        out[by_rate][2:DRIFTED] = 1.0, start, rate
    for name, term in _drifts(recording).items():
        out[name][term] = -1.0
    return out


def _drifts(recording: str) -> dict[str, int]:
    """Parameters of a zero that is the recording's own or drifts, each with its term."""
    _, (own, at), _ = drifting(recording)
    return {f"{own}_angle.all{at}": DRIFTED, f"{RATE}_angle.all": DRIFTED + 1}


def _loggers() -> list[str]:
    return [of for of, channels in CLOCKS.items() if "angle" in channels]


def _behind(values: Mapping[str, float], recording: str) -> tuple[float, float]:
    """Intervals by which an angle of another logger is late at the start, and by which that grows in each."""
    start, rate = np.sum([[values.get(n, 0.0) for n in clock_names(of, recording)] for of in _loggers()], axis=0)
    return float(start), float(rate)

"""What makes a signal late: filters of the first and second order along it, and its average over samples."""

from collections.abc import Callable

import numpy as np

from .compiled import compiled

MOST = 0.95  # largest pole of a recursion that undoes a lag
LEAST = 1e-6  # interval, of a constant that does anything
FADED, LONGEST = 1e-4, 500  # of a response: what is left at its end, and intervals that it has at most


@compiled
def followed(x, gain, decay):
    """y[n] = gain x[n] + decay y[n - 1] from rest, x (sample,)."""
    y = x.copy()
    before = 0.0
    for n in range(x.shape[0]):
        before = gain * x[n] + decay * before
        y[n] = before
    return y


def ahead(x: np.ndarray, lag: float) -> np.ndarray:
    """The signal y of which x[n] = (1 - lag) y[n] + lag y[n - 1] is recorded, (sample,).

    It follows from the samples before where the lag is below one half, else from those after. About one half, where a
    wave of two samples is not recorded, the recursion keeps to ``MOST`` and the rest is interpolated.
    """
    if lag < LEAST:
        return x
    if lag > 0.5:  # backwards in time it leads by what it lacks to a whole sample
        later = np.concatenate([x[1:], x[-1:]])
        return ahead(later[::-1], 1.0 - lag)[::-1] if lag < 1.0 else _between(later, lag - 1.0)
    within = min(lag, MOST / (1.0 + MOST))
    decay = within / (1.0 - within)
    return _between(x[0] + followed(x - x[0], 1.0 + decay, -decay), lag - within)


def _between(x: np.ndarray, share: float) -> np.ndarray:
    out = x.copy()
    out[:-1] += share * (x[1:] - x[:-1])
    return out


def smoothed(x: np.ndarray, memory: float) -> np.ndarray:
    """Exponential smoothing, y[n] + memory (y[n] - y[n - 1]) = x[n], (sample,), from the first value on; its delay is
    the memory (intervals)."""
    if memory < LEAST:
        return x
    decay = memory / (1.0 + memory)
    return x[0] + followed(x - x[0], 1.0 - decay, decay)


def filtered(x: np.ndarray, constant: float) -> np.ndarray:
    """Means over intervals of an analogue filter's output y + constant y' = x, (sample,), from the first value on.

    x is constant within each interval; the time constant, its delay, is in intervals.
    """
    if constant < LEAST:
        return x
    decay = np.exp(-1.0 / constant)
    at_end = x[0] + followed(x - x[0], 1.0 - decay, decay)
    before = np.concatenate([x[:1], at_end[:-1]])
    return x + (before - x) * (constant * (1.0 - decay))


def butterworth(x: np.ndarray, delay: float) -> np.ndarray:
    """Means over intervals of an analogue Butterworth filter's output of the second order, y + d y' + d^2/2 y'' = x,
    (sample,), from the first value on.

    x is constant within each interval; d, its delay, is in intervals.
    """
    return x if delay < LEAST else x[0] + _second_order(x - x[0], 1.0 / delay)


@compiled
def _second_order(x, a):
    """The same from rest. What y lacks of x within an interval is exp(-a t) (C cos(a t) + D sin(a t))."""
    faded, c, s = np.exp(-a), np.cos(a), np.sin(a)
    mean_c, mean_s = (1.0 + faded * (s - c)) / (2.0 * a), (1.0 - faded * (s + c)) / (2.0 * a)
    out = x.copy()
    y = rate = 0.0  # at the interval's start; the rate over a
    for n in range(x.shape[0]):
        C = y - x[n]
        D = rate + C
        out[n] = x[n] + C * mean_c + D * mean_s
        y = x[n] + faded * (C * c + D * s)
        rate = faded * (D * (c - s) - C * (c + s))
    return out


def averaged(x: np.ndarray, delay: float) -> np.ndarray:
    """Means of each value and those before, (sample,), the first one before all; ``delay`` (intervals) is half of one
    less than their number, and half-way between two numbers it is half of both."""
    return x[0] + np.convolve(x - x[0], averaging(delay))[: len(x)]


def averaging(delay: float) -> np.ndarray:
    """(interval,) weights of :func:`averaged`, of the latest value first."""
    fewer = int(2.0 * delay)
    share = 2.0 * delay - fewer
    out = np.full(fewer + 2, share / (fewer + 2))
    out[:-1] += (1.0 - share) / (fewer + 1)
    return out


def response(through: Callable[[np.ndarray, float], np.ndarray], delay: float) -> np.ndarray:
    """(interval,) what a filter makes of one interval of one, in that interval and those that follow."""
    impulse = np.zeros(min(int(-np.log(FADED) * delay) + 4, LONGEST))
    impulse[1] = 1.0
    return through(impulse, delay)[1:]

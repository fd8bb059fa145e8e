"""First-order filters along a signal."""

import numpy as np

from .compiled import compiled

LEAST = 1e-6  # interval, of a constant that does anything


@compiled
def followed(x, gain, decay):
    """y[n] = gain x[n] + decay y[n - 1] from rest, x (sample,)."""
    y = x.copy()
    before = 0.0
    for n in range(x.shape[0]):
        before = gain * x[n] + decay * before
        y[n] = before
    return y


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

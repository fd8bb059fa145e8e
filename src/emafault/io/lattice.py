"""Channels whose values lie on a lattice: a converter's steps, an encoder's counts."""

import numpy as np

ON = 2e-3  # of a step, that values may lie beside a lattice by
SMALLEST = 1e-8  # step of a lattice, of the range of its values


def lattice_step(x: np.ndarray) -> float:
    """Spacing of the lattice that a channel's values lie on; 0 where they lie on none that the samples fill."""
    values = np.unique(x)
    if len(values) > 0.5 * len(x) or len(values) < 3:
        return 0.0
    gaps = np.diff(values)
    step = float(gaps.min())
    times = gaps / step
    on = np.abs(times - np.round(times)) < 1e-3 * np.maximum(times, 1.0)
    return step if step > 1e-9 * np.ptp(x) and on.mean() > 0.99 else 0.0


def spacing(x: np.ndarray) -> float:
    """Spacing of the lattice that all values of a channel lie on, however few of its places they fill, as an encoder's
    counts; 0 of others. The greatest common divisor of the gaps between values, by Euclid's algorithm."""
    gaps = np.diff(np.unique(x))
    if len(gaps) < 2:
        return 0.0
    step = float(gaps.min())
    while step > SMALLEST * gaps.sum():
        rest = np.abs(gaps - step * np.round(gaps / step))
        off = rest > ON * step
        if np.mean(off) < 0.01:
            return step
        step = float(rest[off].min())
    return 0.0

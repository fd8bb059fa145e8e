"""The incremental inductance falls with current, L / (1 + s i^2)."""

import numpy as np

SENTENCE = "the inductance saturates"
SERIES = 1e-4  # of s i^2, below which the series is exact to rounding


def flux(p, i):
    """Integral of di / (1 + s i^2) (A), from 0 to i: atan(sqrt(s) i) / sqrt(s)."""
    s = p("s")
    if not (s.value or s.slopes):
        return i
    x = np.asarray(i.value)
    square = x * x
    cube, q = x * square, s.value * square
    if s.value <= 0.0 or np.max(q) < SERIES:
        value = x * (1.0 - q / 3.0 + q * q / 5.0)
        by_s = cube * (-1.0 / 3.0 + 2.0 * q / 5.0)
    else:
        root = np.sqrt(s.value)
        value = np.arctan(root * x) / root
        by_s = np.where(q < SERIES, cube / -3.0, (x / (1.0 + q) - value) / (2.0 * s.value))
    return i.through(value, 1.0 / (1.0 + q)) + s.through(0.0, by_s)

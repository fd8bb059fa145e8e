"""Plateau width of the trapezoid, fifth and seventh harmonic of the shape."""

import numpy as np

SENTENCE = "the back-EMF is no trapezoid of 120 degrees"
ORDERS = {"h5": 5, "h7": 7}


def ramp(p):
    """Half the angle from plateau to plateau (electrical rad)."""
    return (180.0 - p("width")) * (np.pi / 360.0)


def harmonics(p, low, high):
    """Integral over the electrical angle from ``low`` to ``high`` (rad) of what is added to f."""
    total = 0.0
    sizes = {n: p(h) for h, n in ORDERS.items()}
    if not any(s.value or s.slopes for s in sizes.values()):
        return total
    before, after = _cosines(low), _cosines(high)
    for n, size in sizes.items():
        total = total + size * ((before[n] - after[n]) / n)
    return total


def _cosines(angle):
    """cos(n angle) by order, from Chebyshev polynomials of the first kind."""
    c = np.cos(angle)
    s = c * c
    return {5: c * (5.0 - s * (20.0 - 16.0 * s)), 7: c * (s * (56.0 - s * (112.0 - 64.0 * s)) - 7.0)}

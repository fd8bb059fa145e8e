"""Plateau width of the trapezoid, fifth and seventh harmonic of the shape."""

import numpy as np

SENTENCE = "the back-EMF is no trapezoid of 120 degrees"
ORDERS = {"h5": 5, "h7": 7}


def ramp(p):
    """Half the angle from plateau to plateau (electrical rad)."""
    return (180.0 - p("width")) * (np.pi / 360.0)


def harmonics(p, angle):
    """Integral over the electrical angle (rad) of what is added to f."""
    total = 0.0
    for h, n in ORDERS.items():
        size = p(h)
        if size.value or size.slopes:
            total = total + size * (-np.cos(n * angle) / n)
    return total

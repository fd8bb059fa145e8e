"""Plateau width of the trapezoid, fifth and seventh harmonic of the shape."""

import numpy as np

from ..waveform import integral

SENTENCE = "the back-EMF is no trapezoid of 120 degrees"
ORDERS = {"h5": 5, "h7": 7}


def ramp(p):
    """Half the angle from plateau to plateau (electrical rad)."""
    return (180.0 - p("width")) * (np.pi / 360.0)


def harmonics(p, low, high):
    """Integral over the electrical angle from ``low`` to ``high`` (rad) of what is added to f."""
    return integral({n: p(h) for h, n in ORDERS.items()}, low, high)

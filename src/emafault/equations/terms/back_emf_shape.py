"""Plateau width of the trapezoid, fifth and seventh harmonic of the shape."""

import numpy as np

SENTENCE = "the back-EMF is no trapezoid of 120 degrees"
ORDERS = {"h5": 5, "h7": 7}


def ramp(p):
    """Half the angle from plateau to plateau (electrical rad)."""
    return (180.0 - p("width")) * (np.pi / 360.0)


def harmonics(p, angle):
    """Added to f(x), its integral over x, at an electrical angle (rad)."""
    value = [p(h) * np.sin(n * angle) for h, n in ORDERS.items()]
    swept = [p(h) * (-np.cos(n * angle) / n) for h, n in ORDERS.items()]
    return value[0] + value[1], swept[0] + swept[1]

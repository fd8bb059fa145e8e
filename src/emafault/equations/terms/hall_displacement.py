"""The commutations that switch phase j on come earlier in angle."""

import numpy as np

SENTENCE = "the Hall sensors are displaced"


def commutation(p, j):
    """Electrical rad by which the edges of phase j come early."""
    return p("d_" + "abc"[j]) * (np.pi / 180.0)

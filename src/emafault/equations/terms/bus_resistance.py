"""The supply sags by R times the bus current, filtered with 1 ms."""

import numpy as np
from scipy.signal import lfilter

SENTENCE = "the supply sags under load"
FILTER = 1e-3  # s


def sag(p, rec, current):
    """Fall of the bus voltage (V) under a bus current (A)."""
    decay = np.exp(-rec.interval / FILTER)
    return p("R") * lfilter([1.0 - decay], [1.0, -decay], current)

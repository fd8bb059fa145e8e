"""The supply sags by R times the bus current, filtered with 1 ms."""

import numpy as np

from ...delays import followed

SENTENCE = "the supply sags under load"
FILTER = 1e-3  # s


def sag(p, rec, current):
    """Fall of the bus voltage (V) under a bus current (A)."""
    R = p("R")
    if not (R.value or R.slopes):
        return R
    decay = np.exp(-rec.interval / FILTER)
    at_end = followed(current, 1.0 - decay, decay)
    before = np.concatenate([[0.0], at_end[:-1]])
    return R * (current + (before - current) * ((1.0 - decay) * FILTER / rec.interval))  # mean over each interval

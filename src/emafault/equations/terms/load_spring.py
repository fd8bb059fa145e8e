"""A spring load at the user shaft."""

import numpy as np

from ..dual import Dual
from ..flexible import through_play

SENTENCE = "a spring acts on the user shaft"


def spring(p):
    """Stiffness at the user shaft (N m/rad)."""
    return p("c")


def torque(p, rec):
    """Resisting torque at the motor (N m), where the shaft is rigid."""
    if rec.flexible:
        return Dual(0.0)
    ratio = rec.actuator.gear_ratio
    at_end, _ = through_play(rec.turned / ratio, 0.5 * float(rec.play.value))
    before = np.concatenate([[0.0], at_end[:-1]])
    return p("c") * (0.5 * (at_end + before) / ratio)

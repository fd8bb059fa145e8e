"""Cogging torque a sin(72 theta)."""

import numpy as np

SENTENCE = "the motor cogs"
ORDER = 72


def torque(p, rec):
    """Resisting torque (N m), its mean over the angle swept."""
    a = p("a")
    if not (a.value or a.slopes):
        return a
    return a * (np.sin(ORDER * rec.middle) * np.sinc(ORDER * rec.half_sweep / np.pi))

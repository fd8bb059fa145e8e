"""Sliding friction a exp(-|w|/w_s) beside the Coulomb friction."""

import numpy as np

SENTENCE = "the friction falls with speed (Stribeck)"
PARAMETERS = {"a": (0.0, 0.0, 0.018), "w_s": (8.0, 8.0, 5.0)}
SHAPES = ({"a": 0.01, "w_s": 2.5}, {"a": 0.01, "w_s": 6.0}, {"a": 0.01, "w_s": 14.0})


def torque(p, rec):
    """Resisting torque (N m)."""
    a, w_s = p("a"), p("w_s")
    size = max(w_s.value, 0.5)
    decay = np.exp(-np.abs(rec.speed) / size)
    value = rec.direction * decay
    return a * value + w_s.through(0.0, a.value * value * np.abs(rec.speed) / size**2)

"""Sliding friction a exp(-|w|/w_s) beside the Coulomb friction."""

import numpy as np

SENTENCE = "the friction falls with speed (Stribeck)"
PARAMETERS = {"a": (0.0, 0.0, 0.018), "log_w_s": (1.8, 1.8, 0.7)}
SCALES = {"a": "motor_torque"}
ENDS = (-4.0, 8.0)  # of log_w_s, beyond which the function stays what it is there
SHAPES = ({"a": 0.01, "log_w_s": 0.9}, {"a": 0.01, "log_w_s": 1.8}, {"a": 0.01, "log_w_s": 2.7})


def torque(p, rec):
    """Resisting torque (N m)."""
    a, log_w_s = p("a"), p("log_w_s")
    if not (a.value or a.slopes or log_w_s.slopes):
        return a
    at = float(np.clip(log_w_s.value, *ENDS))
    x = np.abs(rec.speed) / np.exp(at)
    value = rec.direction * np.exp(-x)
    return a * value + log_w_s.through(0.0, a.value * value * x * (at == log_w_s.value))


def report(value, deviation):
    """Catalogue parameters from the fitted ones: name -> (value, standard deviation)."""
    w_s = float(np.exp(value["log_w_s"]))
    return {"a": (value["a"], deviation["a"]), "w_s": (w_s, w_s * deviation["log_w_s"])}

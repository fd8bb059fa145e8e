"""The winding heats by its own loss; the loss is integrated along the measured currents."""

import numpy as np

from ...delays import followed

SENTENCE = "the winding heats by its own loss"
PARAMETERS = {"heating_rate": (0.0, 0.0, 0.15), "Rth": (3.0, 3.0, 1.2)}
SCALES = {"heating_rate": "inverse_loss", "Rth": "inverse_loss"}


def heating(p, rec, loss):
    """Rise of the winding's temperature (K) from its loss (W, (sample,))."""
    rate, thermal = p("heating_rate"), p("Rth").value
    if not (rate.value or rate.slopes):
        return rate

    def rise(decay):
        return followed(loss, rec.interval, np.exp(-rec.interval * decay))

    decay = max(rate.value, 0.0) / thermal
    value = rise(decay)
    step = 1e-3
    by_decay = (rise(decay + step) - value) / step if rate.value > 0.0 else 0.0
    out = rate.through(rate.value * value, value + rate.value * by_decay / thermal)
    return out + p("Rth").through(0.0, -rate.value * by_decay * rate.value / thermal**2)


def report(value, deviation):
    """Catalogue parameters from the fitted ones: name -> (value, standard deviation)."""
    out = {"heating_rate": (value["heating_rate"], deviation["heating_rate"])}
    if value["heating_rate"] > 1e-4:
        C = 1.0 / value["heating_rate"]
        out["C"] = (C, deviation["heating_rate"] * C * C)
    out["Rth"] = (value["Rth"], deviation["Rth"])
    return out

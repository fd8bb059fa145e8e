"""Gain of a phase's voltage sensor."""

SENTENCE = "the voltage sensors' gains differ"


def voltage(p, j, volts):
    """Recorded voltage of phase j (V) from the true ones."""
    return volts[j] * p("g_" + "abc"[j])

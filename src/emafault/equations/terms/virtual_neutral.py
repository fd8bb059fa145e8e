"""The recorded voltages are taken against the mean of the three: the star point is not wired."""

SENTENCE = "the voltages were recorded against a virtual neutral"
PARAMETERS = {"on": (0.0, 1.0, 0.02)}
RECORDED_LAST = True


def voltage(p, j, volts):
    """Recorded voltage of phase j (V) from those before it."""
    return volts[j] - p("on") * ((volts[0] + volts[1] + volts[2]) * (1.0 / 3.0))

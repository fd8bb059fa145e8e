"""The recorded voltages are taken against the mean of the three: the star point is not wired.

The mean is that of three resistors, which have a tolerance of their own: ``w_a`` and ``w_b`` are the excess of the
first two's conductance over the third's.
"""

SENTENCE = "the voltages were recorded against a virtual neutral"
PARAMETERS = {"on": (0.0, 1.0, 0.02), "w_a": (0.0, 0.0, 0.01), "w_b": (0.0, 0.0, 0.01)}
RECORDED_LAST = True


def voltage(p, j, volts):
    """Recorded voltage of phase j (V) from those before it."""
    on = p("on")
    if on.value == 0.0:  # and with it every derivative of the mean
        return volts[j] - on * _mean(p, [v.value for v in volts]).value if on.slopes else volts[j]
    return volts[j] - on * _mean(p, volts)


def _mean(p, volts):
    uneven = p("w_a") * (volts[0] - volts[2]) + p("w_b") * (volts[1] - volts[2])
    return (volts[0] + volts[1] + volts[2] + uneven) * (1.0 / 3.0)


def report(values, spread):
    """The catalogue's parameter."""
    return {"on": (values["on"], spread["on"])}

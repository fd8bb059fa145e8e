"""Scale of the speed sensor."""

SENTENCE = "the speed sensor's scale is off"


def speed(p, rec, w):
    """Recorded speed (rad/s) from the true one."""
    return w * p("scale")

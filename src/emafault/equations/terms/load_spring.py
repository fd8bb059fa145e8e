"""A spring load at the user shaft."""

SENTENCE = "a spring acts on the user shaft"


def torque(p, rec):
    """Resisting torque at the motor (N m)."""
    return p("c") * (rec.shaft / rec.actuator.gear_ratio)

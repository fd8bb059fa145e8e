"""A constant load torque at the user shaft."""

SENTENCE = "a constant load acts on the user shaft"


def torque(p, rec):
    """Resisting torque at the motor (N m)."""
    return p("T") * (1.0 / rec.actuator.gear_ratio)

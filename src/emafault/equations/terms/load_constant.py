"""A constant load torque at the user shaft."""

from ..dual import Dual

SENTENCE = "a constant load acts on the user shaft"


def load(p):
    """Torque on the user shaft (N m)."""
    return p("T")


def torque(p, rec):
    """Resisting torque at the motor (N m), where the shaft is rigid."""
    return Dual(0.0) if rec.flexible else p("T") * (1.0 / rec.actuator.gear_ratio)

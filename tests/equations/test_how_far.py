"""What is inserted to see how far a gap closes is what the verdict tells."""

from types import SimpleNamespace

from emafault.diagnosis.model import Unit
from emafault.diagnosis.sets import Choice, Model
from emafault.equations.how_far import _insertable

UNITS = {
    "stribeck": ("torque",), "voltage_gain": ("electrical",), "~frequency": ("torque",),
    "remainder:torque": ("torque",), "remainder:electrical_b": ("electrical_b",),
}  # fmt: skip


def _set(members):
    return Model(tuple(Choice(unit, variant, 1.0) for unit, variant in members))


def _inserted(told):
    units = {u: Unit(u, "", equations, []) for u, equations in UNITS.items()}
    fit = SimpleNamespace(search=SimpleNamespace(fit=_set, units=units))
    return [set(m.units) for m in _insertable(fit, _set([(u, 0) for u in UNITS]), told)]


def test_what_the_others_have_refused_is_not_inserted():
    assert _inserted({"stribeck"}) == [{"stribeck"}]
    assert _inserted(set()) == [set()]


def test_what_stands_for_a_remainder_that_is_told_is():
    told = {"remainder:torque", "voltage_gain"}
    every = {*told, "stribeck", "~frequency"}  # but the other remainder
    assert _inserted(told) == [every, told, {"voltage_gain"}]
    assert _inserted({"remainder:torque"}) == [every - {"voltage_gain"}, {"remainder:torque"}, set()]
    assert _inserted({"remainder:electrical_b"})[0] == {"voltage_gain", "remainder:electrical_b"}

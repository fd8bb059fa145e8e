"""The user shaft has an inertia of its own behind a stiffness; its motion is integrated along the measured angle."""

import numpy as np

from ...effects.scaling import scale
from ..flexible import flexible_shaft

SENTENCE = "the transmission is flexible"
PARAMETERS = {"flexibility": (0.0, 1.5e-4, 1.2e-4), "C": (300.0, 300.0, 60.0)}
SCALES = {"flexibility": "shaft_flexibility", "C": "shaft_torque"}
SHAPES = ({"flexibility": 6e-5, "C": 300.0}, {"flexibility": 1.3e-4, "C": 300.0}, {"flexibility": 3e-4, "C": 300.0})
GROUND = 2.0  # N m s/rad from the user shaft to ground
SHARE = 0.3  # of the inertia behind the stiffness
STIFFEST = 2e-5  # rad/(N m), of the reference actuator
KEPT = 12  # solutions of a recording


def solve(rec, flexibility, damping, play, inertia, load, spring):
    """User angle (rad) and torque on the motor (N m) along the measured rotor angle.

    ``inertia``: factor of this unit's, which the user shaft has its share of; ``load`` (N m) and ``spring`` (N m/rad)
    act on the user shaft.
    """
    a = rec.actuator
    if flexibility < _stiffest(rec):
        return None
    J = SHARE * inertia * a.inertia * a.gear_ratio**2
    position, torque = flexible_shaft(
        rec.once(("quiet",), rec.quiet) / a.gear_ratio, rec.interval, 1.0 / flexibility, damping, J, GROUND, play,
        load, spring,
    )  # fmt: skip
    return position, torque / a.gear_ratio


def _stiffest(rec):
    """Flexibility (rad/(N m)) below which the shaft is taken for rigid."""
    return scale("shaft_flexibility", rec.actuator) * STIFFEST


def is_flexible(p, rec):
    """Whether a load acts on the motor through the shaft's torque alone."""
    return p("flexibility").value >= _stiffest(rec)


def rotor_share(p, rec):
    """Share of the inertia that turns with the rotor."""
    return 1.0 - SHARE if is_flexible(p, rec) else 1.0


def twist(p, rec, rigid):
    """User angle (rad) that replaces the rigid one."""
    return _dual(p, rec, 0, rigid)


def torque(p, rec):
    """Torque of the shaft on the motor (N m)."""
    return _dual(p, rec, 1, None)


def _dual(p, rec, which, rigid):
    parameters = p("flexibility"), p("C"), rec.play, rec.inertia_scale, rec.load, rec.spring
    given = tuple(float(x.value) for x in parameters)
    flexibility = parameters[0]
    base = _solved(rec, *given)
    if base is None:
        return rigid if rigid is not None else flexibility.through(0.0, 0.0)
    out = flexibility.through(np.asarray(base[which]), 0.0)
    own = rec.actuator
    of_torque = scale(SCALES["C"], own)
    steps = (
        1e-6 * scale(SCALES["flexibility"], own),
        5.0 * of_torque,
        0.02 * own.backlash,
        0.01,
        0.1 * of_torque,
        of_torque,
    )
    for m, (parameter, step) in enumerate(zip(parameters, steps, strict=True)):
        if parameter.slopes and step > 0.0:
            there = _solved(rec, *(x + step if k == m else x for k, x in enumerate(given)))
            out = out + parameter.through(0.0, (there[which] - base[which]) / step)
    return out


def _solved(rec, *given):
    """``solve``, kept with the recording for the equations that ask for it again."""
    if given not in rec.solved:
        if len(rec.solved) >= KEPT:
            rec.solved.clear()
        rec.solved[given] = solve(rec, *given)
    return rec.solved[given]


def report(value, deviation):
    """Catalogue parameters from the fitted ones: name -> (value, standard deviation)."""
    K = 1.0 / max(value["flexibility"], 1e-6)
    return {"K": (K, deviation["flexibility"] * K * K), "C": (value["C"], deviation["C"])}

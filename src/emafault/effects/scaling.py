"""The catalogue for another actuator: what has a unit of torque, current, voltage or loss scales with the machine.

Ratios, angles, times and temperature coefficients stay. A parameter of ``conf/effect`` names what it ``scales`` with;
its numbers are those of ``conf/actuator/reference.yaml``.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import yaml

from ..nominal import ActuatorParameters
from ..paths import CONF
from . import EFFECTS, Effect, EffectParameter

LEAST_FRICTION = 1e-3  # of the torque at the current limit, where a machine states no dry friction

#: what a parameter may scale with, of an actuator's parameters
SCALES: dict[str, Callable[[Any], float]] = {
    "motor_torque": lambda a: _friction(a),
    "shaft_torque": lambda a: _friction(a) * a.gear_ratio,
    "shaft_flexibility": lambda a: 1.0 / (_friction(a) * a.gear_ratio),
    "resistance": lambda a: a.resistance,
    "current": lambda a: a.current_limit,
    "inverse_square_current": lambda a: a.current_limit**-2,
    "voltage": lambda a: a.bus_voltage,
    "supply_resistance": lambda a: a.bus_voltage / a.current_limit,
    "inverse_loss": lambda a: 1.0 / (a.resistance * a.current_limit**2),
    "speed": lambda a: a.speed_limit,
    "passing_time": lambda a: a.inductance / a.bus_voltage,  # in which an ampere passes from phase to phase
}


def scale(name: str, actuator: "ActuatorParameters") -> float:
    """What a number of the reference actuator that scales with ``name`` is multiplied by; one where it names none."""
    return SCALES[name](actuator) / _of_reference(name) if name else 1.0


def scaled(
    actuator: "ActuatorParameters", tolerances: Mapping[str, Mapping[str, float]] | None = None
) -> dict[str, Effect]:
    """The catalogue of an actuator.

    Parameters
    ----------
    tolerances : effect id -> parameter -> standard deviation over the nominal value, instead of ``conf/effect``'s; a
        wider tolerance widens the range that lies outside it as much
    """
    given = tolerances or {}
    out = {}
    for effect in EFFECTS.values():
        own = given.get(effect.id, {})
        parameters = {n: _scaled(p, actuator, own.get(n, p.tolerance)) for n, p in effect.parameters.items()}
        out[effect.id] = replace(effect, parameters=parameters)
    return out


def _scaled(p: EffectParameter, actuator: "ActuatorParameters", tolerance: float) -> EffectParameter:
    factor = getattr(actuator, p.follows) / p.nominal if p.follows else scale(p.scales, actuator)
    low, high, nominal = factor * p.low, factor * p.high, factor * p.nominal
    if tolerance > p.tolerance > 0.0:
        wider = tolerance / p.tolerance
        low, high = (nominal * (end / nominal) ** wider for end in (low, high))
    return replace(p, nominal=nominal, low=low, high=high, tolerance=tolerance)


def _friction(actuator: Any) -> float:
    torque = 2.0 * actuator.back_emf * actuator.current_limit
    return max(actuator.coulomb_friction, LEAST_FRICTION * torque)


def reference() -> dict[str, Any]:
    """Parameters of the reference actuator."""
    return yaml.safe_load((CONF / "actuator" / "reference.yaml").read_text(encoding="utf-8"))


@cache
def _of_reference(name: str) -> float:
    return SCALES[name](_reference())


@cache
def _reference() -> Any:
    from types import SimpleNamespace

    return SimpleNamespace(**reference())

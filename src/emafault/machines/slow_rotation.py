"""A motor turned slowly or held still at every angle: the torque-producing current over the rotor's angle.

J in A s2/rad, seen as current; direction s = sign of speed:
    i(theta) = i_f s
Effects add waves of the orders that their cause allows; p pole pairs and N slots are found from the spectrum.
"""

from collections.abc import Mapping
from functools import partial

import numpy as np

from .recorded.slow_rotation import ORDERS, distortions, read, recordings
from .statement import Arrays, Effect, Experiment, Machine, Parameter, freedom, nuisance, scaled

__all__ = ["build", "distortions", "experiments", "read"]
NAME = "slow_rotation"
WORDS = {"i_f": "current against friction"}


def build(case: str, arrays: Arrays) -> Machine:
    """One file: half of the recordings explore, the others confirm."""
    rows, size, pairs, slots, explore, confirm, notes = recordings(case, arrays)
    waves = {e: orders for e, orders in _waves(pairs, slots).items() if orders}
    moving = any(values.ndim == 2 for values in arrays.values())
    equation = partial(current, waves=waves, second=2 * pairs if 2 * pairs <= ORDERS else 0)
    return Machine(
        NAME, case, explore, confirm, rows, _parameters(size, waves, moving), _effects(waves, moving),
        {"torque": equation}, notes=notes, experiments=experiments(), words=WORDS,
    )  # fmt: skip


def current(
    p: Mapping[str, np.ndarray], x: Mapping[str, np.ndarray], waves: Mapping[str, tuple[int, ...]], second: int
) -> np.ndarray:
    """Mean current (A) in each bin of the rotor's angle; ``second``: twice the pole pairs, if the bins resolve it."""
    i = p["i_f"] * x["direction"] + p["i_0"]
    for effect, orders in waves.items():
        for n in orders:
            i = i + p[f"{effect}_cos_{n}"] * x["cos"][n] + p[f"{effect}_sin_{n}"] * x["sin"][n]
    if "J" in p:
        i = i + p["J"] * x["a"] + p["b"] * x["v"]
    return i * (1 + p["current_gain_cos"] * x["cos"][second] + p["current_gain_sin"] * x["sin"][second])


def _waves(pairs: int, slots: int) -> dict[str, tuple[int, ...]]:
    """Orders (waves per turn) that each cause allows, up to what the bins resolve."""
    full = int(np.lcm(2 * pairs, slots))
    every = range(1, ORDERS + 1)
    return {
        # a constant stator current or a field from outside meets the rotor's poles once per pole pair
        "current_offset": (pairs,),
        "stray_field": tuple(n for n in every if n % pairs == 0 and n // pairs % 2 == 1),
        "stator_asymmetry": tuple(n for n in every if n % (2 * pairs) == 0 and n % full),
        "rotor_asymmetry": tuple(n for n in every if n % slots == 0 and n % full),
        "cogging": tuple(n for n in every if n % full == 0),
        "eccentricity": (1, 2),
    }


def _parameters(size: float, waves: Mapping[str, tuple[int, ...]], moving: bool) -> tuple[Parameter, ...]:
    found = [
        nuisance("i_f", "A", 0.3 * size, size, low=0.0),
        freedom("mean_offset", "i_0", "A", 0.3 * size, -10 * size, 10 * size),
    ]
    for effect, orders in waves.items():
        for n in orders:
            names = (f"{effect}_{part}_{n}" for part in ("cos", "sin"))
            found += [freedom(effect, name, "A", 0.7 * size, -10 * size, 10 * size) for name in names]
    # a gain error between phases makes a ripple in proportion to the current itself
    found += [freedom("current_gain", f"current_gain_{part}", "1", 0.03, -0.2, 0.2) for part in ("cos", "sin")]
    if moving:
        found += [
            freedom("inertia", "J", "A s2/rad", 0.02 * size, 0.0, size),
            freedom("viscous_friction", "b", "A s/rad", 0.3 * size, 0.0, 10 * size),
        ]
    return tuple(found)


def _effects(waves: Mapping[str, tuple[int, ...]], moving: bool) -> tuple[Effect, ...]:
    sensor = ("sensor_current",)
    found = [Effect("mean_offset", sensor), Effect("current_gain", sensor)]
    found += [Effect(e, (*sensor, "torque") if e == "current_offset" else ("torque",)) for e in waves]
    return (*found, *(Effect(e, ("torque",)) for e in ("inertia", "viscous_friction") if moving))


def experiments() -> tuple[Experiment, ...]:
    """Other directions and speeds."""
    return (
        scaled("the same in the other direction", direction=-1.0, v=-1.0),
        scaled("ten times slower", v=0.1, a=0.01),
        scaled("ten times faster", v=10.0, a=100.0),
        scaled("fast to and fro about the same places", a=100.0),
    )

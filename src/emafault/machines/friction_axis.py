"""A motor-driven axis with friction: position and force command at millisecond steps.

Force F = gtau vir, v the speed and a the acceleration:
    F = M a + F_v v + F_c sign(v)
"""

from collections.abc import Mapping

import numpy as np

from .recorded.friction_axis import ENDING, UNITS, distortions, read, recordings
from .statement import Arrays, Effect, Experiment, Machine, Parameter, freedom, nuisance, scaled

__all__ = ["ENDING", "UNITS", "build", "distortions", "experiments", "read"]
NAME = "friction_axis"
WORDS = {
    "rotor_speed": "speed (m/s)", "position": "position from the middle of the stroke (m)",
    "M": "mass", "F_v": "viscous friction", "F_c": "Coulomb friction", "F_0": "force",
    "F_c_difference": "difference of Coulomb friction between the directions, half",
    "F_v_difference": "difference of viscous friction between the directions, half",
    "F_s": "force above Coulomb friction at standstill", "log_v_s": "logarithm of Stribeck speed over the largest",
    "F_vv": "force per squared speed", "c": "stiffness", "F_q": "Coulomb friction per position",
    "F_t": "Coulomb friction per time", "F_0t": "force per time", "mu": "friction force per acceleration",
}  # fmt: skip


def build(case: str, arrays: Arrays) -> Machine:
    """One record: the earlier cycles explore, the later ones confirm."""
    rows, scale, cut, count = recordings(case, arrays)
    names = [f"cycle {number}" for number in range(1, count + 1)]
    return Machine(
        NAME, case, tuple(names[:cut]), tuple(names[cut:]), rows, _parameters(scale), _effects(scale),
        {"torque": force},
        notes=(
            f"{cut} of {count} cycles explore",
            "an error of gtau scales mass and friction alike: this record cannot show it",
        ),
        experiments=experiments(), words=WORDS,
    )  # fmt: skip


def force(p: Mapping[str, np.ndarray], x: Mapping[str, np.ndarray]) -> np.ndarray:
    """Mean force (N) in each bin of direction, speed, acceleration and side of the stroke."""
    F = p["M"] * x["a"] + p["F_v"] * x["v"] + p["F_c"] * x["sign"]
    F = F + p["F_0"] + p["F_c_difference"] * x["sign"] ** 2 + p["F_v_difference"] * x["speed"]
    F = F + p["F_vv"] * x["square"] + p["c"] * x["q"] + p["F_q"] * x["place"]
    F = F + p["F_t"] * x["drift"] + p["F_0t"] * x["t"] + p["mu"] * x["push"]
    if np.any(p["F_s"] != 0):
        v_s = np.exp(p["log_v_s"])[..., None] * x["v_max"]
        bump = (np.exp(-((x["samples"] / v_s) ** 2)) * np.sign(x["samples"])).mean(axis=-1)
        F = F + p["F_s"] * bump
    return F


def _parameters(scale: Mapping[str, float]) -> tuple[Parameter, ...]:
    F, v, a = scale["F"], scale["v"], scale["a"]
    return (
        nuisance("M", "kg", 0.5 * F / a, F / a, low=0.0),
        nuisance("F_v", "N s/m", 0.1 * F / v, 0.3 * F / v, low=0.0),
        nuisance("F_c", "N", 0.1 * F, 0.3 * F, low=0.0),
        freedom("offset", "F_0", "N", 0.05 * F, -F, F),
        freedom("coulomb_asymmetry", "F_c_difference", "N", 0.05 * F, -F, F),
        freedom("viscous_asymmetry", "F_v_difference", "N s/m", 0.1 * F / v, -F / v, F / v),
        freedom("stribeck", "F_s", "N", 0.1 * F, 0.0, F),
        freedom("stribeck", "log_v_s", "1", 0.7, np.log(0.02), np.log(1.0), mean=np.log(0.1), off=np.log(0.1)),
        freedom("viscous_nonlinearity", "F_vv", "N s2/m2", 0.1 * F / v**2, -F / v**2, F / v**2),
        freedom("load_spring", "c", "N/m", 0.05 * F / scale["q"], -F / scale["q"], F / scale["q"]),
        freedom("friction_position", "F_q", "N/m", 0.05 * F / scale["q"], -F / scale["q"], F / scale["q"]),
        freedom("friction_drift", "F_t", "N/s", 0.05 * F / scale["t"], -F / scale["t"], F / scale["t"]),
        freedom("offset_drift", "F_0t", "N/s", 0.05 * F / scale["t"], -F / scale["t"], F / scale["t"]),
        freedom("load_friction", "mu", "kg", 0.05 * F / a, -F / a, F / a),
    )  # fmt: skip


def _effects(scale: Mapping[str, float]) -> tuple[Effect, ...]:
    plain = (
        "offset", "coulomb_asymmetry", "viscous_asymmetry", "viscous_nonlinearity", "load_spring", "friction_position",
        "friction_drift", "load_friction",
    )  # fmt: skip
    shapes = tuple({"F_s": 0.1 * scale["F"], "log_v_s": float(np.log(x))} for x in (0.1, 0.4))
    effects = [Effect(name, ("torque",)) for name in plain]
    return (*effects, Effect("stribeck", ("torque",), shapes), Effect("offset_drift", ("sensor_current",)))


def experiments() -> tuple[Experiment, ...]:
    """Other speeds, pushes and lengths."""
    slow = {"v": 0.1, "speed": 0.1, "samples": 0.1, "square": 0.01, "a": 0.01, "push": 0.01}
    return (
        scaled("the same strokes ten times slower", **slow),
        scaled("the same speeds with a third of the acceleration", a=1.0 / 3.0, push=1.0 / 3.0),
        scaled("ten times as long", t=10.0, drift=10.0),
        scaled("the same speeds on a tenth of the stroke", q=0.1, place=0.1),
    )

"""Parameters and hypotheses of the reference actuator: priors, where fits start, what a verdict says of a fit."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..effects import EFFECTS, Effect
from ..faults import FAULT_NAMES
from ..gap.twin import INTERVAL, Hypothesis, Parameter
from ..recording import Recording

HEALTHY_DEVIATION = 5e-4  # of N and xi in a recording called healthy (the format allows 1e-3)
SOAK_DEVIATION = 0.5  # K, of the true ambient temperature about the measured
NEGLIGIBLE = 0.2  # of the smallest realistic value of an effect, below which it is not there
_TOLERANCES = {
    (effect.id, name): parameter
    for effect in EFFECTS.values()
    for name, parameter in effect.parameters.items()
    if parameter.tolerance > 0.0
}
#: starts of a fit where half the range in every parameter would not do
_STARTS: dict[str, tuple[tuple[float, ...], ...]] = {
    "stribeck": ((0.01, 4.0), (0.01, 12.0)),
    "compliance": ((4.5e-4, 300.0), (2e-4, 300.0), (7e-5, 300.0)),
    "dynamic_eccentricity": ((0.01, 0.01),),
    "back_emf_shape": ((112.0, 0.01, 0.01),),
    "self_heating": ((0.1,),),
    "speed_quantisation": ((1.0,),),
    "virtual_neutral": ((1.0,),),
}
#: effects with a parameter that does nothing while another is off
_JOINT = ("stribeck", "compliance")
#: parameters in which an effect is fitted where the catalogue's own are ill-behaved at zero: name -> (units, low, high)
_OWN: dict[str, dict[str, tuple[str, float, float]]] = {
    "dynamic_eccentricity": {"d_cos": ("1", -0.06, 0.06), "d_sin": ("1", -0.06, 0.06)},
    "compliance": {"flexibility": ("rad/(N m)", 0.0, 8e-4), "C": ("N m s/rad", 150.0, 500.0)},
    "self_heating": {"heating_rate": ("K/J", 0.0, 0.5)},
}
#: smallest realistic value of these, where it is not zero
_LEAST = {
    "compliance.flexibility": 1.0 / EFFECTS["compliance"].parameters["K"].high,
    "self_heating.heating_rate": EFFECTS["self_heating"].parameters["heating_rate"].low,
}


def parameters_of(
    actuator: ActuatorParameters, recordings: Mapping[str, Recording], effects: Mapping[str, Effect]
) -> list[Parameter]:
    """Nuisances of a bench (tolerances, faults by health, soak temperatures) and the parameters of every effect."""
    out = []
    for (id_, name), p in _TOLERANCES.items():
        centre = getattr(actuator, p.follows) if p.follows else p.nominal
        sd = p.tolerance * centre
        low, high = min(p.low, centre - 6 * sd), max(p.high, centre + 6 * sd)
        equation = EFFECTS[id_].equations[0]
        out.append(Parameter(f"{id_}.{name}", p.units, centre, centre, sd, low, high, 2.0 * sd, specified=equation))
    groups: dict[str, list[str]] = {}
    for name, recording in recordings.items():
        key = "unknown" if recording.health == "unknown" else f"{recording.health} {name}"
        groups.setdefault(key, []).append(name)
    for key, members in groups.items():
        healthy = key.startswith("healthy")
        for component in FAULT_NAMES[:5]:
            turns = component.startswith("N")
            mean, sd = (0.0, HEALTHY_DEVIATION) if healthy else ((0.03, 0.05) if turns else (0.0, 0.1))
            bound = 2e-3 if healthy else (0.3 if turns else 0.4)
            step = 0.01 if healthy else (0.03 if turns else 0.06)
            low = -bound if not turns or healthy else -0.002
            out.append(
                Parameter(f"{key}.{component}", "1", 0.0, mean, sd, low, bound, step, None, tuple(members), component)
            )
    for name, recording in recordings.items():
        dT = recording.ambient_temperature - actuator.reference_temperature
        sd, low, high = SOAK_DEVIATION, dT - 5, dT + 5
        out.append(
            Parameter(f"{name}.dT", "K", dT, dT, sd, low, high, 3.0, None, (name,), "dT", specified="electrical")
        )
    for effect in effects.values():
        if effect.kind == "calibration":
            continue
        if effect.id in _OWN:
            for name, (units, low, high) in _OWN[effect.id].items():
                sd = 0.5 * max(abs(low), abs(high))
                off = 300.0 if name == "C" else 0.0
                mean = 300.0 if name == "C" else 0.0
                sd = 100.0 if name == "C" else sd
                step = 0.1 * (high - low)
                least = NEGLIGIBLE * _LEAST.get(f"{effect.id}.{name}", 0.0)
                label = f"{effect.id}.{name}"
                small = effect.id == "dynamic_eccentricity"
                own = Parameter(label, units, off, mean, sd, low, high, step, effect.id, amplitude=small, least=least)
                out.append(own)
            continue
        for name, p in effect.parameters.items():
            width = max(abs(p.high - p.nominal), abs(p.low - p.nominal))
            low = p.nominal - 1.5 * width if p.low < p.nominal else p.nominal
            high = p.nominal + 1.5 * width if p.high > p.nominal else p.nominal
            if effect.id == "stribeck" and name == "w_s":
                low, high = 0.7, 40.0
            if name == "width":
                low = 75.0
            out.append(
                Parameter(
                    f"{effect.id}.{name}",
                    p.units,
                    p.nominal,
                    p.nominal,
                    0.6 * width,
                    low,
                    high,
                    0.2 * width,
                    effect.id,
                    amplitude=p.low <= p.nominal <= p.high and name != "w_s",
                    # a switch is on or off, whatever value a fit has left it at
                    least=NEGLIGIBLE * max(p.low - p.nominal, p.nominal - p.high, 0.0) * (p.low < p.high),
                )
            )
    return out


def derive(
    actuator: ActuatorParameters,
    parameters: Sequence[Parameter],
    name: str,
    values: np.ndarray,
    derivative: Callable[[str], np.ndarray],
    recording: str,
) -> np.ndarray:
    """Derivative of one recording's statistics by a parameter that acts only through others.

    Shorting turns in all phases alike is a smaller R, k and L (twice): sum (1 - N_j) d/dN_j = -(R d/dR + k d/dk +
    2 L d/dL). A temperature acts through R, and through k and friction where their own coefficients are on.
    """
    at = {p.name: float(v) for p, v in zip(parameters, values, strict=True)}
    R, k, L = "unit_calibration.R_scale", "unit_calibration.k_scale", "inductance_tolerance.L_scale"
    if name == k:
        total = -at[R] * derivative(R) - 2.0 * at[L] * derivative(L)
        for p in parameters:
            if p.fault in FAULT_NAMES[:3] and recording in (p.recordings or ()):
                total = total - (1.0 - at[p.name]) * derivative(p.name)
        return total / at[k]
    dT = at[name]
    alpha = actuator.copper_coefficient
    out = at[R] * alpha / (1.0 + alpha * dT) * derivative(R)
    alpha_m = at.get("magnet_temperature.alpha_m", 0.0)
    beta, level = at.get("friction_temperature.beta", 0.0), "friction_level.scale"
    if alpha_m != 0.0:
        out = out + at[k] * alpha_m / (1.0 + alpha_m * dT) * derivative(k)
    if beta != 0.0:
        out = out + at[level] * beta / (1.0 + beta * dT) * derivative(level)
    return out


#: effect on the phases -> nuisances that a change of all three in common proportion is, to the first order, with signs:
#: what is read as a larger current is a smaller R and L, and all that it drives is heavier
_ALIKE = {
    "current_gain": {"unit_calibration.R_scale": -1.0, "inductance_tolerance.L_scale": -1.0},
    "voltage_gain": {
        "unit_calibration.R_scale": 1.0,
        "unit_calibration.k_scale": 1.0,
        "inductance_tolerance.L_scale": 1.0,
    },
}
_DRIVEN = ("inertia.scale", "friction_level.scale", "viscous_friction.scale")


def weights_together(effect: str, values: np.ndarray) -> np.ndarray | None:
    """(parameter of the effect,) how each moves where all its phases change together; None for other effects."""
    if effect == "contact_resistance":
        return np.ones(len(values))
    return values.copy() if effect in _ALIKE else None


def derive_together(
    actuator: ActuatorParameters,
    parameters: Sequence[Parameter],
    effect: str,
    values: np.ndarray,
    derivative: Callable[[str], np.ndarray],
    recording: str,
) -> np.ndarray:
    """Derivative of one recording's statistics by a change of all phases of an effect together (see ``derive``).

    Three phases' resistances are one of the winding, which copper's temperature does not change; their gains are other
    constants of the unit.
    """
    at = {p.name: float(v) for p, v in zip(parameters, values, strict=True)}
    if effect == "contact_resistance":
        warm = 1.0 + actuator.copper_coefficient * at[f"{recording}.dT"]
        return derivative("unit_calibration.R_scale") / (actuator.resistance * warm)
    signs = _ALIKE[effect] | dict.fromkeys(_DRIVEN, 1.0)
    return np.sum([sign * at[name] * derivative(name) for name, sign in signs.items()], axis=0)


def hypotheses_of(
    parameters: Sequence[Parameter], effects: Mapping[str, Effect], spacings: Sequence[float]
) -> list[Hypothesis]:
    """One hypothesis per effect; ``spacings`` of the recordings' speeds (rad/s) are where a quantisation starts."""
    out = []
    for effect in effects.values():
        own = [p for p in parameters if p.effect == effect.id]
        if effect.kind == "calibration":
            names = tuple(f"{effect.id}.{n}" for n in effect.parameters)
            out.append(Hypothesis(effect.id, effect.equations, names, (), "calibration"))
            continue
        starts = _STARTS.get(effect.id)
        if effect.id == "speed_quantisation":
            starts = ((float(np.median(spacings)) if max(spacings) > 0 else 1.0,),)
        if starts is None:
            starts = (tuple(p.off + (0.25 * p.sd if p.high > p.off else -0.25 * p.sd) / 0.6 for p in own),)
        additive = len(own) > 1 and effect.id not in _JOINT
        names = tuple(p.name for p in own)
        out.append(Hypothesis(effect.id, effect.equations, names, starts, additive=additive))
    return out


def report(
    parameters: Mapping[str, Parameter], effect: str, values: Mapping[str, float], deviations: Mapping[str, float]
) -> dict[str, tuple[float, float, float, str]]:
    """Catalogue parameters of an effect from those it was fitted in: name -> (value, low, high, units), 90 %."""
    z = INTERVAL
    out: dict[str, tuple[float, float, float, str]] = {}
    own = {n.split(".", 1)[1]: (v, deviations[n]) for n, v in values.items()}
    if effect == "dynamic_eccentricity":
        (x, sx), (y, sy) = own["d_cos"], own["d_sin"]
        d = float(np.hypot(x, y))
        sd = float(np.hypot(x * sx, y * sy) / max(d, 1e-9))
        turn = float(np.hypot(y * sx, x * sy) / max(d, 1e-9) ** 2)
        psi = float(np.arctan2(y, x))
        out["d"] = (d, max(0.0, d - z * sd), d + z * sd, "1")
        out["psi"] = (psi, psi - z * min(turn, np.pi), psi + z * min(turn, np.pi), "rad")
        return out
    for name, (value, sd) in own.items():
        if name == "flexibility":
            low = max(value - z * sd, 1e-6)
            out["K"] = (1.0 / max(value, 1e-6), 1.0 / (value + z * sd), 1.0 / low, "N m/rad")
            continue
        units = parameters[f"{effect}.{name}"].units
        known = EFFECTS[effect].parameters.get(name)
        if known is not None and known.low == known.high:
            out[name] = (known.high, known.high, known.high, units)
            continue
        out[name] = (value, value - z * sd, value + z * sd, units)
        if name == "heating_rate":
            low = max(value - z * sd, 1e-4)
            out["C"] = (1.0 / max(value, 1e-4), 1.0 / (value + z * sd), 1.0 / low, "J/K")
    return out

"""Which estimates a machine can have: what is refused as impossible, and what is said to need caution."""

from collections.abc import Mapping

import numpy as np
from scipy.special import ndtri

from ..effects import EFFECTS
from ..errors import InputError
from .posterior import CHANCE

#: what a fault vector's components can be of any machine, a unit off nominal allowed for
POSSIBLE = {"N": (-0.5, 0.95), "xi": (-1.0, 1.0), "dT": (-150.0, 400.0)}
TOUCHING = 1.0  # eccentricity at which the rotor touches the stator
WARMTH, LARGEST_WARMTH = 30.0, 150.0  # K from the ambient temperature, that are told, and that nothing explains
#: of the back-EMF, which tells the turns: how far a unit is off within its tolerance (1 sigma), and far outside it
BACK_EMF = EFFECTS["unit_calibration"].parameters["k_scale"]
TOLERANCE, UNIT = BACK_EMF.tolerance, BACK_EMF.high - 1.0
SURE = 0.95  # that a share lies below what the latter looks like, from which it is refused
REMEDY = "the unit is off nominal or a channel's scale is mistaken, --reference calibrates on healthy recordings"

Estimate = Mapping[str, Mapping[str, float]]


def doubts(name: str, estimate: Estimate, ambient: float, level: float) -> list[str]:
    """What in an estimate lies further out than a nominal unit explains, in words.

    Parameters
    ----------
    name : of the recording
    ambient : ambient temperature, K above the reference one
    level : of the estimate's intervals

    Raises
    ------
    InputError : a component that no machine has
    """
    for component, found in estimate.items():
        low, high = POSSIBLE[_kind(component)]
        if not low <= found["value"] <= high:
            units = " K" if component == "dT" else ""
            raise InputError(
                f"{name}: {component} would be {found['value']:.4g}{units}, possible is {low:g} to {high:g}{units}; "
                "the recording's units, signs or phases are mistaken, or it is of another actuator"
            )
    eccentricity = float(np.hypot(estimate["xi_x"]["value"], estimate["xi_y"]["value"]))
    if eccentricity >= TOUCHING:
        raise InputError(
            f"{name}: xi_x and xi_y would be {eccentricity:.3g} together, at {TOUCHING:g} the rotor touches the "
            "stator; the recording's units, signs or phases are mistaken, or it is of another actuator"
        )
    return _warmth(name, estimate, ambient) + _negative(name, estimate, level)


def _kind(component: str) -> str:
    return component if component == "dT" else "N" if component.startswith("N") else "xi"


def _warmth(name: str, estimate: Estimate, ambient: float) -> list[str]:
    above = estimate["dT"]["value"] - ambient
    if abs(above) > LARGEST_WARMTH:
        raise InputError(
            f"{name}: dT would be {estimate['dT']['value']:.4g} K at an ambient dT of {ambient:.4g} K; its "
            "sensors or ambient_temperature are mistaken, or it is of another actuator"
        )
    if abs(above) > WARMTH:
        return [f"dT lies {above:.0f} K from ambient: the unit is off nominal, --reference calibrates it"]
    return []


def _negative(name: str, estimate: Estimate, level: float) -> list[str]:
    """Shares of shorted turns below zero by more than noise and what is known of the unit explain."""
    said = []
    for component, found in estimate.items():
        if _kind(component) != "N":
            continue
        deviation = np.hypot((found["high"] - found["value"]) / ndtri(0.5 + 0.5 * level), TOLERANCE)
        shown = f"{found['value']:.3g} [{found['low']:.3g}, {found['high']:.3g}]"
        if found["value"] + ndtri(SURE) * deviation < -UNIT:
            raise InputError(
                f"{name}: {component} would be {shown}; a share of shorted turns is not negative, and a unit far "
                f"outside its tolerance looks like {-UNIT:.2g} at the lowest; {REMEDY}"
            )
        if found["value"] + ndtri(1.0 - CHANCE) * deviation < 0.0:
            said.append(f"{component} is {shown}, a share of shorted turns is not negative: {REMEDY}")
    return said

"""Small brushless motors at full throttle with several propellers and packs, seen at the controller's input.

At duty one, where the bus current is the phase current (R includes controller and leads):
    v_bus = k w + R i
"""

from collections.abc import Mapping

import numpy as np

from .recorded.propeller_sweep import distortions, read, recordings
from .statement import Arrays, Effect, Experiment, Machine, Parameter, freedom, nuisance, scaled

__all__ = ["build", "distortions", "experiments", "read"]
NAME = "propeller_sweep"
WORDS = {"k": "back-EMF constant", "R": "resistance"}
EFFECTS = (
    *(Effect(e, ("electrical",)) for e in ("self_heating", "magnet_heating", "commutation_loss", "constant_drop")),
    Effect("voltage_offset", ("sensor_voltage",)), Effect("supply_limit", ("bus",)),
    Effect("voltage_gain", ("sensor_voltage",)), Effect("current_gain", ("sensor_current",)),
    Effect("current_offset", ("sensor_current",)),
)  # fmt: skip


def build(case: str, arrays: Arrays) -> Machine:
    """One motor: the first propellers explore, the others confirm (with one propeller: the packs)."""
    rows, scale, explore, confirm, note = recordings(case, arrays)
    return Machine(
        NAME, case, explore, confirm, rows, _parameters(scale), EFFECTS, {"electrical": voltage},
        notes=(note, "a voltage gain is a k gain, a current gain an R gain: no row of these sweeps tells them apart"),
        experiments=experiments(), words=WORDS,
    )  # fmt: skip


def voltage(p: Mapping[str, np.ndarray], x: Mapping[str, np.ndarray]) -> np.ndarray:
    """Bus voltage (V) of each full-throttle row; heating is that of a steady copper loss."""
    w, i = x["w"], (x["i"] - p["i_offset"]) / (1 + p["gain_i"])
    heat = i**2 - 0.5 * x["i_max"] ** 2  # stated at half the largest loss, so that R and k keep their meaning
    v = p["k"] * (1 - p["weakening"] * heat) * w + p["R"] * (1 + p["heating"] * heat) * i
    v = v + p["L_commutation"] * w * i + p["V_drop"]
    return v * (1 + p["gain_v"]) + p["V_offset"] + p["V_limit"] * x["limit"]


def _parameters(scale: Mapping[str, float]) -> tuple[Parameter, ...]:
    k, R = scale["voltage"] / scale["omega"], scale["voltage"] / scale["current"]
    inverse, volt, ampere = 1 / scale["current"], scale["voltage"], scale["current"]
    return (
        nuisance("k", "V s/rad", 0.8 * k, 0.4 * k, low=0.0),
        nuisance("R", "ohm", 0.15 * R, 0.15 * R, low=0.0),
        freedom("self_heating", "heating", "1/A2", 0.3 * inverse**2, 0.0, 2 * inverse**2),
        freedom("magnet_heating", "weakening", "1/A2", 0.1 * inverse**2, 0.0, inverse**2),
        freedom("commutation_loss", "L_commutation", "V s/(rad A)", 0.1 * k * inverse, 0.0, k * inverse),
        freedom("constant_drop", "V_drop", "V", 0.05 * volt, 0.0, 0.3 * volt),
        freedom("voltage_offset", "V_offset", "V", 0.02 * volt, -0.2 * volt, 0.2 * volt),
        freedom("supply_limit", "V_limit", "V", 0.02 * volt, -0.2 * volt, 0.2 * volt),
        freedom("voltage_gain", "gain_v", "1", 0.05, -0.3, 0.3),
        freedom("current_gain", "gain_i", "1", 0.1, -0.5, 0.5),
        freedom("current_offset", "i_offset", "A", 0.02 * ampere, -0.2 * ampere, 0.2 * ampere),
    )  # fmt: skip


def experiments() -> tuple[Experiment, ...]:
    """Loads that take apart speed and current, which a propeller ties together."""
    return (
        scaled("full throttle without propeller", i=0.1),
        scaled("full throttle with half the load at the same speed", i=0.5),
        scaled("the same currents at a third of the voltage, with a larger propeller", w=1.0 / 3.0),
        scaled("the same currents with the rotor locked", w=0.0),
    )

"""A six-step brushless drive with a propeller, seen at its bus by one or two instruments.

At steady speed, i = i_bus / D the phase current while it flows continuously:
    D v = k w + R i          (electrical)
    T   = k i                (torque)
    v_bench = v_esc, i_bench = i_esc   (two instruments of one quantity)
Where the duty is not logged, i = T / k and only the power balance v i_bus - T w = (R / k^2) T^2 is left (bus).
"""

from collections.abc import Mapping

import numpy as np

from .recorded.six_step_bus import OPTIONAL, TAU, UNITS, distortions, read, recordings
from .statement import Arrays, Effect, Experiment, Machine, Parameter, freedom, nuisance, scaled

__all__ = ["OPTIONAL", "UNITS", "build", "distortions", "experiments", "read"]
NAME = "six_step_bus"
WORDS = {"k": "back-EMF constant", "R": "resistance", "R_k2": "resistance over the squared back-EMF constant"}
SPAN = float(np.log(TAU[-1] / TAU[0]))  # of the logarithm of a thermal time constant over the shortest
Values = Mapping[str, np.ndarray]


def build(case: str, arrays: Arrays) -> Machine:
    """One log: plateaus up to the highest speed explore, those after it (the way back) confirm."""
    rows, scale, notes = recordings(case, arrays)
    found = {r.equation for r in rows}
    equations = {
        "electrical": electrical, "torque": torque, "bus": bus, "sensor_voltage": second_voltage,
        "sensor_current": second_current,
    }  # fmt: skip
    return Machine(
        NAME, case, ("first pass",), ("return",), rows, _parameters(scale), _effects(scale, found),
        {e: f for e, f in equations.items() if e in found}, notes=notes, experiments=experiments(), words=WORDS,
    )  # fmt: skip


def _at(heat: np.ndarray, log_tau: np.ndarray) -> np.ndarray:
    """(point, row) heating state at log(tau / TAU[0]), linear between the tabulated time constants."""
    position = np.clip(log_tau[:, 0] / SPAN, 0, 1) * (TAU.size - 1)
    low = np.minimum(position.astype(int), TAU.size - 2)
    share = (position - low)[:, None]
    return (1 - share) * heat[low] + share * heat[low + 1]


def _motor(p: Values, x: Values) -> tuple[np.ndarray, np.ndarray]:
    """Phase current (A) and torque constant (V s/rad)."""
    i = x["i"] / np.exp(p["log_gain_i"])
    return i, p["k"] * (1 - p["weakening"] * _at(x["heat"], p["log_tau_m"])) * (1 - p["saturation"] * i)


def electrical(p: Values, x: Values) -> np.ndarray:
    """Mean voltage D v (V) as the first instrument shows it."""
    i, k = _motor(p, x)
    R = p["R"] * (1 + p["heating"] * _at(x["heat"], p["log_tau"]))
    v = k * x["w"] + R * i + (p["L_commutation"] - p["advance"]) * x["w"] * i
    v = v + p["V_drop"] + (1 - x["D"]) * p["V_diode"]
    # the bridge cannot be on for longer than always, whatever its timer adds
    return v * np.exp(p["log_gain_v"]) - (np.clip(x["D"] + p["duty_offset"], 0, 1) - x["D"]) * x["v"]


def torque(p: Values, x: Values) -> np.ndarray:
    """Torque (N m) at the stand."""
    i, k = _motor(p, x)
    return np.exp(p["log_gain_T"]) * (k * i - p["T_0"] - p["b"] * x["w"])


def bus(p: Values, x: Values) -> np.ndarray:
    """Losses (W) as the instruments show them: their power less the torque they show times the speed."""
    made = x["T"] / np.exp(p["log_gain_T"]) + p["T_0"] + p["b"] * x["w"]
    losses = p["R_k2"] * (1 + p["heating"] * _at(x["heat"], p["log_tau"])) * made**2
    return (losses + made * x["w"]) * np.exp(p["log_gain_v"] + p["log_gain_i"]) - x["T"] * x["w"]


def second_voltage(p: Values, x: Values) -> np.ndarray:
    """Bus voltage (V) at the second instrument."""
    lead = p["R_lead"] * x["bus"] / np.exp(p["log_gain_i"])
    return np.exp(p["log_gain_v2"]) * (x["v"] / np.exp(p["log_gain_v"]) + lead)


def second_current(p: Values, x: Values) -> np.ndarray:
    """Bus current (A) at the second instrument, which may be slow."""
    return np.exp(p["log_gain_i2"] - p["log_gain_i"]) * (x["bus"] - p["lag"] * x["rise"])


def _parameters(scale: Mapping[str, float]) -> tuple[Parameter, ...]:
    v, T, k, R = scale["v"], scale["T"], scale["v"] / scale["w"], scale["v"] / scale["i"]
    inverse = 1 / scale["i"]
    return (
        nuisance("k", "V s/rad", 0.7 * k, 0.3 * k, low=0.05 * k),
        nuisance("R", "ohm", 0.2 * R, 0.2 * R, low=0.0),
        # all that a power balance holds of R and k
        nuisance("R_k2", "W/(N m)2", 0.4 * R / k**2, 0.4 * R / k**2, low=0.0),
        freedom("self_heating", "heating", "1/A2", 0.4 * inverse**2, 0.0, 3 * inverse**2),
        freedom("self_heating", "log_tau", "1", 1.0, 0.0, SPAN, mean=2.0, off=2.0),
        freedom("magnet_heating", "weakening", "1/A2", 0.1 * inverse**2, 0.0, inverse**2),
        freedom("magnet_heating", "log_tau_m", "1", 1.0, 0.0, SPAN, mean=3.0, off=3.0),
        freedom("commutation_loss", "L_commutation", "V s/(rad A)", 0.1 * k * inverse, 0.0, k * inverse),
        freedom("commutation_advance", "advance", "V s/(rad A)", 0.1 * k * inverse, 0.0, k * inverse),
        freedom("constant_drop", "V_drop", "V", 0.05 * v, 0.0, 0.3 * v),
        freedom("freewheel_drop", "V_diode", "V", 1.0, 0.0, 3.0),
        freedom("duty_offset", "duty_offset", "1", 0.03, -0.2, 0.2),
        freedom("saturation", "saturation", "1/A", 0.1 * inverse, 0.0, 0.8 * inverse),
        freedom("no_load_torque", "T_0", "N m", 0.05 * T, 0.0, 0.5 * T),
        freedom("no_load_torque", "b", "N m s/rad", 0.1 * T / scale["w"], 0.0, T / scale["w"]),
        freedom("torque_gain", "log_gain_T", "1", 0.1, -1.2, 1.2),
        freedom("voltage_gain_first", "log_gain_v", "1", 0.05, -1.2, 1.2),
        freedom("voltage_gain_second", "log_gain_v2", "1", 0.05, -1.2, 1.2),
        freedom("current_gain_first", "log_gain_i", "1", 0.15, -1.2, 1.2),
        freedom("current_gain_second", "log_gain_i2", "1", 0.15, -1.2, 1.2),
        freedom("lead_resistance", "R_lead", "ohm", 0.02, 0.0, 0.2),
        freedom("current_lag", "lag", "s", 0.2, 0.0, 1.0),
    )  # fmt: skip


def _effects(scale: Mapping[str, float], found: set[str]) -> tuple[Effect, ...]:
    """The effects that act in the equations of this log, heating tried at several time constants."""
    e, s_v, s_i = "electrical", "sensor_voltage", "sensor_current"
    squared = 1 / scale["i"] ** 2
    heated = tuple({"heating": 0.4 * squared, "log_tau": x} for x in (0.7, 2.0, 3.3))
    weakened = tuple({"weakening": 0.1 * squared, "log_tau_m": x} for x in (1.5, 3.0, 4.0))
    every = (
        Effect("self_heating", (e, "bus"), heated), Effect("magnet_heating", (e, "torque"), weakened),
        Effect("saturation", (e, "torque")), Effect("commutation_loss", (e,)), Effect("commutation_advance", (e,)),
        Effect("constant_drop", (e,)), Effect("freewheel_drop", (e,)), Effect("duty_offset", (e,)),
        Effect("no_load_torque", ("torque", "bus")), Effect("torque_gain", ("torque", "bus")),
        Effect("voltage_gain_first", (s_v, e, "bus")), Effect("current_gain_first", (s_i, e, "torque", "bus")),
        Effect("voltage_gain_second", (s_v,)), Effect("lead_resistance", (s_v,)),
        Effect("current_gain_second", (s_i,)), Effect("current_lag", (s_i,)),
    )  # fmt: skip
    return tuple(x for x in every if set(x.equations) & found)


def experiments() -> tuple[Experiment, ...]:
    """Conditions that take apart what a propeller ties together."""
    return (
        scaled("the same steps on a cold machine, a second each", heat=0.0),
        scaled("the same steps, each twice as long", heat=1.5),
        scaled("the same currents with the rotor locked", w=0.0, heat=1.0),
        scaled("the same speeds without propeller", i=0.1, bus=0.1, T=0.1, heat=0.01),
        scaled("the same speeds with half the load", i=0.5, bus=0.5, T=0.5, heat=0.25),
        scaled("steps up and down, watched from the edge on", rise=3.0),
    )

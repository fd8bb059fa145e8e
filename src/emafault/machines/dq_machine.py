"""A sinusoidal PMSM in rotor coordinates, known by its dq voltages and currents, torque and temperatures.

Quasi-steady, with the pole pairs inside L_d, L_q and psi (mechanical speed):
    u_d = R i_d - w L_q i_q
    u_q = R i_q + w (L_d i_d + psi)
    T   = 3/2 (psi i_q + (L_d - L_q) i_d i_q)
"""

from collections.abc import Mapping

import numpy as np

from .recorded.dq_machine import UNITS, distortions, read, recordings
from .statement import Arrays, Effect, Experiment, Machine, Parameter, freedom, nuisance, scaled

__all__ = ["UNITS", "build", "distortions", "experiments", "read"]
NAME = "dq_machine"
WORDS = {
    "R": "phase resistance",
    "L_d": "inductance in d",
    "L_q": "inductance in q",
    "psi": "flux linkage of the magnets",
}
IRON_LOSS = 0.02  # of the apparent power: iron loss that a machine of this kind has
Values = Mapping[str, np.ndarray]


def build(case: str, arrays: Arrays) -> Machine:
    """One recording: the earlier part explores, the later part and conditions first met there confirm."""
    rows, scale, explore, confirm, note = recordings(case, arrays)
    return Machine(
        NAME, case, explore, confirm, rows, _parameters(scale), EFFECTS,
        {"electrical_d": u_d, "electrical_q": u_q, "torque": torque}, notes=(note,),
        experiments=experiments(), words=WORDS,
    )  # fmt: skip


def _linkages(p: Values, x: Values) -> tuple[np.ndarray, ...]:
    """i_d, i_q as they are and as they make torque; L_d, L_q, psi; flux linkages in both axes."""
    i_d, i_q = x["i_d"] / (1 + p["gain_i"]), x["i_q"] / (1 + p["gain_i"])
    psi = p["psi"] * (1 + p["alpha_m"] * x["magnet"])
    # inductances fall (saturation > 0) with the current beyond half the largest one, at which L_d, L_q are stated
    L_d = p["L_d"] * (1 - p["saturation_d"] * (np.abs(i_d) - 0.5 * x["reference"]))
    L_q = p["L_q"] * (1 - p["saturation_q"] * (np.abs(i_q) - 0.5 * x["reference"]))
    flux_d = L_d * i_d + psi + p["cross_saturation"] * i_q**2
    flux_q = L_q * i_q + 2 * p["cross_saturation"] * i_d * i_q
    # iron loss as a conductance across the induced voltage takes current that the flux linkages do not see
    i_dt, i_qt = i_d + p["G_iron"] * x["w"] * flux_q, i_q - p["G_iron"] * x["w"] * flux_d
    return i_d, i_q, i_dt, i_qt, L_d, L_q, psi, flux_d + L_d * (i_dt - i_d), flux_q + L_q * (i_qt - i_q)


def _resistive(p: Values, x: Values, i: np.ndarray, i_d: np.ndarray, i_q: np.ndarray) -> np.ndarray:
    size = np.hypot(i_d, i_q) + 1e-3 * x["reference"]
    return p["R"] * (1 + p["alpha_R"] * x["winding"]) * i + p["V_drop"] * i / size


def u_d(p: Values, x: Values) -> np.ndarray:
    """Mean voltage in d (V)."""
    i_d, i_q, _, _, L_d, L_q, psi, _, flux_q = _linkages(p, x)
    u = _resistive(p, x, i_d, i_d, i_q) - x["w"] * flux_q + p["delta"] * x["w"] * ((L_q - L_d) * i_d - psi)
    return u * (1 + p["drift"] * x["elapsed"])


def u_q(p: Values, x: Values) -> np.ndarray:
    """Mean voltage in q (V)."""
    i_d, i_q, _, _, L_d, L_q, _, flux_d, _ = _linkages(p, x)
    u = _resistive(p, x, i_q, i_d, i_q) + x["w"] * flux_d + p["delta"] * x["w"] * (L_d - L_q) * i_q
    return u * (1 + p["drift"] * x["elapsed"])


def torque(p: Values, x: Values) -> np.ndarray:
    """Mean torque (N m); one computed from the currents alone has psi as at the reference temperature."""
    _, _, i_dt, i_qt, _, _, psi, flux_d, flux_q = _linkages(p, x)
    gain = (1 + p["gain_T"]) * (1 + p["gain_map"]) * (1 + p["drift_T"] * x["elapsed"])
    flux_d = flux_d + p["share_map"] * (p["psi"] - psi)
    return 1.5 * (flux_d * i_qt - flux_q * i_dt) * gain - p["T_iron"] * np.sign(x["w"])


def _parameters(scale: Mapping[str, float]) -> tuple[Parameter, ...]:
    impedance = scale["voltage"] / scale["current"]
    inductance, flux = impedance / scale["omega"], scale["voltage"] / scale["omega"]
    inverse, cross = 1 / scale["current"], flux / scale["current"] ** 2
    voltage, torque = scale["voltage"], scale["torque"]
    return (
        nuisance("R", "ohm", 0.1 * impedance, 0.1 * impedance, low=0.0),
        nuisance("L_d", "H", 2 * inductance, 2 * inductance, low=0.0),
        nuisance("L_q", "H", 2 * inductance, 2 * inductance, low=0.0),
        nuisance("psi", "V s/rad", 1.5 * flux, 1.5 * flux, low=0.0),
        freedom("resistance_temperature", "alpha_R", "1/K", 0.0005, 0.0, 0.008, mean=0.0039),
        freedom("magnet_temperature", "alpha_m", "1/K", 0.0006, -0.004, 0.0005, mean=-0.001),
        freedom("saturation_d", "saturation_d", "1/A", 0.3 * inverse, -inverse, inverse),
        freedom("saturation_q", "saturation_q", "1/A", 0.3 * inverse, 0.0, inverse),
        freedom("cross_saturation", "cross_saturation", "V s/(rad A2)", 0.1 * cross, -cross, cross),
        freedom("iron_loss", "G_iron", "1/ohm", IRON_LOSS / impedance, 0.0, 1 / impedance),
        freedom("iron_loss", "T_iron", "N m", 0.02 * torque, 0.0, 0.2 * torque),
        freedom("voltage_error", "V_drop", "V", 0.02 * voltage, -0.2 * voltage, 0.2 * voltage),
        freedom("angle_offset", "delta", "rad", 0.03, -0.3, 0.3),
        freedom("torque_from_map", "share_map", "1", 0.3, 0.0, 1.2, mean=1.0),
        freedom("torque_from_map", "gain_map", "1", 0.05, -0.3, 0.3),
        freedom("torque_gain", "gain_T", "1", 0.05, -0.5, 0.5),
        freedom("current_gain", "gain_i", "1", 0.03, -0.3, 0.3),
        freedom("voltage_drift", "drift", "1", 0.02, -0.2, 0.2),
        freedom("torque_drift", "drift_T", "1", 0.05, -0.3, 0.3),
    )  # fmt: skip


_D, _Q, _T = "electrical_d", "electrical_q", "torque"
EFFECTS = (
    Effect("resistance_temperature", (_D, _Q)), Effect("magnet_temperature", (_Q, _T)),
    Effect("saturation_d", (_Q, _T)), Effect("saturation_q", (_D, _T)), Effect("cross_saturation", (_D, _Q)),
    Effect("iron_loss", (_D, _Q, _T)), Effect("voltage_error", (_D, _Q)), Effect("angle_offset", (_D, _Q)),
    Effect("torque_from_map", (_T,)), Effect("torque_gain", (_T,)), Effect("current_gain", (_T, _D, _Q)),
    Effect("voltage_drift", (_D, _Q)), Effect("torque_drift", (_T,)),
)  # fmt: skip


def experiments() -> tuple[Experiment, ...]:
    """Conditions that take apart what one speed and one load leave together."""

    def pulse(x: Values) -> Values:
        return {"magnet": np.full_like(x["magnet"], x["magnet"].min())}

    return (
        scaled("the same currents at a third of the speed", w=1.0 / 3.0),
        scaled("the same currents at standstill", w=1e-3),
        scaled("the same speed without current", i_d=0.0, i_q=0.0),
        scaled("the same speed and i_q, i_d half as large", i_d=0.5),
        scaled("the same speed and i_d, i_q reversed", i_q=-1.0),
        Experiment("the same load in short pulses: winding hot, magnets cold", pulse),
        scaled("the same load on a machine at 20 degC", winding=0.0, magnet=0.0),
    )

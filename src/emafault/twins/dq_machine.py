"""A sinusoidal PMSM in rotor coordinates, known by its dq voltages and currents, torque and temperatures.

Base model, quasi-steady, with the pole pairs inside L_d, L_q and psi (mechanical speed):
    u_d = R i_d - w L_q i_q
    u_q = R i_q + w (L_d i_d + psi)
    T   = 3/2 (psi i_q + (L_d - L_q) i_d i_q)
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from emafault.errors import InputError
from emafault.gap.twin import Cell, Parameter
from emafault.twins.measured import (
    Arrays,
    Block,
    Distortion,
    MeasuredTwin,
    freedom,
    library,
    mean_variance,
    nuisance,
    read_columns,
    require_finite,
    smooth_covariance,
)
from emafault.twins.measured_experiments import Experiment, scaled

NAME = "dq_machine"
COLUMNS = ("u_d", "u_q", "i_d", "i_q", "motor_speed", "torque", "pm", "stator_winding")
REFERENCE_TEMPERATURE = 20.0  # degC, at which R, psi and the inductances are stated
ACCURACY = 0.005  # of the largest value: how far the recorded voltages and torque are trusted
IRON_LOSS = 0.02  # of the apparent power: iron loss that a machine of this kind has
STEADY = 0.01  # relative change of speed or current between rows above which a row is a transient
SETTLE = 4  # rows dropped after each transient
BLOCKS = 80  # pieces that the steady rows are cut into, at least two per condition
EXPLORE_SHARE = 0.6  # of the steady rows


def read(path: Path) -> dict[str, Arrays]:
    """Columns of one CSV file as one case.

    Raises
    ------
    InputError
        on a missing column, a value that is not finite or too few rows.
    """
    arrays = read_columns(path, COLUMNS)
    require_finite(path, arrays, COLUMNS, rows=100)
    return {Path(path).name.split(".")[0]: {name: arrays[name] for name in COLUMNS}}


def steady_stretches(arrays: Arrays) -> list[np.ndarray]:
    """Rows of each uninterrupted steady operating condition, in time order; transients and their settling left out."""
    speed, current = arrays["motor_speed"], np.hypot(arrays["i_d"], arrays["i_q"])
    moving = np.zeros(speed.size, bool)
    for signal in (speed, current, arrays["i_q"]):
        moving[1:] |= np.abs(np.diff(signal)) > STEADY * np.abs(signal).max()
    for _ in range(SETTLE):
        moving[1:] |= moving[:-1]
    steady = ~moving & (np.abs(speed) > 0.02 * np.abs(speed).max())
    edges = np.flatnonzero(np.diff(np.r_[False, steady, False]))
    return [np.arange(a, b) for a, b in zip(edges[::2], edges[1::2]) if b - a >= 10]


def build(case: str, arrays: Arrays) -> MeasuredTwin:
    """Twin of one recording: the earlier part explores, the later part and conditions first met there confirm.

    Raises
    ------
    InputError
        when there are too few steady rows to split.
    """
    stretches = steady_stretches(arrays)
    total = sum(s.size for s in stretches)
    if total < 60:
        raise InputError(f"{case}: {total} steady rows at speed, at least 60 are needed")
    explore, confirm = _split(stretches, int(EXPLORE_SHARE * total))
    scale = _scales(arrays, np.concatenate(stretches))
    blocks = {part: _block(part, rows, total, arrays, scale) for part, rows in (explore | confirm).items()}
    parameters = _parameters(scale)
    return MeasuredTwin(
        NAME, case, tuple(explore), tuple(confirm), blocks, parameters, library(parameters, _equations()), _model,
        notes=(
            f"{total} steady rows in {len(stretches)} operating condition(s); the first {EXPLORE_SHARE:.0%} explore",
        ),
    )  # fmt: skip


def _split(stretches: list[np.ndarray], room: int) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Rows of the recordings that explore (the first ``room`` rows) and confirm (all later ones), by condition."""
    explore: dict[str, np.ndarray] = {}
    confirm: dict[str, np.ndarray] = {}
    for number, rows in enumerate(stretches, start=1):
        early, late = rows[:room], rows[room:]
        room = max(room - rows.size, 0)
        if early.size >= 10:
            explore[f"condition {number}"] = early
        if late.size >= 10:
            confirm[f"condition {number}, later" if early.size else f"condition {number}"] = late
    return explore, confirm


def _scales(arrays: Arrays, rows: np.ndarray) -> dict[str, float]:
    """Sizes from which the priors and accuracies are set: no value of the machine is assumed."""
    voltage = float(np.hypot(arrays["u_d"], arrays["u_q"])[rows].max())
    current = float(np.hypot(arrays["i_d"], arrays["i_q"])[rows].max())
    omega = float(np.abs(arrays["motor_speed"][rows]).max() * 2 * np.pi / 60)
    torque = float(np.abs(arrays["torque"][rows]).max())
    if min(voltage, current, omega, torque) <= 0:
        raise InputError("voltage, current, speed and torque must not be zero throughout")
    return {"voltage": voltage, "current": current, "omega": omega, "torque": torque}


def _block(part: str, rows: np.ndarray, total: int, arrays: Arrays, scale: Mapping[str, float]) -> Block:
    pieces = np.array_split(rows, int(np.clip(BLOCKS * rows.size / total, 2, rows.size // 5)))
    omega = arrays["motor_speed"] * 2 * np.pi / 60
    columns = dict(
        w=omega, i_d=arrays["i_d"], i_q=arrays["i_q"], winding=arrays["stator_winding"] - REFERENCE_TEMPERATURE,
        magnet=arrays["pm"] - REFERENCE_TEMPERATURE,
    )  # fmt: skip
    inputs = {name: np.array([values[p].mean() for p in pieces]) for name, values in columns.items()}
    inputs["reference"] = np.full(len(pieces), scale["current"])
    inputs["elapsed"] = np.array([p.mean() for p in pieces]) / arrays["u_d"].size
    cells, observed, variance = [], [], []
    time = np.array([p.mean() for p in pieces])
    for signal, equation in (("u_d", "electrical_d"), ("u_q", "electrical_q"), ("torque", "torque")):
        values = arrays[signal]
        observed.append([values[p].mean() for p in pieces])
        variance.append([mean_variance(values[p]) for p in pieces])
        cells += [Cell(part, equation, "time", float(p[0]), float(p[-1]), f"mean {signal}") for p in pieces]
    length = 0.1 * arrays["u_d"].size
    accuracy = [ACCURACY * scale["voltage"]] * 2 + [ACCURACY * scale["torque"]]
    covariance = np.zeros((3 * len(pieces), 3 * len(pieces)))
    for k in range(3):
        s = slice(k * len(pieces), (k + 1) * len(pieces))
        covariance[s, s] = smooth_covariance(time, accuracy[k], length) + np.diag(variance[k])
    return Block(cells, np.concatenate(observed), covariance, inputs)


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


def _equations() -> dict[str, tuple[str, ...]]:
    d, q, torque = "electrical_d", "electrical_q", "torque"
    return {
        "resistance_temperature": (d, q),
        "magnet_temperature": (q, torque),
        "saturation_d": (q, torque),
        "saturation_q": (d, torque),
        "cross_saturation": (d, q),
        "iron_loss": (d, q, torque),
        "voltage_error": (d, q),
        "angle_offset": (d, q),
        "torque_from_map": (torque,),
        "torque_gain": (torque,),
        "current_gain": (torque, d, q),
        "voltage_drift": (d, q),
        "torque_drift": (torque,),
    }


def _model(p: Mapping[str, np.ndarray], block: Block) -> np.ndarray:
    """(point, statistic): mean u_d, u_q and torque of each piece of time."""
    x = block.inputs
    w = x["w"]
    i_d, i_q = x["i_d"] / (1 + p["gain_i"]), x["i_q"] / (1 + p["gain_i"])
    R = p["R"] * (1 + p["alpha_R"] * x["winding"])
    psi = p["psi"] * (1 + p["alpha_m"] * x["magnet"])
    # inductances fall (saturation > 0) with the current beyond half the largest one, at which L_d, L_q are stated
    L_d = p["L_d"] * (1 - p["saturation_d"] * (np.abs(i_d) - 0.5 * x["reference"]))
    L_q = p["L_q"] * (1 - p["saturation_q"] * (np.abs(i_q) - 0.5 * x["reference"]))
    flux_d = L_d * i_d + psi + p["cross_saturation"] * i_q**2
    flux_q = L_q * i_q + 2 * p["cross_saturation"] * i_d * i_q
    # iron loss as a conductance across the induced voltage takes current that the flux linkages do not see
    i_dt, i_qt = i_d + p["G_iron"] * w * flux_q, i_q - p["G_iron"] * w * flux_d
    flux_d_t = flux_d + L_d * (i_dt - i_d)
    flux_q_t = flux_q + L_q * (i_qt - i_q)
    size = np.hypot(i_d, i_q) + 1e-3 * x["reference"]
    u_d = R * i_d - w * flux_q_t + p["V_drop"] * i_d / size
    u_q = R * i_q + w * flux_d_t + p["V_drop"] * i_q / size
    u_d, u_q = (
        u_d + p["delta"] * w * ((L_q - L_d) * i_d - psi),
        u_q + p["delta"] * w * (L_d - L_q) * i_q,
    )
    growth = 1 + p["drift"] * x["elapsed"]
    # a torque computed from the currents alone does not follow the magnet: psi as at the reference temperature
    flux_torque = flux_d_t + p["share_map"] * (p["psi"] - psi)
    gain = (1 + p["gain_T"]) * (1 + p["gain_map"]) * (1 + p["drift_T"] * x["elapsed"])
    torque = 1.5 * (flux_torque * i_qt - flux_q_t * i_dt) * gain - p["T_iron"] * np.sign(w)
    return np.concatenate([u_d * growth, u_q * growth, torque], axis=1)


def experiments() -> tuple[Experiment, ...]:
    """Conditions that take apart what one speed and one load leave together."""

    def pulse(x: Mapping[str, np.ndarray]) -> Mapping[str, np.ndarray]:
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


def distortions() -> tuple[Distortion, ...]:
    """Known changes of a recording and what rightly names each."""

    def voltage_drift(a: Arrays) -> Arrays:
        growth = 1 + 0.05 * np.linspace(0, 1, a["u_d"].size)
        return a | {"u_d": a["u_d"] * growth, "u_q": a["u_q"] * growth}

    def torque_drift(a: Arrays) -> Arrays:
        return a | {"torque": a["torque"] * (1 + 0.1 * np.linspace(0, 1, a["torque"].size))}

    def torque_wave(a: Arrays) -> Arrays:
        time = np.arange(a["torque"].size)
        wave = np.sin(2 * np.pi * time / (0.15 * time.size))
        return a | {"torque": a["torque"] + 0.05 * np.abs(a["torque"]).max() * wave}

    return (
        Distortion("voltages drift by 5 %", voltage_drift, ("voltage_drift",), "electrical_q"),
        Distortion("torque drifts by 10 %", torque_drift, ("torque_drift",), "torque"),
        Distortion("torque wanders by 5 %", torque_wave, (), "torque"),
    )

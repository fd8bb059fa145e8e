"""Recordings of a machine in rotor coordinates: steady stretches, reduced to means of pieces in time."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ...errors import InputError
from ..files import read_columns, require_finite
from ..statement import Arrays, Distortion, Rows
from ..statistics import mean_variance, smooth_error

UNITS = {
    "u_d": "V", "u_q": "V", "i_d": "A", "i_q": "A", "motor_speed": "rpm", "torque": "N m", "pm": "degC",
    "stator_winding": "degC",
}  # fmt: skip
COLUMNS = tuple(UNITS)
REFERENCE_TEMPERATURE = 20.0  # degC, at which R, psi and the inductances are stated
ACCURACY = 0.005  # of the largest value: how far the recorded voltages and torque are trusted
STEADY = 0.01  # relative change of speed or current between rows above which a row is a transient
SCATTER = 8.0  # of a signal's usual change between rows: what is no larger is no transient
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
    # a component of the current may be nothing but noise: its changes count by the current's size
    for signal, size in ((speed, speed), (current, current), (arrays["i_q"], current)):
        change = np.abs(np.diff(signal))
        moving[1:] |= change > max(STEADY * np.abs(size).max(), SCATTER * float(np.median(change)))
    for _ in range(SETTLE):
        moving[1:] |= moving[:-1]
    steady = ~moving & (np.abs(speed) > 0.02 * np.abs(speed).max())
    edges = np.flatnonzero(np.diff(np.r_[False, steady, False]))
    return [np.arange(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a >= 10]


def recordings(case: str, arrays: Arrays) -> tuple[list[Rows], dict[str, float], tuple[str, ...], tuple[str, ...], str]:
    """Rows, sizes of the signals, names of the recordings that explore and confirm, and what to know of the split.

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
    scale = _scales(arrays, np.concatenate(list(explore.values())))
    rows = [r for name, part in (explore | confirm).items() for r in _rows(name, part, total, arrays, scale)]
    note = f"{total} steady rows in {len(stretches)} operating condition(s); the first {EXPLORE_SHARE:.0%} explore"
    return rows, scale, tuple(explore), tuple(confirm), note


def _rows(name: str, rows: np.ndarray, total: int, arrays: Arrays, scale: Mapping[str, float]) -> list[Rows]:
    pieces = np.array_split(rows, int(np.clip(BLOCKS * rows.size / total, 2, rows.size // 5)))
    columns = dict(
        w=arrays["motor_speed"] * 2 * np.pi / 60, i_d=arrays["i_d"], i_q=arrays["i_q"],
        winding=arrays["stator_winding"] - REFERENCE_TEMPERATURE, magnet=arrays["pm"] - REFERENCE_TEMPERATURE,
    )  # fmt: skip
    inputs = {key: np.array([values[p].mean() for p in pieces]) for key, values in columns.items()}
    inputs["reference"] = np.full(len(pieces), scale["current"])
    time = np.array([p.mean() for p in pieces])
    inputs["elapsed"] = time / arrays["u_d"].size
    beside = {
        "rotor_speed": inputs["w"], "current": np.hypot(inputs["i_d"], inputs["i_q"]), "temperature": inputs["winding"],
        "magnet": inputs["magnet"],
    }  # fmt: skip
    low, high = np.array([(p[0], p[-1]) for p in pieces], float).T
    found = []
    for signal, equation, size in (
        ("u_d", "electrical_d", "voltage"), ("u_q", "electrical_q", "voltage"), ("torque", "torque", "torque"),
    ):  # fmt: skip
        values = arrays[signal]
        own, shared = smooth_error(time, ACCURACY * scale[size], 0.1 * arrays["u_d"].size)
        variance = own + np.array([mean_variance(values[p]) for p in pieces])
        observed = np.array([values[p].mean() for p in pieces])
        labels = [f"mean {signal}"] * len(pieces)
        found.append(Rows(name, equation, "time", low, high, observed, variance, inputs, shared, labels, beside))
    return found


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

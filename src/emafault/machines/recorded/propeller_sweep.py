"""Throttle sweeps of small motors: the full-throttle rows of each, a recording a propeller."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ...errors import InputError
from ..files import read_table, require_finite, to_numbers
from ..statement import Arrays, Distortion, Rows

COLUMNS = ("propeller", "pack", "esc_us", "v_bus_V", "i_bus_A", "speed_rpm")
FULL_THROTTLE = 2000.0  # us, where the duty is one
VOLTAGE_ACCURACY = 0.002  # of the reading: voltage, and speed through k w, as a bench of this class repeats them
CURRENT_ACCURACY = 0.03  # A
LIMIT_BAND = 0.01  # readings this close to the largest current of several propellers are at the supply's limit


def read(path: Path) -> dict[str, Arrays]:
    """Full-throttle rows of each motor of a CSV file, one case per motor.

    Raises
    ------
    InputError
        on a missing column, a value that is not finite, or a motor with too few full-throttle rows.
    """
    table = read_table(path)
    for name in ("motor", *COLUMNS):
        if name not in table:
            raise InputError(f"{path}: column {name!r} is missing; needed are motor, {', '.join(COLUMNS)}")
    columns = {name: to_numbers(table[name]) for name in COLUMNS}
    require_finite(path, columns, COLUMNS, rows=1)
    motors = np.array(table["motor"])
    cases = {}
    for motor in dict.fromkeys(table["motor"]):
        rows = (motors == motor) & (columns["esc_us"] >= FULL_THROTTLE) & (columns["speed_rpm"] > 0)
        if rows.sum() < 6:
            raise InputError(
                f"{path}: motor {motor!r} has {rows.sum()} rows at {FULL_THROTTLE:.0f} us, at least 6 are needed"
            )
        cases[f"motor {motor}"] = {name: values[rows] for name, values in columns.items()}
    return cases


def recordings(case: str, arrays: Arrays) -> tuple[list[Rows], dict[str, float], tuple[str, ...], tuple[str, ...], str]:
    """Rows, sizes of the signals, names of the recordings that explore and confirm, and what to know of the split.

    Raises
    ------
    InputError
        when there is neither a second propeller nor a second pack to hold out.
    """
    along = "propeller" if np.unique(arrays["propeller"]).size > 1 else "pack"
    values = np.unique(arrays[along]).tolist()
    if len(values) < 2:
        raise InputError(f"{case}: one propeller and one pack leave nothing to hold out")
    cut = max(1, round(0.6 * len(values)))
    names = [f"{along} {value:g}" for value in values]
    first = np.isin(arrays[along], values[:cut])
    scale = {
        "voltage": float(arrays["v_bus_V"][first].max()),
        "current": float(arrays["i_bus_A"][first].max()),
        "omega": float(arrays["speed_rpm"][first].max() * 2 * np.pi / 60),
    }
    # a supply shows its limit where several propellers draw the same
    near = arrays["i_bus_A"][first] > (1 - LIMIT_BAND) * scale["current"]
    scale["limit"] = (1 - LIMIT_BAND) * scale["current"] if near.sum() > 2 else np.inf
    rows = [_rows(n, arrays, arrays[along] == value, scale) for n, value in zip(names, values, strict=True)]
    note = f"{arrays['v_bus_V'].size} full-throttle rows; {cut} of {len(values)} {along}s explore"
    return rows, scale, tuple(names[:cut]), tuple(names[cut:]), note


def _rows(name: str, arrays: Arrays, rows: np.ndarray, scale: Mapping[str, float]) -> Rows:
    voltage, current = arrays["v_bus_V"][rows], arrays["i_bus_A"][rows]
    omega = arrays["speed_rpm"][rows] * 2 * np.pi / 60
    at_limit = current > scale["limit"]
    slope = 0.15 * scale["voltage"] / scale["current"]
    inputs = {
        "w": omega, "i": current, "limit": at_limit.astype(float), "i_max": np.full(current.size, scale["current"]),
    }  # fmt: skip
    return Rows(
        name, "electrical", "current", current, current, voltage,
        np.square(VOLTAGE_ACCURACY * voltage) + np.square(CURRENT_ACCURACY * slope), inputs,
        labels=[f"pack {p:g} V" for p in arrays["pack"][rows]], beside={"rotor_speed": omega},
    )  # fmt: skip


def distortions() -> tuple[Distortion, ...]:
    """Known changes of a recording and what rightly names each."""

    def drop(a: Arrays) -> Arrays:
        return a | {"v_bus_V": a["v_bus_V"] + 3.0}

    def commutation(a: Arrays) -> Arrays:
        w = a["speed_rpm"] * 2 * np.pi / 60
        return a | {"v_bus_V": a["v_bus_V"] * (1 + 0.1 * w / w.max() * a["i_bus_A"] / a["i_bus_A"].max())}

    def alternating(a: Arrays) -> Arrays:
        return a | {"speed_rpm": a["speed_rpm"] * (1 + 0.02 * (-1.0) ** a["propeller"])}

    return (
        Distortion("voltage offset +3 V", drop, ("constant_drop", "voltage_offset"), "sensor_voltage"),
        Distortion("voltage rises with speed x current", commutation, ("commutation_loss",), "electrical"),
        Distortion("speed 2 % high and low by propeller", alternating, (), "electrical"),
    )

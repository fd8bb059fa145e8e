"""Logs of a six-step drive on a thrust stand: plateaus of constant duty, reduced to means of their halves."""

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.signal import medfilt

from ...errors import InputError
from ..files import read_table, require_finite, to_numbers
from ..statement import Arrays, Distortion, Rows
from ..statistics import mean_variance, smooth_error

FORMS = {
    "merged": dict(
        t="t_s", duty="duty", v="v_bus_esc_V", i="i_bus_esc_A", w="speed_rad_s", v_second="v_bus_bench_V",
        i_second="i_bus_bench_A", T="torque_bench_Nm",
    ),
    "controller log": dict(t="Timestamp", duty="Duty", v="Batt. Volts", i="Amps", w="RPM"),
    "bench log": dict(
        t="Time (s)", v="Voltage (V)", i="Current (A)", w="Motor Electrical Speed (RPM)", T="Torque (N·m)"
    ),
}  # fmt: skip
UNITS = {
    "t_s": "s", "duty": "1", "v_bus_esc_V": "V", "i_bus_esc_A": "A", "speed_rad_s": "rad/s", "v_bus_bench_V": "V",
    "i_bus_bench_A": "A", "torque_bench_Nm": "N m",
}  # fmt: skip
OPTIONAL = ("v_bus_bench_V", "i_bus_bench_A", "torque_bench_Nm")  # of the merged table: the second instrument
SETTLE = 1.0  # s after a step before a plateau counts as steady
CONTINUOUS_DUTY = 0.25  # below it the phase current is not the bus current over the duty
# of the largest value: how far a simple model of such a drive and its instruments are trusted
ACCURACY = dict(electrical=0.005, torque=0.01, bus=0.01, sensor_voltage=0.003, sensor_current=0.01)
TAU = np.geomspace(3.0, 300.0, 24)  # s, thermal time constants between which the heating is interpolated


def read(path: Path) -> dict[str, Arrays]:
    """One log as one case: the merged table, a controller log or a thrust-stand log, told by its columns.

    Raises
    ------
    InputError
        when the columns are those of none of the three, a value is not finite or there are too few rows.
    """
    table = read_table(path)
    for form, names in FORMS.items():  # noqa: B007
        if all(column in table for column in names.values() if column not in OPTIONAL):
            break
    else:
        needed = "; ".join(f"{form}: {', '.join(names.values())}" for form, names in FORMS.items())
        raise InputError(f"{path}: columns of no known log; needed are those of one of {needed}")
    arrays = {key: to_numbers(table[column]) for key, column in names.items() if column in table}
    if form == "controller log":
        arrays["t"] = _clock(path, table["Timestamp"])
        arrays["duty"] = arrays["duty"] / 100
    if form != "merged":
        arrays["w"] = arrays["w"] * 2 * np.pi / 60
    require_finite(path, arrays, [key for key in arrays if key != "T"], rows=200)
    if "T" in arrays:
        # the torque is written less often than the rest; its sign is that of the mounting
        there = np.flatnonzero(np.isfinite(arrays["T"]))
        if there.size < 50:
            raise InputError(f"{path}: {names['T']!r} has {there.size} finite values, at least 50 are needed")
        arrays["T"] = np.interp(np.arange(arrays["T"].size), there, np.abs(arrays["T"][there]))
    keep = np.r_[True, np.diff(arrays["t"]) > 0] if form == "bench log" else np.ones(arrays["t"].size, bool)
    return {Path(path).name.split(".")[0]: {key: values[keep] for key, values in arrays.items()}}


def _clock(path: Path, stamps: list[str]) -> np.ndarray:
    """Seconds since the first time stamp (ISO date and time, or seconds)."""
    try:
        # some loggers write the milliseconds behind a third colon
        texts = [s.strip().replace(" ", "T") for s in stamps]
        texts = [".".join(s.rsplit(":", 1)) if s.count(":") == 3 else s for s in texts]
        seconds = np.array([np.datetime64(s, "us").astype(float) * 1e-6 for s in texts])
    except ValueError:
        seconds = to_numbers(stamps)
    if not np.isfinite(seconds).all():
        row = int(np.argmax(~np.isfinite(seconds))) + 1
        raise InputError(f"{path}: 'Timestamp' is neither ISO date and time nor seconds in row {row}")
    return seconds - seconds[0]


def plateaus(arrays: Arrays) -> list[slice]:
    """Stretches of constant duty, or of constant speed where the duty is not logged, in time order."""
    t = arrays["t"]
    if "duty" in arrays:
        edges = np.flatnonzero(np.diff(arrays["duty"]) != 0) + 1
    else:
        speed = medfilt(arrays["w"], 2 * (int(0.5 / np.median(np.diff(t))) // 2) + 1)
        grid = np.arange(t[0], t[-1], 0.25)
        level = np.interp(grid, t, speed)
        jump = np.abs(level[4:] - level[:-4]) > 0.02 * speed.max()
        starts = np.flatnonzero(np.diff(np.r_[False, jump, False]))
        edges = np.searchsorted(t, grid[2:][(starts[::2] + starts[1::2]) // 2])
    bounds = np.r_[0, edges, t.size]
    return [slice(a, b) for a, b in pairwise(bounds) if t[b - 1] - t[a] > 2 * SETTLE]


def recordings(case: str, arrays: Arrays) -> tuple[list[Rows], dict[str, float], tuple[str, ...]]:
    """Rows of the first pass and of the return, sizes of the signals, and what to know of the split.

    Raises
    ------
    InputError
        when too few plateaus at speed are found.
    """
    steps = [s for s in plateaus(arrays) if np.median(arrays["w"][s]) > 0.1 * arrays["w"].max()]
    if "duty" in arrays:
        steps = [s for s in steps if arrays["duty"][s.start] >= CONTINUOUS_DUTY - 1e-9]
    if len(steps) < 6:
        raise InputError(f"{case}: {len(steps)} steady plateaus of continuous current, at least 6 are needed")
    top = int(np.argmax([np.median(arrays["w"][s]) for s in steps])) + 1
    cut = top if len(steps) - top >= 1 and top >= 5 else int(0.7 * len(steps))
    first = {key: values[: steps[cut - 1].stop] for key, values in arrays.items()}
    scale = {key: float(np.abs(first[key]).max()) for key in ("v", "i", "w")}
    scale["T"] = float(first["T"].max()) if "T" in arrays else scale["v"] * scale["i"] / scale["w"]
    notes = [f"{cut} plateaus explore, {len(steps) - cut} later ones confirm"]
    if "duty" not in arrays:
        notes.append("no duty in this log: only the power balance is tested, which holds R/k^2 and not R and k")
    rows = _rows("first pass", steps[:cut], arrays, scale) + _rows("return", steps[cut:], arrays, scale)
    return rows, scale, tuple(notes)


def _rows(part: str, steps: list[slice], arrays: Arrays, scale: Mapping[str, float]) -> list[Rows]:
    t, duty = arrays["t"], arrays.get("duty")
    settled = [np.arange(s.start, s.stop)[t[s] > t[s.start] + SETTLE] for s in steps]
    pieces = [piece for rows in settled for piece in np.array_split(rows, 2) if piece.size >= 5]
    edges = [np.arange(s.start, s.stop)[t[s] < t[s.start] + SETTLE] for s in steps]
    phase = arrays["i"] / np.maximum(duty, 0.01) if duty is not None else np.zeros(t.size)
    heat = _heat(t, np.where(arrays["w"] > 0, phase, 0.0) if duty is not None else arrays["i"])
    columns = {
        "i": phase, "bus": arrays["i"], "v": arrays["v"], "D": duty if duty is not None else np.ones(t.size),
        "T": arrays.get("T", np.zeros(t.size)), "t": t,
    }  # fmt: skip
    size = {"electrical": scale["v"], "torque": scale["T"], "bus": scale["v"] * scale["i"]}
    size |= {"sensor_voltage": scale["v"], "sensor_current": scale["i"]}
    found = []
    for equation, values in _signals(arrays).items():
        # only the second instrument's current is watched while it catches up after a step
        rows_of = pieces + (edges if equation == "sensor_current" else [])
        x = {key: np.array([column[rows].mean() for rows in rows_of]) for key, column in columns.items()}
        x["w"] = np.array([np.median(arrays["w"][rows]) for rows in rows_of])
        x["rise"] = np.array([_rise(t, arrays["i"], rows) for rows in rows_of])
        x["heat"] = np.array([heat[:, rows].mean(axis=1) for rows in rows_of]).T
        labels = ["settled"] * len(pieces) + ["after a step"] * (len(rows_of) - len(pieces))
        own, shared = smooth_error(x["bus"], ACCURACY[equation] * size[equation], 0.3 * scale["i"])
        variance = own + np.array([mean_variance(values[rows]) for rows in rows_of])
        observed = np.array([values[rows].mean() for rows in rows_of])
        beside = {"rotor_speed": x["w"], "time": x["t"]}
        found.append(Rows(part, equation, "current", x["bus"], x["bus"], observed, variance, x, shared, labels, beside))
    return found


def _signals(arrays: Arrays) -> Arrays:
    """What is predicted, by equation: whatever this log allows."""
    signals = {}
    if "duty" in arrays:
        signals["electrical"] = arrays["duty"] * arrays["v"]
        if "T" in arrays:
            signals["torque"] = arrays["T"]
    elif "T" in arrays:
        signals["bus"] = arrays["v"] * arrays["i"] - arrays["T"] * medfilt(arrays["w"], 31)
    if "v_second" in arrays:
        signals["sensor_voltage"] = arrays["v_second"]
    if "i_second" in arrays:
        signals["sensor_current"] = arrays["i_second"]
    return signals


def _rise(t: np.ndarray, current: np.ndarray, rows: np.ndarray) -> float:
    """(i(end) - i(just before the window)) / length of the window (A/s)."""
    before, end = max(rows[0] - 8, 0), rows[-1]
    if rows[-1] - rows[0] < 2:
        return 0.0
    return float((current[end - 4 : end + 1].mean() - current[before : before + 5].mean()) / (t[end] - t[rows[0]]))


def _heat(t: np.ndarray, current: np.ndarray) -> np.ndarray:
    """(tau, time) low-passed squared current (A2), one row per time constant of TAU, started cold."""
    grid = np.arange(t[0], t[-1] + 0.25, 0.25)
    squared = np.interp(grid, t, current**2)
    state = np.zeros((TAU.size, grid.size))
    share = -np.expm1(-0.25 / TAU)
    for k in range(1, grid.size):
        state[:, k] = state[:, k - 1] + share * (squared[k] - state[:, k - 1])
    return np.stack([np.interp(t, grid, row) for row in state])


def distortions() -> tuple[Distortion, ...]:
    """Known changes of a recording and what rightly names each."""

    def current_second(a: Arrays) -> Arrays:
        return a | {"i_second": a["i_second"] * 1.5}

    def voltage_second(a: Arrays) -> Arrays:
        return a | {"v_second": a["v_second"] * 1.1}

    def lag(a: Arrays) -> Arrays:
        return a | {"i_second": np.interp(a["t"] - 0.5, a["t"], a["i_second"])}

    def heating(a: Arrays) -> Arrays:
        heat = _heat(a["t"], np.where(a["duty"] > 0, a["i"] / np.maximum(a["duty"], 1e-9), 0.0))[12]
        extra = 0.3 * heat / heat.max() * 0.2 * a["v"].max() / a["i"].max() * a["i"]
        extra = extra / np.maximum(a["duty"], 0.1)
        return a | {"v": a["v"] + extra} | ({"v_second": a["v_second"] + extra} if "v_second" in a else {})

    def wander(a: Arrays) -> Arrays:
        return a | {"T": a["T"] + 0.05 * a["T"].max() * np.sin(2 * np.pi * a["t"] / 17.0)}

    return (
        Distortion("second current +50 %", current_second, ("current_gain_second",), "sensor_current"),
        Distortion(
            "second voltage +10 %", voltage_second, ("voltage_gain_second", "voltage_gain_first"), "sensor_voltage"
        ),
        Distortion("second current 0.5 s later", lag, ("current_lag",), "sensor_current"),
        Distortion("resistance follows the heat", heating, ("self_heating",), "electrical"),
        Distortion("torque wanders", wander, (), "torque"),
    )

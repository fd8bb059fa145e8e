"""A six-step brushless drive with a propeller, seen at its bus by one or two instruments.

Base model at steady speed, i = i_bus / D the phase current while it flows continuously:
    D v = k w + R i          (electrical)
    T   = k i                (torque)
    v_bench = v_esc, i_bench = i_esc   (two instruments of one quantity)
Where the duty is not logged, i = T / k and only the power balance v i_bus - T w = (R / k^2) T^2 is left (bus).
"""

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.linalg import block_diag
from scipy.signal import medfilt

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
    read_table,
    require_finite,
    smooth_covariance,
    to_numbers,
)
from emafault.twins.measured_experiments import Experiment, scaled

NAME = "six_step_bus"
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
        if all(column in table for column in names.values()):
            break
    else:
        needed = "; ".join(f"{form}: {', '.join(names.values())}" for form, names in FORMS.items())
        raise InputError(f"{path}: columns of no known log; needed are those of one of {needed}")
    arrays = {key: to_numbers(table[column]) for key, column in names.items()}
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


def build(case: str, arrays: Arrays) -> MeasuredTwin:
    """Twin of one log: plateaus up to the highest speed explore, those after it (the way back) confirm.

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
    scale = {key: float(np.abs(arrays[key]).max()) for key in ("v", "i", "w")}
    scale["T"] = float(arrays["T"].max()) if "T" in arrays else scale["v"] * scale["i"] / scale["w"]
    parts = {"first pass": steps[:cut], "return": steps[cut:]}
    blocks = {part: _block(part, chosen, arrays, scale) for part, chosen in parts.items()}
    notes = [f"{cut} plateaus explore, {len(steps) - cut} later ones confirm"]
    if "duty" not in arrays:
        notes.append("no duty in this log: only the power balance is tested, which holds R/k^2 and not R and k")
    parameters = _parameters(scale)
    return MeasuredTwin(
        NAME,
        case,
        ("first pass",),
        ("return",),
        blocks,
        parameters,
        library(parameters, _equations(arrays)),
        _model,
        notes=tuple(notes),
    )


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


def _block(part: str, steps: list[slice], arrays: Arrays, scale: Mapping[str, float]) -> Block:
    t, duty = arrays["t"], arrays.get("duty")
    settled = [np.arange(s.start, s.stop)[t[s] > t[s.start] + SETTLE] for s in steps]
    pieces = [piece for rows in settled for piece in np.array_split(rows, 2) if piece.size >= 5]
    edges = [np.arange(s.start, s.stop)[t[s] < t[s.start] + SETTLE] for s in steps]
    phase = arrays["i"] / np.maximum(duty, 0.01) if duty is not None else np.full(t.size, np.nan)
    heat = _heat(t, np.where(arrays["w"] > 0, phase, 0.0) if duty is not None else arrays["i"])
    columns = {
        "i": phase, "bus": arrays["i"], "v": arrays["v"], "D": duty if duty is not None else np.ones(t.size),
        "T": arrays.get("T", np.zeros(t.size)),
    }  # fmt: skip
    size = {"electrical": scale["v"], "torque": scale["T"], "bus": scale["v"] * scale["i"]}
    size |= {"sensor_voltage": scale["v"], "sensor_current": scale["i"]}
    cells: list[Cell] = []
    observed, covariances, tables = [], [], []
    for equation, values in _signals(arrays).items():
        # only the second instrument's current is watched while it catches up after a step
        rows_of = pieces + (edges if equation == "sensor_current" else [])
        table = {key: np.array([column[rows].mean() for rows in rows_of]) for key, column in columns.items()}
        table["w"] = np.array([np.median(arrays["w"][rows]) for rows in rows_of])
        table["rise"] = np.array([_rise(t, arrays["i"], rows) for rows in rows_of])
        table["kind"] = np.full(len(rows_of), list(ACCURACY).index(equation))
        table["heat"] = np.array([heat[:, rows].mean(axis=1) for rows in rows_of]).T
        labels = ["settled"] * len(pieces) + ["after a step"] * (len(rows_of) - len(pieces))
        cells += [Cell(part, equation, "current", i, i, label) for i, label in zip(table["bus"].tolist(), labels)]
        variance = np.array([mean_variance(values[rows]) for rows in rows_of])
        smooth = smooth_covariance(table["bus"], ACCURACY[equation] * size[equation], 0.3 * scale["i"])
        covariances.append(smooth + np.diag(variance))
        observed.append([values[rows].mean() for rows in rows_of])
        tables.append(table)
    inputs = {key: np.concatenate([table[key] for table in tables], axis=-1) for key in tables[0]}
    return Block(cells, np.concatenate(observed), block_diag(*covariances), inputs)


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


def _parameters(scale: Mapping[str, float]) -> tuple[Parameter, ...]:
    k, R, T = scale["v"] / scale["w"], scale["v"] / scale["i"], scale["T"]
    inverse = 1 / scale["i"]
    return (
        nuisance("k", "V s/rad", 0.7 * k, 0.3 * k, low=0.05 * k),
        nuisance("R", "ohm", 0.2 * R, 0.2 * R, low=0.0),
        # all that a power balance holds of R and k
        nuisance("R_k2", "W/(N m)2", 0.4 * R / k**2, 0.4 * R / k**2, low=0.0),
        freedom("self_heating", "heating", "1/A2", 0.4 * inverse**2, 0.0, 3 * inverse**2),
        freedom("self_heating", "log_tau", "1", 1.0, 0.0, float(np.log(TAU[-1] / TAU[0])), mean=2.0, off=2.0),
        freedom("magnet_heating", "weakening", "1/A2", 0.1 * inverse**2, 0.0, inverse**2),
        freedom("magnet_heating", "log_tau_m", "1", 1.0, 0.0, float(np.log(TAU[-1] / TAU[0])), mean=3.0, off=3.0),
        freedom("commutation_loss", "L_commutation", "V s/(rad A)", 0.1 * k * inverse, 0.0, k * inverse),
        freedom("commutation_advance", "advance", "V s/(rad A)", 0.1 * k * inverse, 0.0, k * inverse),
        freedom("constant_drop", "V_drop", "V", 0.05 * scale["v"], 0.0, 0.3 * scale["v"]),
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


def _equations(arrays: Arrays) -> dict[str, tuple[str, ...]]:
    """The effects that this log can show at all, by equation."""
    e, s_v, s_i = "electrical", "sensor_voltage", "sensor_current"
    found: dict[str, tuple[str, ...]] = {"self_heating": (e, "bus")}
    if "duty" in arrays:
        found |= {"magnet_heating": (e, "torque"), "saturation": (e, "torque")}
        found |= dict.fromkeys(("commutation_loss", "commutation_advance", "constant_drop", "freewheel_drop"), (e,))
        found |= {"duty_offset": (e,)}
    if "T" in arrays:
        found |= {"no_load_torque": ("torque", "bus"), "torque_gain": ("torque", "bus")}
    found |= {"voltage_gain_first": (s_v, e), "current_gain_first": (s_i, e, "torque")}
    if "v_second" in arrays:
        found |= {"voltage_gain_second": (s_v,), "lead_resistance": (s_v,)}
    if "i_second" in arrays:
        found |= {"current_gain_second": (s_i,), "current_lag": (s_i,)}
    return found


def _at_tau(heat: np.ndarray, log_tau: np.ndarray) -> np.ndarray:
    """(point, statistic) heating state at log(tau / TAU[0]), linear between the tabulated time constants."""
    position = np.clip(log_tau[:, 0] / np.log(TAU[-1] / TAU[0]), 0, 1) * (TAU.size - 1)
    low = np.minimum(position.astype(int), TAU.size - 2)
    share = (position - low)[:, None]
    return (1 - share) * heat[low] + share * heat[low + 1]


def _model(p: Mapping[str, np.ndarray], block: Block) -> np.ndarray:
    """(point, statistic): D v, torque, second voltage, second current or power balance, as ``kind`` says."""
    x = block.inputs
    w, D, kind = x["w"], x["D"], x["kind"]
    names = list(ACCURACY)
    true_bus = x["bus"] / np.exp(p["log_gain_i"])
    true_v = x["v"] / np.exp(p["log_gain_v"])
    k = p["k"] * (1 - p["weakening"] * _at_tau(x["heat"], p["log_tau_m"]))
    drag = p["T_0"] + p["b"] * w
    i = np.where(np.isfinite(x["i"]), x["i"], 0.0) / np.exp(p["log_gain_i"])
    rise = 1 + p["heating"] * _at_tau(x["heat"], p["log_tau"])
    R = p["R"] * rise
    k = k * (1 - p["saturation"] * i)
    electrical = k * w + R * i + (p["L_commutation"] - p["advance"]) * w * i + p["V_drop"] + (1 - D) * p["V_diode"]
    # the bridge cannot be on for longer than always, whatever its timer adds
    added = np.clip(D + p["duty_offset"], 0, 1) - D
    electrical = electrical * np.exp(p["log_gain_v"]) - added * x["v"]
    torque = np.exp(p["log_gain_T"]) * (k * i - drag)
    second_voltage = np.exp(p["log_gain_v2"]) * (true_v + p["R_lead"] * true_bus)
    second_current = np.exp(p["log_gain_i2"]) * (true_bus - p["lag"] * x["rise"] / np.exp(p["log_gain_i"]))
    # what the instruments call losses: their own power less the torque they show
    true_torque = x["T"] / np.exp(p["log_gain_T"])
    true_power = p["R_k2"] * rise * (true_torque + drag) ** 2 + (true_torque + drag) * w
    bus = true_power * np.exp(p["log_gain_v"]) * np.exp(p["log_gain_i"]) - x["T"] * w
    result = np.where(kind == names.index("electrical"), electrical, 0.0)
    for name, values in (
        ("torque", torque),
        ("bus", bus),
        ("sensor_voltage", second_voltage),
        ("sensor_current", second_current),
    ):
        result = np.where(kind == names.index(name), values, result)
    return result


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

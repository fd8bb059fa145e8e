"""Small brushless motors at full throttle with several propellers and packs, seen at the controller's input.

Base model at duty one, where the bus current is the phase current (R includes controller and leads):
    v_bus = k w + R i
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
    nuisance,
    read_table,
    require_finite,
    to_numbers,
)
from emafault.twins.measured_experiments import Experiment, scaled

NAME = "propeller_sweep"
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


def build(case: str, arrays: Arrays) -> MeasuredTwin:
    """Twin of one motor: the first propellers explore, the others confirm (with one propeller: the packs).

    Raises
    ------
    InputError
        when there is neither a second propeller nor a second pack to hold out.
    """
    along = "propeller" if np.unique(arrays["propeller"]).size > 1 else "pack"
    values = list(dict.fromkeys(arrays[along]))
    if len(values) < 2:
        raise InputError(f"{case}: one propeller and one pack leave nothing to hold out")
    cut = max(1, round(0.6 * len(values)))
    names = {value: f"{along} {value:g}" for value in values}
    scale = {
        "voltage": float(arrays["v_bus_V"].max()),
        "current": float(arrays["i_bus_A"].max()),
        "omega": float(arrays["speed_rpm"].max() * 2 * np.pi / 60),
    }
    blocks = {names[value]: _block(names[value], arrays, arrays[along] == value, scale) for value in values}
    parameters = _parameters(scale)
    return MeasuredTwin(
        NAME, case, tuple(names[v] for v in values[:cut]), tuple(names[v] for v in values[cut:]), blocks,
        parameters, library(parameters, _equations()), _model,
        notes=(
            f"{arrays['v_bus_V'].size} full-throttle rows; {cut} of {len(values)} {along}s explore",
            "a voltage gain is a k gain and a current gain an R gain: no row of these sweeps tells them apart",
        ),
    )  # fmt: skip


def _block(name: str, arrays: Arrays, rows: np.ndarray, scale: Mapping[str, float]) -> Block:
    voltage, current = arrays["v_bus_V"][rows], arrays["i_bus_A"][rows]
    omega = arrays["speed_rpm"][rows] * 2 * np.pi / 60
    at_limit = (current > (1 - LIMIT_BAND) * scale["current"]) & (
        (arrays["i_bus_A"] > (1 - LIMIT_BAND) * scale["current"]).sum() > 2
    )
    cells = [
        Cell(name, "electrical", "current", float(i), float(i), f"pack {p:g} V")
        for i, p in zip(current, arrays["pack"][rows])
    ]
    slope = 0.15 * scale["voltage"] / scale["current"]
    deviation = np.hypot(VOLTAGE_ACCURACY * voltage, CURRENT_ACCURACY * slope)
    inputs = {
        "w": omega,
        "i": current,
        "limit": at_limit.astype(float),
        "i_max": np.full(current.size, scale["current"]),
    }
    return Block(cells, voltage, np.diag(deviation**2), inputs)


def _parameters(scale: Mapping[str, float]) -> tuple[Parameter, ...]:
    k, R = scale["voltage"] / scale["omega"], scale["voltage"] / scale["current"]
    inverse, volt, ampere = 1 / scale["current"], scale["voltage"], scale["current"]
    return (
        nuisance("k", "V s/rad", 0.8 * k, 0.4 * k, low=0.0),
        nuisance("R", "ohm", 0.15 * R, 0.15 * R, low=0.0),
        freedom("self_heating", "heating", "1/A2", 0.3 * inverse**2, 0.0, 2 * inverse**2),
        freedom("magnet_heating", "weakening", "1/A2", 0.1 * inverse**2, 0.0, inverse**2),
        freedom("commutation_loss", "L_commutation", "V s/(rad A)", 0.1 * k * inverse, 0.0, k * inverse),
        freedom("constant_drop", "V_drop", "V", 0.05 * scale["voltage"], 0.0, 0.3 * scale["voltage"]),
        freedom("voltage_offset", "V_offset", "V", 0.02 * volt, -0.2 * volt, 0.2 * volt),
        freedom("supply_limit", "V_limit", "V", 0.02 * volt, -0.2 * volt, 0.2 * volt),
        freedom("voltage_gain", "gain_v", "1", 0.05, -0.3, 0.3),
        freedom("current_gain", "gain_i", "1", 0.1, -0.5, 0.5),
        freedom("current_offset", "i_offset", "A", 0.02 * ampere, -0.2 * ampere, 0.2 * ampere),
    )  # fmt: skip


def _equations() -> dict[str, tuple[str, ...]]:
    electrical = ("self_heating", "magnet_heating", "commutation_loss", "constant_drop")
    found: dict[str, tuple[str, ...]] = {effect: ("electrical",) for effect in electrical}
    found |= {"voltage_offset": ("sensor_voltage",), "supply_limit": ("bus",), "voltage_gain": ("sensor_voltage",)}
    return found | {"current_gain": ("sensor_current",), "current_offset": ("sensor_current",)}


def _model(p: Mapping[str, np.ndarray], block: Block) -> np.ndarray:
    """(point, statistic): bus voltage of each full-throttle row; heating is that of a steady copper loss."""
    x = block.inputs
    w, i = x["w"], (x["i"] - p["i_offset"]) / (1 + p["gain_i"])
    heat = i**2 - 0.5 * x["i_max"] ** 2  # stated at half the largest loss, so that R and k keep their meaning
    voltage = p["k"] * (1 - p["weakening"] * heat) * w + p["R"] * (1 + p["heating"] * heat) * i
    voltage = voltage + p["L_commutation"] * w * i + p["V_drop"]
    return voltage * (1 + p["gain_v"]) + p["V_offset"] + p["V_limit"] * x["limit"]


def experiments() -> tuple[Experiment, ...]:
    """Loads that take apart speed and current, which a propeller ties together."""
    return (
        scaled("full throttle without propeller", i=0.1),
        scaled("full throttle with half the load at the same speed", i=0.5),
        scaled("the same currents at a third of the voltage, with a larger propeller", w=1.0 / 3.0),
        scaled("the same currents with the rotor locked", w=0.0),
    )


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

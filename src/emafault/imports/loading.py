"""From the files and the map to signals in the recording format's units, nothing yet found from the data."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..errors import InputError
from ..io.recording import VARIABLES
from ..schema import near
from ..units import factor, quantity
from .hall import angle_of_halls
from .mapping import PHASED
from .readers import read_raw
from .signal import Signal


@dataclass
class Raw:
    """Signals of one recording: three a phased name, None where a phase was not measured."""

    name: str
    entry: Mapping[str, Any]
    single: dict[str, Signal]
    phased: dict[str, list[Signal | None]]
    lost: list[str] = field(default_factory=list)  # what cannot be told without what was not measured
    off: np.ndarray | None = None  # (sample, 3) bool, of duties: a leg that is off
    zero_error: float = 0.0  # standard error of the angle's zero (electrical rad), where the voltages gave it

    def signals(self) -> list[Signal]:
        """All that there are."""
        return [*self.single.values(), *(s for three in self.phased.values() for s in three if s is not None)]

    def change(self, change) -> None:
        """Replace every signal by what ``change`` makes of it."""
        self.single = {k: change(s) for k, s in self.single.items()}
        self.phased = {k: [None if s is None else change(s) for s in three] for k, three in self.phased.items()}


def load(given: Mapping[str, Any], pole_pairs: int) -> list[Raw]:
    """Signals of every recording of a map.

    Raises
    ------
    InputError : a file, channel, unit or time base that cannot be used
    """
    return [_load_one(given, entry, pole_pairs) for entry in given["recordings"]]


def _load_one(given: Mapping[str, Any], entry: Mapping[str, Any], pole_pairs: int) -> Raw:
    files = {logger: read_raw(path) for logger, path in entry["files"].items()}
    raw = Raw(entry["name"], entry, {}, {})

    def channel(name: str, wanted: str, spec: Mapping[str, Any], averaged: bool, title: str) -> Signal:
        logger = spec["logger"]
        path, found = channel_of(entry, files, logger, name, title)
        settings = given["loggers"][logger]
        values, time = found[name].to_numpy(), time_of(path, found, name, settings)
        unit = spec.get("unit", found[name].attrs.get("units", ""))
        counts = spec.get("counts_per_turn")
        known = bool(counts or unit or wanted == "1")
        if not known and title != "rotor_speed":  # of which the unit is found, beside the angle
            raise InputError(f"{path}: '{name}' has no unit; say signals.{title}.unit in the map, as {wanted}")
        one = 2.0 * np.pi / counts if counts is not None else factor(unit or wanted, wanted, f"{path}: '{name}'")
        averaged = averaged and settings["samples"] == "means"
        if averaged and settings["stamp"] != "end":
            time = time + np.median(np.diff(time)) * {"start": 1.0, "middle": 0.5}[settings["stamp"]]
        offset = spec.get("offset", 0.0)
        zero = offset * one if isinstance(offset, int | float) else quantity(offset, wanted, f"signals.{title}.offset")
        return Signal(time, values * one, averaged, logger, title, known).scaled(1.0, zero)

    for name, spec in given["signals"].items():
        wanted = VARIABLES[name][1]
        if name in PHASED:
            wanted = "1" if spec.get("reference") == "duty" else wanted
            averaged = name != "phase_current_end"
            factors = [_nth(spec.get("scale", 1.0), k) * _nth(spec.get("sign", 1), k) for k in range(3)]
            three = [
                None if c is None else channel(c, wanted, spec, averaged, name).scaled(f)
                for c, f in zip(spec["channels"], factors)
            ]
            raw.phased[name] = [three[spec.get("order", "abc").index(letter)] for letter in "abc"]
        elif "hall" in spec:
            halls = [channel(c, "1", spec | {"unit": "1"}, False, name) for c in spec["hall"]]
            raw.single[name] = angle_of_halls(raw.name, halls, pole_pairs)
            raw.lost.append(
                "rotor_angle is interpolated between hall edges: what turns with the rotor (cogging, eccentricity, "
                "an angle's ripple) cannot be detected"
            )
        else:
            signal = channel(spec["channel"], wanted, spec, name in ("rotor_speed", "bus_voltage"), name)
            raw.single[name] = signal.scaled(spec.get("scale", 1.0) * spec.get("sign", 1))
    if "hall" not in given["signals"]["rotor_angle"]:
        raw.single["rotor_angle"] = _unwrapped(raw.single["rotor_angle"], given["signals"]["rotor_angle"], pole_pairs)
    return raw


def _nth(value, k: int):
    return value[k] if isinstance(value, list) else value


def channel_of(entry: Mapping[str, Any], files: Mapping[str, Any], logger: str, name: str, title: str):
    """Path and dataset of the logger's file of a recording, which holds the channel ``name`` of the signal ``title``.

    Raises
    ------
    InputError : the logger has no file, or the file no such channel
    """
    if logger not in files:
        raise InputError(f"{entry['name']}: {title} is of the logger {logger}, which has no file here; add it to files")
    path, found = entry["files"][logger], files[logger]
    if name not in found.data_vars:
        channels = [str(n) for n in found.data_vars]
        raise InputError(f"{path}: no channel '{name}'{near(name, channels)}; there are {', '.join(channels)}")
    return path, found


def time_of(path: str, found, name: str, settings: Mapping[str, Any], repeated: bool = False) -> np.ndarray:
    """Times (s) of a channel, from its first sample on where they are counted.

    Parameters
    ----------
    repeated : whether a time may stand twice, as clocks of coarse resolution write it

    Raises
    ------
    InputError : there are none, or they go back
    """
    count = found[name].size
    if "rate" in settings:
        return np.arange(1, count + 1) / quantity(settings["rate"], "Hz", "rate")
    axis = found[name].dims[0]
    if "time" in settings and settings["time"] in found and found[settings["time"]].size == count:
        source = found[settings["time"]]
        time = source.to_numpy() * factor(source.attrs["units"] or "s", "s", settings["time"])
    elif axis in found.coords:
        time = found[axis].to_numpy()
    else:
        raise InputError(f"{path}: '{name}' has no times; say loggers.<name>.rate, or .time for their channel")
    steps = np.diff(time)
    if count < 2 or not np.all(np.isfinite(time)) or np.any(steps < 0.0 if repeated else steps <= 0.0):
        raise InputError(f"{path}: the times of '{name}' do not increase everywhere; export it anew, or say the rate")
    return time


def _unwrapped(angle: Signal, spec: Mapping[str, Any], pole_pairs: int) -> Signal:
    """Unwrapped angle, mechanical also where the channel is electrical."""
    if "wraps_at" in spec:
        one = (
            2.0 * np.pi / spec["counts_per_turn"]
            if "counts_per_turn" in spec
            else factor(spec.get("unit", "rad"), "rad", "")
        )
        period = spec["wraps_at"] * one
    else:
        period = 2.0 * np.pi
    values = angle.values
    if np.ptp(values) <= period * 1.01:
        values = np.unwrap(values, period=period)
    ratio = 1.0 / pole_pairs if spec.get("source") == "electrical" else 1.0
    return Signal(angle.time, values * ratio, False, angle.logger, angle.name)

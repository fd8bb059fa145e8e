"""From files and a map to the tables that the twin of a measured machine reads."""

import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..io.atomic import replace_atomically
from ..machines.files import write_columns
from ..machines.library import MAPPABLE, Stated, read_cases, stated
from ..machines.statement import Arrays
from ..places import refuse_folder, refuse_output
from ..schema import unknown_key
from ..units import converted, factor, quantity
from .loading import channel_of, time_of
from .readers import read_raw


def import_tables(given: Mapping[str, Any], path: str | Path, out: str | Path, force: bool = False) -> dict[str, list]:
    """Write the table of every recording of a map, in the form that the twin reads; file name -> what was done to rows.

    Parameters
    ----------
    given : map of ``read_map`` that names a machine
    path : of the map, which messages begin with
    force : whether files of these names are replaced

    Raises
    ------
    InputError : in one line, a map, channel or unit that cannot be used, or a table that the twin refuses
    """
    machine = stated(given["machine"], f"{path}: machine")
    _refuse_columns(given, path, machine)
    refuse_folder(out, "--out")
    names = {entry["name"]: f"{entry['name']}{machine.ending}" for entry in given["recordings"]}
    read = [path, *(file for entry in given["recordings"] for file in entry["files"].values())]
    for name in names.values():
        refuse_output(Path(out) / name, "--out", read=read, force=force)
    notes = {}
    with tempfile.TemporaryDirectory() as folder:
        for entry in given["recordings"]:
            table, notes[names[entry["name"]]] = table_of(given, entry, machine.units)
            write_columns(Path(folder) / names[entry["name"]], table)
        for name in names.values():
            try:
                read_cases(machine, Path(folder) / name)
            except InputError as error:
                raise InputError(str(error).replace(f"{folder}/", "")) from error
        for name in names.values():
            replace_atomically(Path(out) / name, lambda half: shutil.copyfile(Path(folder) / name, half))  # noqa: B023
    return notes


def _refuse_columns(given: Mapping[str, Any], path: str | Path, machine: Stated) -> None:
    if not machine.units:
        raise InputError(
            f"{path}: machine: {machine.name} states no units of columns; accepted are {', '.join(MAPPABLE)} and a "
            "Python file with UNITS = {column: unit}"
        )
    for name in given["signals"]:
        if name not in machine.units:
            raise InputError(unknown_key(name, f"{path}: signals", machine.units))
    needed = [name for name in machine.units if name not in machine.optional]
    for name in needed:
        if name not in given["signals"]:
            raise InputError(f"{path}: signals: {name!r} is missing; {machine.name} needs {', '.join(needed)}")


def table_of(given: Mapping[str, Any], entry: Mapping[str, Any], units: Mapping[str, str]) -> tuple[Arrays, list[str]]:
    """Columns in these units, (row,) or of a stated value (), and what was done to rows.

    Rows are the samples of the first logger's first signal. What was sampled at other times is interpolated there; rows
    beyond any signal are left out.

    Raises
    ------
    InputError : a file, channel, unit or time base that cannot be used
    """
    files = {logger: read_raw(path) for logger, path in entry["files"].items()}
    signals, first = given["signals"], next(iter(given["loggers"]))
    measured = {k: _channel(given, entry, files, k, units[k]) for k, spec in signals.items() if "channel" in spec}
    ours = [k for k in measured if signals[k]["logger"] == first]
    if not ours:
        raise InputError(f"{entry['name']}: no signal is of {first}, the first logger, whose samples are the rows")
    rows, values = measured[ours[0]]
    keep, between = np.ones(values.size, bool), []
    columns: Arrays = {}
    for name, spec in signals.items():
        if "value" in spec:
            columns[name] = np.array(quantity(spec["value"], units[name], f"signals.{name}.value"))
        elif "time" in spec:
            columns[name] = _timed(entry, rows, f"signals.{name}.time") * factor("s", units[name], f"signals.{name}")
        else:
            time, values = measured[name]
            if time is None and rows is None and spec["logger"] == first and values.size == keep.size:
                columns[name] = values
                continue
            at = _timed(entry, rows, f"signals.{ours[0]}")
            time = _timed(entry, time, f"signals.{name}")
            if np.array_equal(at, time):
                columns[name] = values
                continue
            known = np.isfinite(values)
            time, values = time[known], values[known]
            if not values.size:
                raise InputError(f"{entry['name']}: signals.{name}: its channel holds no number")
            columns[name] = np.interp(at, time, values)
            keep &= (at >= time[0]) & (at <= time[-1])
            between.append(name)
    notes = [f"{', '.join(between)}: interpolated at the samples of {ours[0]}"] if between else []
    if not keep.all():
        notes.append(f"{np.sum(~keep)} of {keep.size} rows left out, where one of the logs has no samples")
    if "segment" in entry:
        begin, end = (quantity(x, "s", f"recordings.{entry['name']}.segment") for x in entry["segment"])
        at = _timed(entry, rows, "segment")
        keep &= (at >= begin) & (at <= end)
    if not keep.any():
        raise InputError(f"{entry['name']}: no time is in all logs and the segment; look at clock.skew and segment")
    return {name: values[keep] if values.ndim else values for name, values in columns.items()}, notes


def _timed(entry: Mapping[str, Any], time: np.ndarray | None, what: str) -> np.ndarray:
    if time is None:
        raise InputError(
            f"{entry['name']}: {what}: there are no times; say loggers.<name>.rate, or .time, their channel"
        )
    return time


def _channel(
    given: Mapping[str, Any], entry: Mapping[str, Any], files: Mapping[str, Any], name: str, wanted: str
) -> tuple[np.ndarray | None, np.ndarray]:
    """Times (s) on the first logger's clock, None where the file has none, and values in the unit wanted."""
    spec, key = given["signals"][name], f"signals.{name}"
    path, found = channel_of(entry, files, spec["logger"], spec["channel"], name)
    unit = spec.get("unit", found[spec["channel"]].attrs.get("units", ""))
    if not unit and wanted != "1":
        raise InputError(f"{path}: '{spec['channel']}' has no unit; say {key}.unit in the map, as {wanted}")
    unit, offset = unit or wanted, spec.get("offset", 0.0)
    zero = offset if isinstance(offset, int | float) else quantity(offset, unit, f"{key}.offset")
    values = found[spec["channel"]].to_numpy() - zero
    values = spec.get("sign", 1) * spec.get("scale", 1.0) * values
    values = converted(values, unit, wanted, f"{path}: '{spec['channel']}' for {key}")
    settings, clock = given["loggers"][spec["logger"]], given["loggers"][spec["logger"]]["clock"]
    if not (settings.keys() & {"rate", "time"} or found[spec["channel"]].dims[0] in found.coords):
        return None, values
    time = time_of(path, found, spec["channel"], settings, repeated=True)
    if clock != "same" and spec["logger"] != next(iter(given["loggers"])):
        skew = quantity(clock["skew"], "s", f"loggers.{spec['logger']}.clock.skew")
        time = time * (1.0 + clock.get("drift", 0.0)) + skew
    return time, values

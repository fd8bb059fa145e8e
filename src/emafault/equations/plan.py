"""What to record next on a bench, with the commanded motions as files."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .. import schema
from ..actuator.commands import COMMANDS, command_positions
from ..errors import InputError, shown
from ..io.atomic import write_text
from ..io.bench import bench_name
from ..paths import results_folder
from ..places import file_name, refuse_folder, refuse_irregular
from ..plain import read_json
from .run import diagnosed, read_within
from .sentences import decides, separated

HEADER = "time_s,position_rad"
PLAYED = 1e-3  # s between two positions of a motion


def plan(path: str | Path, spec: Mapping[str, Any], out: str | Path | None = None, force: bool = True) -> list[Path]:
    """Print what to record next and write the motions.

    Parameters
    ----------
    path : a folder of recordings, which is diagnosed, or the verdict of a diagnosis
    spec : ``actuator`` and ``sensors`` of a composed configuration
    out : folder for the motions; None takes ``results/plans/<name of the bench>``
    force : whether files that stand where motions are to be written, and are none, may be replaced

    Returns
    -------
    files with lines of time (s) and position of the user shaft (rad)

    Raises
    ------
    InputError : recordings or a verdict that cannot be used, or a folder that cannot be written
    """
    read = read_verdict(path) if str(path).endswith(".json") else None
    name = read["bench"] if read else bench_name(path)
    folder = Path(out) if out is not None else results_folder() / "plans" / file_name(name)
    _refuse_foreign(folder, force)  # before the work, not after it
    entries = (read or _diagnosed(path, spec))["next_experiment"]
    written = write_motions(entries, folder)
    for n, line in enumerate(sentences(entries)):
        print(f"{line} ({written[n]})" if n < len(written) else line)
    return written


def sentences(entries: Sequence[Mapping[str, Any]]) -> list[str]:
    """What to record next, a line each, numbered; one line that says so where there is nothing."""
    if not entries:
        return ["Nothing to record: no other explanation of these recordings is left."]
    told, idle = [e for e in entries if decides(e)], [e for e in entries if not decides(e)]
    return [
        f"{n}. {entry['command']}, ambient temperature {entry['ambient_temperature']:g} degC: distinguishes "
        f"{separated(entry['separates'])}, expected Bayes factor {entry['expected_odds']:.3g}"
        for n, entry in enumerate(told, start=1)
    ] + [f"No recording of the menu distinguishes {separated(entry['separates'])}" for entry in idle]


def write_motions(entries: Sequence[Mapping[str, Any]], folder: str | Path, force: bool = True) -> list[Path]:
    """Write the motion of every entry that is expected to distinguish anything, as a table of time (s) and position
    (rad).

    Raises
    ------
    InputError : a folder that cannot be written, or, without ``force``, that holds something else
    """
    _refuse_foreign(Path(folder), force)
    written = []
    for n, entry in enumerate(filter(decides, entries), start=1):
        target = Path(folder) / f"{n}_{entry['motion']['name']}.csv"
        write_text(target, _as_text(motion_of(entry)))
        written.append(target)
    return written


def _diagnosed(path: str | Path, spec: Mapping[str, Any]) -> dict[str, Any]:
    found = diagnosed(read_within(path, spec), spec)
    return found.verdict | {"next_experiment": found.next_experiments()}


def read_verdict(path: str | Path) -> dict[str, Any]:
    """The ``diagnosis.json`` of a bench of the actuator, with what to record next checked.

    Raises
    ------
    InputError : another file, or entries that are not as a diagnosis writes them
    """
    verdict = read_json(path)
    if not isinstance(verdict, dict) or verdict.get("twin") != "actuator":
        raise InputError(f"{shown(path)}: accepted is the diagnosis.json of a bench of the actuator")
    entries = verdict.get("next_experiment")
    if not isinstance(entries, list) or not all(isinstance(e, dict) and "motion" in e for e in entries):
        raise InputError(f"{shown(path)}: its next_experiment has no motions, diagnose the bench once more")
    try:
        schema.check(verdict.get("bench"), str, "bench")
        for n, entry in enumerate(entries):
            _check_entry(entry, f"next_experiment[{n}]")
    except InputError as error:
        raise InputError(f"{shown(path)}: {error}") from None
    return verdict


def _check_entry(entry: Mapping[str, Any], key: str) -> None:
    """Refuse what to record next where it is not as a diagnosis writes it."""
    motion = entry["motion"]
    schema.check(motion, dict[str, Any], f"{key}.motion")
    schema.check(motion.get("name"), str, f"{key}.motion.name", {"accepted": tuple(COMMANDS)})
    schema.check(motion.get("settings"), dict[str, float], f"{key}.motion.settings")
    settings = {"name": motion["name"], **motion["settings"]}
    schema.check(settings, schema.COMMANDS[motion["name"]], f"{key}.motion.settings")
    schema.check(motion.get("duration"), float, f"{key}.motion.duration", {"low": 0.0, "high": 3600.0, "unit": "s"})
    schema.check(entry.get("command"), str, f"{key}.command")
    schema.check(entry.get("separates"), list[str], f"{key}.separates")
    for word in ("ambient_temperature", "expected_odds"):
        schema.check(entry.get(word), float, f"{key}.{word}")


def _refuse_foreign(folder: Path, force: bool) -> None:
    """Refuse a folder that cannot be written, or where something else has the name of a motion."""
    refuse_folder(folder, "--out")
    for path in folder.glob("[1-9]_*.csv"):
        refuse_irregular(path, "--out")
        with path.open("rb") as file:
            if not force and file.readline() != f"{HEADER}\n".encode():
                raise InputError(f"--out: {shown(path)}: is no motion, --force replaces it")


def motion_of(entry: Mapping[str, Any]) -> np.ndarray:
    """(time, 2) time (s) and commanded position of the user shaft (rad) of what to record next."""
    motion = entry["motion"]
    position = command_positions(motion["name"], motion["settings"], motion["duration"], PLAYED)
    time = PLAYED * np.arange(round(motion["duration"] / PLAYED) + 1)
    length = min(len(time), len(position))
    return np.column_stack([time[:length], position[:length]])


def _as_text(motion: np.ndarray) -> str:
    return "\n".join([HEADER, *(f"{t:.6g},{x:.9g}" for t, x in motion)]) + "\n"

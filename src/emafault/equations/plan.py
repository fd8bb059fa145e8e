"""What to record next on a bench, with the commanded motions as files."""

from collections.abc import Mapping
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
from .page import separated
from .run import diagnosed

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
    read = _read(Path(path)) if str(path).endswith(".json") else None
    name = read["bench"] if read else bench_name(path)
    folder = Path(out) if out is not None else results_folder() / "plans" / file_name(name)
    _refuse_foreign(folder, force)  # before the work, not after it
    verdict = read or _diagnosed(path, spec)
    written = []
    for n, entry in enumerate(verdict["next_experiment"], start=1):
        target = folder / f"{n}_{entry['motion']['name']}.csv"
        write_text(target, _motion(entry["motion"]))
        written.append(target)
        print(
            f"{n}. {entry['command']}, ambient temperature {entry['ambient_temperature']:g} degC: distinguishes "
            f"{separated(entry['separates'])}, expected Bayes factor {entry['expected_odds']:.3g} ({target})"
        )
    if not written:
        print("Nothing to record: no other reading of these recordings is left.")
    return written


def _diagnosed(path: str | Path, spec: Mapping[str, Any]) -> dict[str, Any]:
    _, found = diagnosed(path, spec)
    return found.verdict | {"next_experiment": found.next_experiments()}


def _read(path: Path) -> dict[str, Any]:
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


def _motion(motion: Mapping[str, Any]) -> str:
    position = command_positions(motion["name"], motion["settings"], motion["duration"], PLAYED)
    time = PLAYED * np.arange(round(motion["duration"] / PLAYED) + 1)
    lines = [f"{t:.6g},{x:.9g}" for t, x in zip(time, position, strict=False)]
    return "\n".join([HEADER, *lines]) + "\n"

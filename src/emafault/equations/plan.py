"""What to record next on a bench, with the commanded motions as files."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..actuator.commands import command_positions
from ..errors import InputError
from ..io.atomic import write_text
from ..paths import results_folder
from .page import separated
from .run import diagnosed

PLAYED = 1e-3  # s between two positions of a motion


def plan(path: str | Path, spec: Mapping[str, Any], out: str | Path | None = None) -> list[Path]:
    """Print what to record next and write the motions.

    Parameters
    ----------
    path : a folder of recordings, which is diagnosed, or the verdict of a diagnosis
    spec : ``actuator`` and ``sensors`` of a composed configuration
    out : folder for the motions; None takes ``results/plans/<name of the bench>``

    Returns
    -------
    files with lines of time (s) and position of the user shaft (rad)

    Raises
    ------
    InputError : recordings or a verdict that cannot be used
    """
    verdict = _read(Path(path)) if str(path).endswith(".json") else _diagnosed(path, spec)
    folder = Path(out) if out is not None else results_folder() / "plans" / verdict["bench"]
    written = []
    for n, entry in enumerate(verdict["next_experiment"], start=1):
        target = folder / f"{n}_{entry['motion']['name']}.csv"
        write_text(target, _motion(entry["motion"]))
        written.append(target)
        print(
            f"{n}. {entry['command']}, soaked at {entry['ambient_temperature']:g} degC: tells "
            f"{separated(entry['separates'])}, with odds of {entry['expected_odds']:.3g} ({target})"
        )
    if not written:
        print("Nothing to record: no other reading of these recordings is left.")
    return written


def _diagnosed(path: str | Path, spec: Mapping[str, Any]) -> dict[str, Any]:
    _, found = diagnosed(path, spec)
    return found.verdict | {"next_experiment": found.next_experiments()}


def _read(path: Path) -> dict[str, Any]:
    try:
        verdict = json.loads(path.read_text())
    except OSError:
        raise InputError(f"{path}: no such file") from None
    except ValueError:
        raise InputError(f"{path}: not JSON, accepted is the diagnosis.json of a bench") from None
    if not isinstance(verdict, dict) or verdict.get("twin") != "actuator":
        raise InputError(f"{path}: accepted is the diagnosis.json of a bench of the actuator")
    entries = verdict.get("next_experiment")
    if not isinstance(entries, list) or not all(isinstance(e, dict) and "motion" in e for e in entries):
        raise InputError(f"{path}: its next_experiment has no motions, diagnose the bench once more")
    return verdict


def _motion(motion: Mapping[str, Any]) -> str:
    position = command_positions(motion["name"], motion["settings"], motion["duration"], PLAYED)
    time = PLAYED * np.arange(round(motion["duration"] / PLAYED) + 1)
    lines = [f"{t:.6g},{x:.9g}" for t, x in zip(time, position, strict=False)]
    return "\n".join(["time_s,position_rad", *lines]) + "\n"

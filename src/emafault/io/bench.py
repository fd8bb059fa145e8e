"""A bench: a folder of recordings of one actuator, read and checked.

A file that is not in the format, recordings of two units and sensors that belong to other channels refuse the bench. A
recording that is whole but useless (it stands still, a channel clips, it is sampled too slowly) is set aside with a
warning, and the bench is refused only if none is left.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..errors import InputError, shown
from ..places import kind, refuse_folder
from .joined import joined
from .motion import calm_motion
from .recording import Recording, read_recording, recordings_in
from .rows import filled, without_rows_twice
from .sensors import refuse_mistaken, useless

COARSE = np.pi / 6  # electrical rad from sample to sample: two samples in a commutation sector


@dataclass(frozen=True)
class Bench:
    """Recordings by file name, and warnings: what was set aside and what these recordings cannot tell."""

    name: str
    recordings: dict[str, Recording]
    warnings: list[dict]


def read_bench(path: str | Path, actuator: ActuatorParameters) -> Bench:
    """Read and check a folder of recordings, or a single one.

    Raises
    ------
    InputError : naming the file, the variable and the rule broken
    """
    files = recordings_in([path])
    recordings = {file.name: read_recording(file) for file in files}
    return check_bench(bench_name(path), recordings, actuator, {f.name: shown(f) for f in files})


def bench_name(path: str | Path) -> str:
    """Name of the bench in a folder or file.

    Raises
    ------
    InputError : a path that no file can have
    """
    return Path(path).resolve().name if kind(path) == "folder" else Path(path).stem


def check_bench(
    name: str,
    recordings: Mapping[str, Recording],
    actuator: ActuatorParameters,
    paths: Mapping[str, str] | None = None,
) -> Bench:
    """Check recordings that have been read; ``paths`` gives how messages name them.

    Raises
    ------
    InputError : recordings of two units, sensors that belong to other channels, or no recording that can be used
    """
    shown = paths or {n: n for n in recordings}
    units: dict[str, str] = {}
    for n, recording in recordings.items():
        unit = recording.attributes.get("unit", "")
        if unit not in ("", "unknown"):
            units.setdefault(unit, n)
    if len(units) > 1:
        (one, first), (other, second) = list(units.items())[:2]
        raise InputError(
            f"{shown[second]}: unit is '{other}', that of {first} is '{one}'; a bench holds recordings of one unit"
        )
    kept: dict[str, Recording] = {}
    warnings: list[dict] = []
    for n, recording in recordings.items():
        refuse_mistaken(shown[n], recording, actuator)
        recording, twice = without_rows_twice(recording)
        recording, missing = filled(recording)
        recording, period = joined(recording)
        copy = next((o for o, other in kept.items() if _same(recording, other)), None)
        found = (("time", f"holds the same data as {copy}"),) if copy else tuple(useless(recording, actuator))
        if found:
            variable, rule = found[0]
            warnings.append(_warning("set aside", f"{n}: {variable} {rule}; the recording is set aside", n, variable))
            continue
        kept[n] = recording
        if twice:
            message = (
                f"{n}: {twice} rows repeat the one before in all channels while the rotor turns; they are left out"
            )
            warnings.append(_warning("samples", message, n, "time"))
        if missing:
            places = f"in {len(missing)} places" if len(missing) > 1 else "in one place"
            message = (
                f"{n}: {sum(missing.values())} rows are missing {places}, where angle and command go on by several "
                "intervals; the row before is taken in their place, and left out"
            )
            warnings.append(_warning("samples", message, n, "time"))
        if period > 1:
            message = (
                f"{n}: rotor_angle is new in one sample of {period} only; intervals are joined to "
                f"{1e3 * recording.interval:.3g} ms"
            )
            warnings.append(_warning("samples", message, n, "rotor_angle"))
    if not kept:
        first = next(iter(recordings))
        rule = warnings[0]["message"].removeprefix(f"{first}: ").removesuffix("; the recording is set aside")
        none_left = "; no recording of the bench can be used" if len(recordings) > 1 else ""
        raise InputError(f"{shown[first]}: {rule}{none_left}")
    return Bench(name, kept, warnings + limits(kept, actuator))


def _warning(kind: str, message: str, file: str | None = None, variable: str | None = None) -> dict:
    return {"kind": kind, "file": file, "variable": variable, "message": message}


def _same(one: Recording, other: Recording) -> bool:
    return len(one.time) == len(other.time) and np.array_equal(one.phase_voltage, other.phase_voltage)


def new_folder(bench: str | Path, folder: str | Path, option: str) -> Path:
    """The folder, if recordings made of a bench's may be written there; ``option`` is the word that names it.

    Raises
    ------
    InputError : it is the bench's own, holds files already, or cannot be written
    """
    folder = Path(folder)
    kind(folder, option)
    if (
        folder.resolve() == Path(bench).resolve()
        or (folder.exists() and not folder.is_dir())
        or (folder.is_dir() and any(folder.iterdir()))
    ):
        raise InputError(f"{option}: '{folder}' holds files already, accepted is a new folder")
    refuse_folder(folder, option)
    return folder


# --- what these recordings cannot tell -------------------------------------------------------------------------------


def limits(recordings: Mapping[str, Recording], actuator: ActuatorParameters) -> list[dict]:
    """Warnings that limit what can be claimed."""
    recordings = {n: calm_motion(r) for n, r in recordings.items()}
    out = []

    def say(message: str, file: str | None = None, variable: str | None = None) -> None:
        out.append(_warning("limits", message, file, variable))

    if len(recordings) == 1:
        say("a single recording: none is left for validation, so that how far the gap closes cannot be checked")
    ambient = [r.ambient_temperature for r in recordings.values()]
    if np.ptp(ambient) < 15.0:
        say(
            f"all ambient temperatures lie within {np.ptp(ambient):.1f} K: what depends on temperature cannot be "
            "distinguished from what does not",
            variable="ambient_temperature",
        )
    if not any(r.health == "healthy" for r in recordings.values()):
        say("no recording is called healthy: a fault and this unit's own tolerance are distinguished by priors alone")
    turns = {
        d: any(np.maximum(d * np.diff(r.rotor_angle), 0.0).sum() > 10.0 for r in recordings.values()) for d in (1, -1)
    }
    if not all(turns.values()):
        say("the rotor turns in one direction only: a constant load, an asymmetric friction and an offset look alike")
    for variable, what in (("phase_current_end", "inductances"), ("bus_voltage", "the supply")):
        lacking = [n for n, r in recordings.items() if getattr(r, variable) is None]
        if lacking:
            which = (
                "no recording" if len(lacking) == len(recordings) else f"not every recording ({lacking[0]} does not)"
            )
            say(f"{which} holds {variable}: {what} can be judged less well", variable=variable)
    for n, r in recordings.items():
        step = actuator.pole_pairs * np.abs(np.diff(r.rotor_angle))
        if step[step > COARSE].sum() > 0.5 * step.sum():
            say(
                f"{n}: fewer than two samples in a commutation sector through most of the motion: the electrical "
                "equations of this recording determine little",
                n,
                "time",
            )
    return out

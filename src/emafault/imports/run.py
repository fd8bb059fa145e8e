"""The import: files and map to recordings, what was found and what was lost with them."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..errors import InputError
from ..io.bench import check_bench
from ..io.recording import Recording, write_recording
from ..io.sensors import refuse_mistaken
from ..places import refuse_folder, refuse_output
from ..units import quantity
from . import phases, probes
from .assemble import recording_of
from .clocks import clocks
from .finding import LEAST_MARGIN, Finding
from .loading import Raw, load
from .mapping import read_map
from .motion import senses, turn_round
from .voltages import floating_legs, star_part, swept, terminals_from_duty, with_modelled_star
from .windows import windows_of
from .zero import Electrical, fit

PAGE = "import.html"
PASSES = 5  # of which each takes two thirds of what k is off


@dataclass(frozen=True)
class Imported:
    """Recordings by file name, what was found, and what each recording cannot tell."""

    recordings: dict[str, Recording]
    findings: list[Finding]
    lost: dict[str, list[str]]
    electrical: dict[str, Electrical]
    warnings: list[str]


def imported(given: Mapping[str, Any], actuator: ActuatorParameters, voltage_noise: float) -> Imported:
    """Recordings of a map.

    Parameters
    ----------
    given : map of ``read_map``
    voltage_noise : of a mean by the sensors (V), to which that of pulses seen at samples only is added

    Raises
    ------
    InputError : in one line, what cannot be used or decided, and what to do
    """
    interval = quantity(given["interval"], "s", "interval")
    reference = given["signals"]["phase_voltage"]["reference"]
    recordings = load(given, actuator.pole_pairs)
    star = star_part(reference)
    if reference == "duty":
        for raw in recordings:
            terminals_from_duty(raw, actuator)
    else:
        probes.refuse_missed_pulses(recordings, given)
    found = probes.check_probes(recordings, given)
    found += clocks(recordings, given, star, actuator, interval)
    found += probes.check_pair(recordings, given, actuator, star, interval)
    going = senses(recordings, given, actuator)
    reading, of_phases = phases.read_phases(recordings, given, actuator, star, interval)
    turned: list[Finding] = []

    def turn(direction: int | None) -> bool:
        done, of_rotor = turn_round(recordings, given, going, direction)
        turned.extend(done)
        return of_rotor

    changed = phases.apply_phases(recordings, given, reading, of_phases, turn)
    found += [*going.values(), *of_phases, *turned, *changed]
    electrical = {raw.name: _fit(raw, actuator, interval) for raw in recordings}
    median = {k: float(np.median([getattr(e, k) for e in electrical.values()])) for k in ("resistance", "back_emf")}
    found += probes.check_sizes(recordings, given, actuator, **median)
    electrical = {raw.name: _fit(raw, actuator, interval) for raw in recordings}
    out = {}
    for raw in recordings:
        found.append(_set_zero(raw, given, electrical[raw.name], actuator.pole_pairs))
        if raw.off is not None:
            electrical[raw.name] = _with_floating_legs(raw, electrical[raw.name], actuator, interval)
        out[f"{raw.name}.nc"] = recording_of(raw, given, actuator, interval, voltage_noise)
    for name, recording in out.items():
        refuse_mistaken(name, recording, actuator)
    warnings = [w["message"] for w in check_bench("bench", out, actuator).warnings]
    return Imported(out, found, {raw.name: raw.lost for raw in recordings}, electrical, warnings)


def _fit(raw: Raw, actuator: ActuatorParameters, interval: float) -> Electrical:
    w = windows_of(raw, interval, actuator.pole_pairs)
    if w is None:
        raise InputError(f"{raw.name}: holds fewer than 50 windows in which all is known; record a longer motion")
    return fit(raw.name, w, w.voltage, actuator.pole_pairs)


def _with_floating_legs(raw: Raw, fitted: Electrical, actuator: ActuatorParameters, interval: float) -> Electrical:
    """The fit once legs that are off have their voltages: these need k, which the next fit has better."""
    driven, back_emf = raw.phased["phase_voltage"], np.full(3, fitted.back_emf)
    for _ in range(PASSES):
        raw.phased["phase_voltage"] = list(floating_legs(raw, driven, back_emf, actuator))
        w = windows_of(raw, interval, actuator.pole_pairs)
        assert w is not None  # there were enough for the fit
        h = np.diff(w.edges)[:, None]
        turned = swept(actuator.pole_pairs * w.angle_edge) / actuator.pole_pairs / h
        back_emf = with_modelled_star(w.voltage, w.current, np.diff(w.current_edge, axis=0) / h, turned)[2]
    return _fit(raw, actuator, interval)


def _set_zero(raw: Raw, given: Mapping[str, Any], fitted: Electrical, pole_pairs: int) -> Finding:
    """Shift the rotor's angle so that the plateau of phase a is where the format has it, in place.

    Raises
    ------
    InputError : a zero that the map says otherwise
    """
    spec = given["signals"]["rotor_angle"]
    zero, error = fitted.zero, np.rad2deg(fitted.error)
    words = f"{np.rad2deg(zero):.1f} degrees (standard error {error:.2g})"
    if "electrical_zero" in spec:
        zero = quantity(spec["electrical_zero"], "rad", "signals.rotor_angle.electrical_zero")
        off = float(np.abs(np.angle(np.exp(1j * (zero - fitted.zero)))))
        if off > LEAST_MARGIN * max(fitted.error, np.deg2rad(5.0)):
            raise InputError(
                f"{raw.name}: electrical zero is {words} by the voltages and {np.rad2deg(zero):.1f} by the map; "
                "take it out, or put it right"
            )
    else:
        raw.zero_error = fitted.error
        raw.lost.append(
            "the angle's electrical zero is that of the voltages: a displaced angle sensor cannot be detected"
        )
    raw.single["rotor_angle"] = raw.single["rotor_angle"].scaled(1.0, -zero / pole_pairs)
    return Finding(f"{raw.name}: electrical zero", words, fitted.margin, "no back-EMF that turns with the rotor")


def import_bench(
    path: str | Path, out: str | Path, actuator: ActuatorParameters, voltage_noise: float, force: bool = False
) -> Imported:
    """Import by a map; write recordings and ``import.html``.

    Parameters
    ----------
    force : whether files of these names are replaced

    Raises
    ------
    InputError : see ``imported``; results that cannot be written, or may not
    """
    from .page import draw

    given = read_map(path)
    refuse_folder(out, "--out")
    read = [path, *(file for entry in given["recordings"] for file in entry["files"].values())]
    for name in (*(f"{entry['name']}.nc" for entry in given["recordings"]), PAGE):
        refuse_output(Path(out) / name, "--out", read=read, force=force)
    result = imported(given, actuator, voltage_noise)
    folder = Path(out)
    plain = given | {  # without the folders of this machine
        "recordings": [
            entry | {"files": {logger: Path(file).name for logger, file in entry["files"].items()}}
            for entry in given["recordings"]
        ]
    }
    for entry in given["recordings"]:
        name = f"{entry['name']}.nc"
        digests = [
            hashlib.sha256(Path(p).read_bytes()).hexdigest() for p in entry["files"].values() if Path(p).is_file()
        ]
        source = {"source": " ".join(Path(p).name for p in entry["files"].values()), "source_sha256": " ".join(digests)}
        recording = result.recordings[name]
        attributes = recording.attributes | source | {
            "import_map": json.dumps(plain, sort_keys=True), "actuator": json.dumps(asdict(actuator)),
        }  # fmt: skip
        write_recording(folder / name, replace(recording, attributes=attributes))
    draw(result, plain).write(folder / PAGE)
    return result

"""A bench replayed by the simulator without and with what its diagnosis found, and how much nearer the latter comes.

Two switched loops diverge sample by sample even where their physics is the same. What is compared are therefore the
generalised features, and means over 10 ms; what two runs of the corrected simulator differ by, of another noise and
another start of the switching, is the least that can be reached.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..actuator.commands import resample, with_corners
from ..actuator.parameters import ActuatorParameters, make_runs
from ..dataset import as_batch, simulate_and_measure
from ..errors import InputError
from ..faults import FAULT_NAMES
from ..io.atomic import write_text
from ..io.bench import new_folder, read_bench
from ..io.recording import Recording, write_recording
from ..plain import read_json
from ..progress import progress
from ..reconstruction import reconstruct
from ..reporting.written import VERDICT, to_json

WINDOW = 0.01  # s, over which signals are averaged
ASIDE = 1e-4  # rad, by which the start of the repetition is off
FEATURES = {**{f"R_{j}": "ohm" for j in "abc"}, **{f"k_{j}": "V s/rad" for j in "abc"}}
MEANS = {
    "rotor speed": "rad/s", "output position": "rad", "current": "A", "sum of the currents": "A", "voltages": "V",
    "power": "W",
}  # fmt: skip
UNITS = FEATURES | MEANS
TELLS = 2.5  # times the least that can be reached, from which a difference is worth a share


@dataclass(frozen=True)
class Compared:
    """Root mean square differences of one quantity between the bench and its replays, over recordings and time.

    Features weigh by how well each recording determines them.

    ``least``: between two replays of the corrected simulator; ``closed``: share of the squared difference beyond that,
    which the corrections take away, None where there is hardly any.
    """

    without: float
    corrected: float
    least: float

    @property
    def closed(self) -> float | None:
        reach = self.without**2 - self.least**2
        if self.without < TELLS * self.least or reach <= 0.0:
            return None
        return (self.without**2 - self.corrected**2) / reach


def replay_bench(
    bench: str | Path, folder: str | Path, spec: Mapping[str, Any], plain: Mapping[str, Any], diagnosis: str | Path
) -> tuple[dict[str, Compared], str]:
    """Simulate every recording of a bench by its own command, start and temperature, and compare.

    Parameters
    ----------
    folder : new folder for the recordings of the corrected simulator and ``replay.json``
    spec, plain : the sub-tree ``config.replay_spec`` of the corrected and of the nominal simulator
    diagnosis : folder whose verdict, if there is one on this bench, gives the unit that was fitted without any effect,
        and the fault vectors of recordings that do not hold their own

    Returns
    -------
    by quantity, what replays differ by from the bench; and what the simulator without corrections is, in words

    Raises
    ------
    InputError : recordings that cannot be used, or a folder that holds files already
    """
    folder = new_folder(bench, folder, "simulate")
    actuator = ActuatorParameters(**plain["dataset"]["actuator"])
    recordings = read_bench(bench, actuator).recordings
    verdict = _verdict(Path(diagnosis) / VERDICT, recordings)
    before = dict(plain["dataset"])
    if verdict:
        before["effects"] = verdict["simulator"]["before"]
    settings = dict(spec["reconstruction"])
    method = settings.pop("method")
    off: dict[str, list[np.ndarray]] = {}
    for number, (name, recording) in enumerate(progress(recordings.items(), "replay", len(recordings))):
        faults = {stage: _fault(recording, verdict, name, stage) for stage in ("before", "after")}
        replays = (
            _replayed(recording, before, faults["before"], name, number),
            _replayed(recording, spec["dataset"], faults["after"], name, number),
            _replayed(recording, spec["dataset"], faults["after"], name, number + len(recordings), ASIDE),
        )
        write_recording(folder / name, replays[1])
        measured, *of = (_quantities(r, method, settings, actuator) for r in (recording, *replays))
        for quantity, (values, weight) in measured.items():
            if all(quantity in one for one in of):
                without, corrected, again = (one[quantity][0] for one in of)
                row = values - without, values - corrected, again - corrected
                squares = [weight * np.square(x).ravel() for x in row]
                off.setdefault(quantity, []).append(np.array([*squares, np.full(values.size, weight)]))
    compared = {}
    for quantity in (q for q in UNITS if q in off):
        *squares, weights = np.concatenate(off[quantity], axis=1).sum(axis=1)
        compared[quantity] = Compared(*(float(np.sqrt(x / weights)) for x in squares))
    rows = {q: vars(c) | {"closed": c.closed, "units": UNITS[q]} for q, c in compared.items()}
    write_text(folder / "replay.json", to_json(rows))
    return compared, "the unit fitted without any effect" if verdict else "the nominal actuator"


def table(compared: Mapping[str, Compared], without: str) -> str:
    """What replays differ by from the bench, as aligned text."""
    lines = [f"{'root mean square off':>30} {'without':>11} {'corrected':>11} {'least':>11} {'closed':>8}"]
    for quantity, c in compared.items():
        share = "" if c.closed is None else f"{100 * c.closed:.0f} %"
        sizes = f"{c.without:11.3g} {c.corrected:11.3g} {c.least:11.3g}"
        lines.append(f"{f'{quantity} ({UNITS[quantity]})':>30} {sizes} {share:>8}")
    lines.append(f"without: {without}; signals are means over {1e3 * WINDOW:g} ms; least: what two replays differ by")
    return "\n".join(lines)


def _verdict(path: Path, recordings: Mapping[str, Recording]) -> dict[str, Any] | None:
    """The verdict of a file if it is one on these recordings."""
    verdict = read_json(path) if path.is_file() else {}
    return verdict if "simulator" in verdict and set(verdict["fault_vector"]) & set(recordings) else None


def _fault(recording: Recording, verdict: Mapping[str, Any] | None, name: str, stage: str) -> np.ndarray:
    """(6,) fault vector of a recording: its own, else the diagnosis', else none at the measured temperature."""
    if recording.fault is not None:
        return recording.fault
    if verdict and name in verdict["fault_vector"]:
        found = verdict["fault_vector"][name][stage]
        return np.array([found[c]["value"] for c in FAULT_NAMES])
    return np.array([0.0, 0.0, 0.0, 0.0, 0.0, np.nan])


def _replayed(
    recording: Recording, dataset: Mapping[str, Any], fault: np.ndarray, name: str, number: int, aside: float = 0.0
) -> Recording:
    """The recording of the same command by a simulated actuator; ``aside`` (rad) moves the rotor's start."""
    actuator = ActuatorParameters(**dataset["actuator"])
    interval, samples = recording.interval, len(recording.time)
    duration = interval * samples
    if np.isnan(fault[5]):
        fault = np.append(fault[:5], recording.ambient_temperature - actuator.reference_temperature)
    runs = make_runs(
        actuator, fault[None], effects=dataset["effects"], eccentricity_law=dataset["faults"]["law"],
        theta_0=float(recording.rotor_angle[0]) + aside,
    )  # fmt: skip
    ends = interval * np.arange(1, samples + 1)
    command = resample(*with_corners(ends, recording.commanded_position), duration, actuator.control_period)
    signals = simulate_and_measure(dataset, runs, command, duration, interval, number, name)
    kept = {n: x[0] for n, x in signals.items() if getattr(recording, n) is not None}
    kept["commanded_position"] = recording.commanded_position
    attributes = recording.attributes | {"title": "replay of a recording by the simulated actuator"}
    return replace(recording, **kept, fault=fault, attributes=attributes)


def _quantities(
    recording: Recording, method: str, settings: Mapping[str, Any], actuator: ActuatorParameters
) -> dict[str, tuple[np.ndarray, float]]:
    """Features, where the recording determines them, and means over ``WINDOW``, each with its weight."""
    out: dict[str, tuple[np.ndarray, float]] = {}
    try:
        features = reconstruct(method, as_batch(recording), recording.interval, actuator, settings)
    except InputError:
        pass
    else:
        variance = np.diagonal(features.covariance[0])
        known = zip(FEATURES, features.six[0], variance, strict=True)
        out |= {name: (np.array([value]), 1.0 / v) for name, value, v in known if v > 0.0}
    current, voltage = recording.phase_current, recording.phase_voltage
    signals = (
        recording.rotor_speed, recording.output_position, 0.5 * np.abs(current).sum(axis=1), current.sum(axis=1),
        np.abs(voltage), (current * voltage).sum(axis=1),
    )  # fmt: skip
    width = max(1, round(WINDOW / recording.interval))
    blocks = len(current) // width
    for quantity, x in zip(MEANS, signals, strict=True):
        out[quantity] = x[: blocks * width].reshape(blocks, width, -1).mean(axis=1), 1.0
    return out

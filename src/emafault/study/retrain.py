"""Retraining with what a diagnosis found: two networks for one bench, without and with that simulated.

Both learn from simulations of the bench's own commands, lengths and intervals, by the unit that the diagnosis fitted
without and with the listed effects and what it describes, and identify the bench's recordings.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..actuator.commands import resample
from ..actuator.parameters import ActuatorParameters
from ..dataset import as_batch, sample_runs, simulate_and_measure
from ..equations.carried import entries
from ..errors import InputError
from ..faults import FAULT_NAMES
from ..identification.fitting import HeldOut, Prior, Recipe, fit_network
from ..identification.rows import TrainingRows
from ..io.bench import read_bench
from ..io.recording import Recording
from ..plain import read_json
from ..progress import progress, say
from ..reconstruction import Features, join_features, reconstruct
from ..reporting.retrained import write_with_section
from .networks import width_of, write_json

BLOCK = 25


def retrain_network(
    bench: str | Path,
    diagnosed: str | Path,
    report: str | Path,
    spec: Mapping[str, Any],
    output: str | Path,
    page: str | Path,
) -> None:
    """Train both networks, compare their errors on the bench and show them in the diagnosis' report.

    Parameters
    ----------
    bench : the folder that was diagnosed
    diagnosed, report : its verdict and its report
    spec : the sub-tree ``config.retraining_spec``
    output : JSON file to write; root mean square errors in percent of each component's range, against the true fault
        vectors where the recordings hold them, else against the diagnosis' joint fit
    page : the report with what retraining brought, to write

    Raises
    ------
    InputError : no verdict of the actuator's twin, or recordings that cannot be used
    """
    verdict = read_json(diagnosed)
    if "simulator" not in verdict:
        raise InputError(f"{diagnosed}: no verdict on the actuator; its twin alone can be trained for")
    actuator = ActuatorParameters(**spec["dataset"]["actuator"])
    names = {n for part in verdict["recordings"].values() for n in part}
    recordings = {n: r for n, r in read_bench(bench, actuator).recordings.items() if n in names}
    truths = {n: r.fault for n, r in recordings.items() if r.fault is not None}
    reference = "truth" if truths else "joint fit"
    if not truths:
        truths = {
            n: np.array([entry["after"][c]["value"] for c in FAULT_NAMES])
            for n, entry in verdict["fault_vector"].items()
            if n in recordings and all(c in entry["after"] for c in FAULT_NAMES)
        }
    settings = dict(spec["reconstruction"])
    method = settings.pop("method")
    measured = {}
    for name, recording in recordings.items():
        try:
            features = reconstruct(method, as_batch(recording), recording.interval, actuator, settings)
        except InputError:
            continue
        if name in truths and features.identified[0]:
            measured[name] = features
    if not measured:
        raise InputError(f"{bench}: no recording determines R and k of all three phases")
    width = width_of(spec["faults"])
    errors: dict[str, Any] = {}
    for kind, effects in verdict["simulator"].items():
        simulated = {"effects": effects, "unlisted": entries(verdict) if kind == "after" else []}
        features, faults = simulated_features(recordings, simulated, spec, method, settings, f"simulate {kind}")
        rows, estimates = TrainingRows(features.six, faults).identified(), []
        for seed in progress(range(spec["seeds"]), f"train {kind}", spec["seeds"]):
            recipe = Recipe(spec["network"], spec["training"], seed)
            fit = fit_network(rows, Prior(actuator), recipe, HeldOut("split"))
            estimates.append([fit.identifier.predict(f.six)[0] for f in measured.values()])
        found = np.mean(estimates, axis=0)
        off = 100.0 * (found - np.array([truths[n] for n in measured])) / width
        errors[kind] = {
            "rms": float(np.sqrt(np.mean(off**2))),
            "components": {c: float(np.sqrt(np.mean(off[:, m] ** 2))) for m, c in enumerate(FAULT_NAMES)},
            "estimates": {n: dict(zip(FAULT_NAMES, map(float, row))) for n, row in zip(measured, found)},
        }
    result = {"digest": verdict["digest"], "reference": reference, "recordings": list(measured), **errors}
    write_with_section(report, result, page)
    write_json(output, result)
    say(f"fault error without {errors['before']['rms']:.2f} %, with {errors['after']['rms']:.2f} % of range")


def simulated_features(
    recordings: Mapping[str, Recording],
    simulated: Mapping[str, Any],
    spec: Mapping[str, Any],
    method: str,
    settings: Mapping[str, Any],
    label: str,
) -> tuple[Features, np.ndarray]:
    """Features and fault vectors of runs that replay the bench's recordings in turn under sampled faults.

    ``simulated`` : ``effects`` and ``unlisted`` as a configuration has them
    """
    dataset = dict(spec["dataset"]) | dict(simulated)
    dataset["recording"] = dict(dataset["recording"]) | {"theta_0": {"low": 0.0, "high": 2.0 * np.pi}}
    sample = sample_runs(dataset)
    actuator = ActuatorParameters(**dataset["actuator"])
    parts, faults = [], []
    count = len(recordings)
    for m, recording in enumerate(progress(recordings.values(), label, count)):
        rows = np.arange(m, len(sample.faults), count)
        duration = recording.interval * len(recording.time)
        time = recording.time - (recording.time[0] - recording.interval)
        command = resample(time, recording.commanded_position, duration, actuator.control_period)
        for start in range(0, len(rows), BLOCK):
            chosen = rows[start : start + BLOCK]
            runs = sample.records(slice(int(chosen[0]), int(chosen[-1]) + 1, count))
            timing = duration, recording.interval
            signals = simulate_and_measure(dataset, runs, command, *timing, first_run=int(chosen[0]))
            if recording.phase_current_end is None:
                del signals["phase_current_end"]
            try:
                parts.append(reconstruct(method, signals, recording.interval, actuator, settings))
                faults.append(sample.faults[chosen])
            except InputError:
                continue
    if not parts:
        raise InputError("retraining: none of the bench's commands determines R and k of all three phases")
    return join_features(parts), np.concatenate(faults)

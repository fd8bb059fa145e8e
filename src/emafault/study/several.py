"""One fault from several recordings of a unit: error and bound over their number, by six and by nine features."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..actuator.commands import command_positions
from ..actuator.parameters import ActuatorParameters
from ..actuator.sensors import SensorNoise, measure
from ..actuator.simulate import simulate
from ..dataset import BLOCK, sample_runs
from ..identification.evaluation import GROUPS
from ..identification.posterior import Knowledge, nine_forward
from ..identification.together import together
from ..plain import read_json
from ..progress import progress
from ..reconstruction import reconstruct
from ..reconstruction.bounds import cramer_rao_bound, nine_bound
from ..reporting import several as figures_of
from ..reporting.page import Page
from .networks import write_json

HALF_WIDTH = 1.6449  # standard deviations, of 90 % intervals
MAE = np.sqrt(2.0 / np.pi)  # mean absolute error over standard deviation
SEED = 70  # added to the seed of the experiment's fresh runs, which are others
METHODS = {"six": ("weighted", {"floating": True}, 6), "nine": ("nine", {}, 9)}


def identify_several(spec: Mapping[str, Any], output: str | Path) -> None:
    """Identify units from so many recordings each, and write errors, bounds and coverage.

    Parameters
    ----------
    spec : the sub-tree ``config.several_spec``
    output : JSON file: a list with ``experiment``, ``features`` (six or nine), ``count`` of recordings, ``units``,
        ``errors`` and ``bound`` (mean absolute, of N, xi and dT) and ``coverage`` of 90 % intervals
    """
    write_json(output, [entry for own in spec["experiments"] for entry in _of_experiment(own, spec["settings"])])


def _of_experiment(own: Mapping[str, Any], settings: Mapping[str, Any]) -> list[dict[str, Any]]:
    units, each = settings["units"], max(settings["counts"])
    seed = own["dataset"]["seed"] + SEED + 10 * settings["seed"]
    part = {**own["dataset"], "runs": units, "recordings_of_a_unit": each, "seed": seed, "unit_seed": seed}
    faults = sample_runs({**part, "recordings_of_a_unit": 1}).faults
    temperature = part["faults"]["dT"]
    faults = np.repeat(faults, each, axis=0)
    rng = np.random.default_rng([seed, 7])
    faults[:, 5] = rng.uniform(temperature["low"], temperature["high"], len(faults))
    actuator, known = ActuatorParameters(**part["actuator"]), Knowledge(**own["known"])
    measured = _features(part, faults, actuator, own["name"])
    entries = []
    for features, (_, _, width) in METHODS.items():
        values, covariance, least = (x.reshape(units, each, *x.shape[1:]) for x in measured[features])
        true = nine_forward(faults, actuator, own["alpha_m"])[:, :width].reshape(units, each, width)
        for count in settings["counts"]:
            found, bound = [], []
            for n in range(units):
                options = (actuator, own["alpha_m"], known)
                found.append(together(values[n, :count], covariance[n, :count], *options))
                bound.append(together(true[n, :count], least[n, :count], *options))
            truth = faults.reshape(units, each, 6)[:, :count]
            error = np.abs(np.stack([joint.faults for joint in found]) - truth)
            spread, lowest = (
                np.sqrt(np.stack([np.diagonal(joint.covariance, axis1=1, axis2=2) for joint in joints]))
                for joints in (found, bound)
            )
            entries.append(
                {
                    "experiment": own["name"],
                    "features": features,
                    "count": count,
                    "units": units,
                    "errors": _by_group(error),
                    "bound": _by_group(MAE * lowest),
                    "coverage": float(np.mean(error < HALF_WIDTH * spread)),
                }
            )
    return entries


def _by_group(values: np.ndarray) -> dict[str, float]:
    return {name: float(np.mean(values[..., list(columns)])) for name, columns in GROUPS.items()}


def _features(
    part: Mapping[str, Any], faults: np.ndarray, actuator: ActuatorParameters, name: str
) -> dict[str, list[np.ndarray]]:
    """For each method coefficients (run, width), their covariance and the smallest one there can be."""
    recording, settings, sensors = part["recording"], dict(part["command"]), part["sensors"]
    settings.pop("digest", None)
    duration, interval = recording["duration"], recording["interval"]
    command = command_positions(settings.pop("name"), settings, duration, actuator.control_period)
    sample = sample_runs(part, faults)
    found: dict[str, list[tuple[np.ndarray, ...]]] = {features: [] for features in METHODS}
    for start in progress(range(0, len(faults), BLOCK), name, -(-len(faults) // BLOCK)):
        runs = sample.records(slice(start, start + BLOCK))
        clean = simulate(runs, command, duration, interval)
        noisy = measure(clean, runs, SensorNoise(**sensors), part["seed"], start)
        for features, (method, options, _) in METHODS.items():
            own = reconstruct(method, noisy, interval, actuator, options)
            if features == "nine":
                least = nine_bound(clean, interval, actuator, sensors, {})
            else:
                least = cramer_rao_bound(clean, interval, actuator, sensors, options).features
            found[features].append((own.inputs, own.inputs_covariance, least))
    return {features: [np.concatenate(x) for x in zip(*parts)] for features, parts in found.items()}


def draw_several(spec: Mapping[str, Any], found: str, output: str | Path, figures: str | Path) -> None:
    """Write the page: errors and bounds over the number of recordings.

    Raises
    ------
    InputError : a file that cannot be read or written
    """
    entries = read_json(found)
    page = Page("several_recordings", figures)
    page.paragraph(
        "What do several recordings of one fault determine together, each at a temperature of its own?", "lead"
    )
    for own in spec["experiments"]:
        mine = [entry for entry in entries if entry["experiment"] == own["name"]]
        page.heading(own["name"])
        page.paragraph(own["question"])
        text = "Mean absolute errors (dots) and bound (lines) over the number of recordings; a temperature for each."
        page.figure(own["name"], figures_of.over_count(mine), text, _in_words(mine))
        header = ["features", "recordings", "N", "over bound", "ξ", "over bound", "ΔT (K)", "over bound", "coverage"]
        page.table(header, [_row(entry) for entry in mine])
    text = (
        f"{spec['settings']['units']} units, the closed form of all recordings together, which all share what is not "
        "known of the unit; coverage is that of 90 % intervals. The bound is that of six features for six, that of the "
        "recordings for nine."
    )
    page.paragraph(text, "small")
    page.write(output)


def _in_words(entries: Sequence[Mapping[str, Any]]) -> str:
    """What the picture shows, for who cannot see it: from the fewest recordings to the most."""
    said = []
    for features in METHODS:
        own = sorted((e for e in entries if e["features"] == features), key=lambda e: e["count"])
        if own:
            first, last = own[0], own[-1]
            errors = [
                f"{label} {first['errors'][n]:.2g} to {last['errors'][n]:.2g} (bound {last['bound'][n]:.2g})"
                for n, label in figures_of.OUTPUTS.items()
            ]
            said.append(f"{features} features, {first['count']} to {last['count']} recordings: {', '.join(errors)}")
    return f"Mean absolute error. {'. '.join(said)}."


def _row(entry: Mapping[str, Any]) -> list[str]:
    row = [entry["features"], str(entry["count"])]
    for name, digits in {"N": 5, "xi": 5, "dT": 3}.items():
        error = entry["errors"][name]
        row += [f"{error:.{digits}f}", f"{error / entry['bound'][name]:.2f}"]
    return [*row, f"{entry['coverage']:.3f}"]

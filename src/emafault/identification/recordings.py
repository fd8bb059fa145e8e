"""Identification of one's own recordings by a reconstruction and an estimator fitted to its features."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from ..io.recording import Recording
from ..io.sensors import refuse_mistaken
from ..reconstruction.calibration import calibrate, reconstruct_recordings
from .identifier import Identifier

#: what a fault vector's components can be of any machine, a unit off nominal allowed for
POSSIBLE = {"N": (-0.5, 0.95), "xi": (-1.0, 1.0), "dT": (-150.0, 400.0)}


@dataclass(frozen=True)
class Model:
    """A reconstruction method with its settings and an estimator fitted to its features."""

    name: str  # reconstruction/estimator
    method: str
    settings: Mapping[str, Any]
    identifier: Identifier
    ambient_error: float  # K


@dataclass(frozen=True)
class Identified:
    """Estimates of recordings: for each {"Na": {"value", "low", "high"}, ...}, and a note where one needs caution."""

    estimates: list[dict[str, dict[str, float]]]
    notes: list[str]


def identify_recordings(
    model: Model, recordings: Sequence[Recording], reference: Sequence[Recording] = (), level: float = 0.9
) -> Identified:
    """Identify the fault vector of each recording.

    Parameters
    ----------
    reference : healthy recordings of the same unit, to calibrate it with; none takes the unit for nominal

    Raises
    ------
    InputError : naming the recording that cannot be used, for its signals contradict each other or what is identified
        from it is impossible
    """
    identifier = model.identifier
    if not 0.0 < level < 1.0:
        raise InputError(f"--level: got {level}, accepted is above 0 and below 1")
    for recording in reference:
        if recording.health == "seeded":
            raise InputError(f"{recording.name}: has health 'seeded', a reference must be healthy")
    for recording in (*recordings, *reference):
        refuse_mistaken(recording.name, recording, identifier.actuator)
    features = [reconstruct_recordings([r], model.method, identifier.actuator, model.settings) for r in recordings]
    for recording, own in zip(recordings, features):
        if not np.all(own.identified):
            raise InputError(
                f"{recording.name}: does not determine R and k of all three phases; a longer motion is needed"
            )
    unit = covariance = None
    if reference:
        healthy = reconstruct_recordings(reference, model.method, identifier.actuator, model.settings)
        ambient = np.array([recording.ambient_temperature for recording in reference])
        options = {"ambient_error": model.ambient_error, "alpha_m": identifier.alpha_m}
        found = calibrate(healthy, ambient, identifier.actuator, prior=identifier.prior, **options)
        unit, covariance = found.unit, found.covariance if np.all(np.isfinite(found.covariance)) else None
    estimates, notes = [], []
    for recording, own in zip(recordings, features, strict=True):
        inputs, noise = own.inputs, own.inputs_covariance if np.all(np.isfinite(own.inputs_covariance)) else None
        estimates += identifier.estimate(inputs, level, noise, unit, covariance)
        _refuse_impossible(recording.name, estimates[-1])
        beyond = float(identifier.outside(inputs, unit)[0])
        notes.append(f"features lie {beyond:.0%} of their range outside what was learnt from" if beyond > 0.05 else "")
    return Identified(estimates, notes)


def _refuse_impossible(name: str, estimate: Mapping[str, Mapping[str, float]]) -> None:
    for component, found in estimate.items():
        low, high = POSSIBLE[component if component == "dT" else "N" if component.startswith("N") else "xi"]
        if not low <= found["value"] <= high:
            units = " K" if component == "dT" else ""
            raise InputError(
                f"{name}: {component} would be {found['value']:.4g}{units}, possible is {low:g} to {high:g}{units}; "
                "the recording's units, signs or phases are mistaken, or it is of another actuator"
            )

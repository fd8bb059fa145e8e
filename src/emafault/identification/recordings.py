"""Identification of one's own recordings by a reconstruction and an estimator fitted to its features."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.special import chdtri, ndtri

from ..errors import InputError
from ..faults import FAULT_NAMES
from ..io.joined import joined
from ..io.recording import PHASES, Recording
from ..io.sensors import broken, refuse_mistaken
from ..reconstruction import Features, join_features
from ..reconstruction.calibration import calibrate, reconstruct_recordings
from .identifier import Identifier
from .possible import doubts
from .posterior import CHANCE
from .scales import beside, in_words, scales_of, widened_estimate, widened_noise
from .together import together

#: relative error of R, k and L beside their noise, and of a sensor's scale, up to which intervals are widened; beyond
#: it nothing is identified
LARGEST_MODEL_ERROR = 0.1


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
    model: Model,
    recordings: Sequence[Recording],
    reference: Sequence[Recording] = (),
    level: float = 0.9,
    as_one: bool = False,
) -> Identified:
    """Identify the fault vector of each recording.

    Parameters
    ----------
    reference : healthy recordings of the same unit, to calibrate it with; none takes the unit for nominal
    as_one : the recordings are of one unit and one fault: N and xi from all of them, a temperature for each

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
        for variable, rule in broken(recording):
            raise InputError(f"{recording.name}: {variable} {rule}")
    recordings, reference = ([joined(r)[0] for r in of] for of in (recordings, reference))
    of_reference = [scales_of(r) for r in reference]
    scales = [beside(scales_of(r), of_reference) for r in recordings]
    of_scales = [in_words(r.name, own, LARGEST_MODEL_ERROR) for r, own in zip(recordings, scales, strict=True)]
    features = [reconstruct_recordings([r], model.method, identifier.actuator, model.settings) for r in recordings]
    for recording, own in zip(recordings, features):
        if not np.all(own.identified):
            raise InputError(
                f"{recording.name}: does not determine R and k of all three phases; a longer motion is needed"
            )
    unit = covariance = None
    of_unit: list[str] = []
    if reference:
        healthy, of_unit = _healthy(model, reference)
        ambient = np.array([recording.ambient_temperature for recording in reference])
        options = {"ambient_error": model.ambient_error, "alpha_m": identifier.alpha_m}
        found = calibrate(healthy, ambient, identifier.actuator, prior=identifier.prior, **options)
        unit, covariance = found.unit, found.covariance if np.all(np.isfinite(found.covariance)) else None
    estimates: list[dict[str, dict[str, float]]] = []
    notes: list[list[str]] = []
    told: list[np.ndarray | None] = []
    for n, (recording, own) in enumerate(zip(recordings, features, strict=True)):
        inputs, noise = own.inputs, own.inputs_covariance if np.all(np.isfinite(own.inputs_covariance)) else None
        unexplained, said = _unexplained(recording, own, identifier)
        if noise is not None:
            # Cauchy and Schwarz: a misfit of chi-squared x beyond noise moves no estimate by more than x^0.5 of its
            # errors
            noise = widened_noise(noise * (1.0 + unexplained), inputs, scales[n])
        noise, more = _with_misfit(recording.name, own, noise, identifier, unit, covariance)
        said += of_scales[n] + more + of_unit
        if not as_one:
            (estimate,) = identifier.estimate(inputs, level, noise, unit, covariance)
            if noise is None:
                estimate = _widened(estimate, unexplained)
                estimate = widened_estimate(estimate, identifier, inputs, scales[n], level, unit)
            estimates.append(estimate)
        told.append(noise)
        beyond = float(identifier.outside(inputs, unit)[0])
        if beyond > 0.05:
            said.append(f"features lie {beyond:.0%} of their range outside what was learnt from")
        notes.append(said)
    if as_one:
        estimates = _as_one(model, recordings, features, told, unit, covariance, level)
    for recording, estimate, said in zip(recordings, estimates, notes, strict=True):
        warm = recording.ambient_temperature - identifier.actuator.reference_temperature
        said[:0] = doubts(recording.name, estimate, warm, level)
    return Identified(estimates, ["; ".join(said) for said in notes])


def _as_one(
    model: Model,
    recordings: Sequence[Recording],
    features: Sequence[Features],
    noise: Sequence[np.ndarray | None],
    unit: np.ndarray | None,
    unit_covariance: np.ndarray | None,
    level: float,
) -> list[dict[str, dict[str, float]]]:
    """Estimates of recordings of one fault; N and xi are the same in each.

    Raises
    ------
    InputError : a model that does not tell, recordings with a fault each of their own, or that fit no common fault
    """
    identifier = model.identifier
    if identifier.network is not None or features[0].inputs.shape[1] == 8:
        raise InputError(
            f"--together: '{model.name}' cannot, accepted is a closed form of six or nine features, such as "
            "weighted_floating/closed_form or nine/closed_form"
        )
    for recording, covariance in zip(recordings, noise):
        if recording.health == "seeded" and len(recordings) > 1:
            raise InputError(f"{recording.name}: has health 'seeded', a fault of its own; --together takes one fault")
        if covariance is None:
            raise InputError(f"--together: '{model.name}' tells no covariance, accepted is weighted or nine")
    found = together(
        np.concatenate([own.inputs for own in features]),
        np.concatenate([covariance for covariance in noise if covariance is not None]),
        identifier.actuator,
        identifier.alpha_m,
        identifier.known,
        unit,
        unit_covariance,
    )
    if len(recordings) > 1 and found.misfit > chdtri(found.freedom, CHANCE):
        worst = recordings[int(np.argmax(found.shares))].name
        raise InputError(
            f"{worst}: fits no fault that the other recordings have too (chi-squared {found.misfit:.0f} of all with "
            f"{found.freedom} degrees of freedom); without --together each is identified by itself"
        )
    half = ndtri(0.5 + 0.5 * level) * np.sqrt(np.diagonal(found.covariance, axis1=1, axis2=2))
    return [
        {
            name: {"value": float(x[j]), "low": float(x[j] - h[j]), "high": float(x[j] + h[j])}
            for j, name in enumerate(FAULT_NAMES)
        }
        for x, h in zip(found.faults, half)
    ]


def _healthy(model: Model, reference: Sequence[Recording]) -> tuple[Features, list[str]]:
    """Features of a unit's healthy recordings, with what their equations leave unexplained, and that in words."""
    identifier, parts, said = model.identifier, [], []
    for recording in reference:
        own = reconstruct_recordings([recording], model.method, identifier.actuator, model.settings)
        unexplained, words = _unexplained(recording, own, identifier)
        own = identifier.with_noise(own)
        extras = dict(own.extras)
        if "nine_covariance" in extras:
            extras["nine_covariance"] = extras["nine_covariance"] * (1.0 + unexplained)
        parts.append(replace(own, covariance=own.covariance * (1.0 + unexplained), extras=extras))
        said += [f"{recording.name}: {word}" for word in words]
    return join_features(parts), said


def _unexplained(recording: Recording, own: Features, identifier: Identifier) -> tuple[float, list[str]]:
    """Chi-squared of the phases whose voltage does not fit its equation, beyond what noise makes; and that in words.

    A method that fits no equation of its own, as the paper's, is told by the equations that ``weighted`` fits.
    """
    of_warmth, said = _warming(recording, own, identifier)
    if "fit" not in own.extras:
        try:
            own = reconstruct_recordings([recording], "weighted", identifier.actuator, {"floating": True})
        except InputError:
            of_fit = "whether its voltages fit their equations is not told: too little of the recording is of use"
            return of_warmth, [*said, of_fit]
    fit, freedom = own.extras["fit"][0], own.extras["freedom"][0]
    if "nine_covariance" in own.extras and np.any(np.isnan(fit)):
        said.append(
            "no end currents are recorded, the inductance is not told: intervals are about those of six features"
        )
    poor = np.flatnonzero(fit * freedom > chdtri(np.maximum(freedom, 1), CHANCE))
    if not len(poor):
        return of_warmth, said
    phases = ", ".join(PHASES[j] for j in poor)
    said.append(
        f"the voltage of phase {phases} does not fit its equation (chi-squared {np.max(fit[poor]):.2g} per degree "
        "of freedom): intervals are widened by what that can do at most"
    )
    return of_warmth + float(np.sum((fit[poor] - 1.0) * freedom[poor])), said


def _warming(recording: Recording, own: Features, identifier: Identifier) -> tuple[float, list[str]]:
    """The same of a resistance that grows by the currents' own heat where the method takes it for constant."""
    if "heating_rate" in own.extras:
        return 0.0, []
    if "growth" not in own.extras:
        try:
            own = reconstruct_recordings([recording], "nine", identifier.actuator, {})
        except InputError:
            return 0.0, []
    growth, error = own.extras["growth"][0]
    misfit = (growth / error) ** 2
    if not misfit > chdtri(1, CHANCE):
        return 0.0, []
    by = growth / identifier.actuator.copper_coefficient
    said = (
        f"R changes by {growth:.2g} of its value in the recording, as of a winding that warms by {by:.2g} K: it is "
        "found as a mean, and intervals are widened by what that can do at most; nine_heating has the rate unknown"
    )
    return float(misfit), [said]


def _widened(estimate: dict[str, dict[str, float]], unexplained: float) -> dict[str, dict[str, float]]:
    """An estimate of features whose noise is not told, as wide as ``_with_misfit`` makes the others."""
    by = float(np.sqrt(1.0 + unexplained))
    return {
        name: {key: e["value"] + by * (e[key] - e["value"]) for key in ("value", "low", "high")}
        for name, e in estimate.items()
    }


def _with_misfit(
    name: str,
    own: Features,
    noise: np.ndarray | None,
    identifier: Identifier,
    unit: np.ndarray | None,
    unit_covariance: np.ndarray | None,
) -> tuple[np.ndarray | None, list[str]]:
    """Covariance of a recording's features with what the fault laws leave unexplained, and that in words.

    Raises
    ------
    InputError : coefficients that no fault of this actuator has
    """
    if noise is None:
        return noise, []
    off = float(identifier.model_error(own.inputs, noise, unit, unit_covariance)[0])
    if off > LARGEST_MODEL_ERROR:
        raise InputError(
            f"{name}: R, k and L of the phases fit no fault of this actuator by {off:.0%}; the recording is of another "
            "unit or its sensors are off, --reference calibrates on healthy recordings"
        )
    if not off:
        return noise, []
    noise = noise + np.eye(9) * (off * own.inputs) ** 2
    return noise, [f"R, k and L fit no fault of this unit by {off:.2g} of their values: intervals are widened"]

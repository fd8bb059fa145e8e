"""Calibration of a unit on its own healthy recordings at known ambient temperature.

A real unit is off nominal by more than a fault's signature. Its R and k at the reference temperature, phase by phase,
are the mean over healthy recordings of R_j/(1 + alpha dT) and k_j/(1 + alpha_m dT), weighted by the features'
covariance; L, of a method that gives its covariance, does not change with temperature. The error of the measured
ambient temperature (one a recording, shared by the phases) and what "healthy" leaves open are in the uncertainty. What
is known of any unit beforehand, its tolerance, counts as one measurement more.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..closed_form import ECCENTRICITY_AXES, propagate
from ..errors import InputError
from ..io.recording import Recording
from .features import Features, join_features


@dataclass(frozen=True)
class Calibration:
    """A unit's own parameters at the reference temperature."""

    R0: np.ndarray  # (phase,) ohm
    k0: np.ndarray  # (phase,) V s/rad
    L0: np.ndarray  # (phase,) H, NaN where the method does not estimate it
    covariance: np.ndarray  # (6, 6) of [R0, k0], (9, 9) with L0 where its own is known; NaN where it cannot be told
    recordings: int

    @property
    def unit(self) -> np.ndarray:
        """(6,) [R0_a, R0_b, R0_c, k0_a, k0_b, k0_c], or (9,) with L0 behind them, as ``covariance`` has them."""
        return np.concatenate([self.R0, self.k0, self.L0])[: len(self.covariance)]

    @property
    def standard_error(self) -> np.ndarray:
        """Standard errors of ``unit``."""
        return np.sqrt(np.diagonal(self.covariance))

    def actuator(self, nominal: ActuatorParameters) -> ActuatorParameters:
        """The nominal actuator with this unit's mean R, k and, where known, L."""
        L = float(np.mean(self.L0))
        return replace(
            nominal,
            resistance=float(np.mean(self.R0)),
            back_emf=float(np.mean(self.k0)),
            inductance=L if np.isfinite(L) else nominal.inductance,
        )

    def to_nominal(self, features: Features, nominal: ActuatorParameters) -> Features:
        """Features as the nominal actuator would show them for the same fault, with the calibration's uncertainty.

        That uncertainty is common to all recordings of the unit: their mean does not average it out.
        """
        unit = self.unit[:6]
        scale = np.repeat([nominal.resistance, nominal.back_emf], 3) / unit
        six = features.six * scale
        own = propagate(features.covariance, np.diag(scale))
        relative = six / unit
        shared = self.covariance[:6, :6] * relative[:, :, None] * relative[:, None, :]
        return replace(features, R=six[:, :3], k=six[:, 3:], covariance=own + shared)


def calibrate(
    features: Features,
    ambient_temperature: np.ndarray,
    actuator: ActuatorParameters,
    *,
    ambient_error: float = 0.5,
    alpha_m: float = 0.0,
    healthy_within: float = 1e-3,
    prior: tuple[np.ndarray, np.ndarray] | None = None,
) -> Calibration:
    """Estimate a unit's R0 and k0, and L0 where the features have its covariance, from healthy recordings.

    Parameters
    ----------
    features : of the healthy recordings, one run each
    ambient_temperature : (run,) measured ambient temperature, which the winding starts at (degC)
    ambient_error : its standard deviation (K)
    alpha_m : temperature coefficient of the magnets, at the winding's temperature (1/K)
    healthy_within : largest N and xi that still count as healthy, taken as uniform (1)
    prior : mean (9,) and covariance (9, 9) of [R0, k0, L0] (SI) that is known of any unit; None knows nothing

    Raises
    ------
    InputError : no recording determines the features
    """
    good = features.identified
    if not np.any(good):
        raise InputError("calibration: none of the healthy recordings determines R and k of all three phases")
    dT = np.atleast_1d(np.asarray(ambient_temperature, float))[good] - actuator.reference_temperature
    own = features.inputs_covariance[good]
    width = own.shape[1]  # six or nine
    alpha = np.repeat([actuator.copper_coefficient, alpha_m, 0.0], 3)[:width]
    warmth = 1.0 + alpha * dT[:, None]  # (run, width)
    at_reference = features.nine[good, :width] / warmth
    n = len(dT)
    fault = np.zeros((width, 5))  # derivative of the healthy features, relative, by N and xi
    for quantity in range(width // 3):
        fault[3 * quantity : 3 * quantity + 3, :3] = -np.eye(3) * (2.0 if quantity == 2 else 1.0)
    fault[3:6, 3:] = ECCENTRICITY_AXES
    if np.all(np.isfinite(own)):
        slope = at_reference * alpha / warmth * ambient_error  # change per standard deviation of the temperature
        each = propagate(own, np.eye(width) / warmth[:, :, None])
        weight = np.linalg.inv(each + slope[:, :, None] * slope[:, None, :])
        covariance = np.linalg.inv(np.sum(weight, axis=0))
        unit = covariance @ np.sum(weight @ at_reference[..., None], axis=0)[:, 0]
    else:
        unit = np.mean(at_reference, axis=0)
        covariance = np.cov(at_reference, rowvar=False) / n if n > 1 else np.full((width, width), np.nan)
    fault *= unit[:, None]
    covariance = covariance + healthy_within**2 / 3.0 * fault @ fault.T
    if prior is not None:
        # by the gain, as a tolerance that the phases have in common has no inverse
        mean, spread = prior[0][:width], prior[1][:width, :width]
        gain = spread @ np.linalg.inv(spread + covariance)
        unit, covariance = mean + gain @ (unit - mean), spread - gain @ spread
    L0 = unit[6:] if width == 9 else np.mean(features.L[good], axis=0)
    return Calibration(unit[:3], unit[3:6], L0, covariance, n)


def reconstruct_recordings(
    recordings: Sequence[Recording], method: str, actuator: ActuatorParameters, settings: Mapping[str, Any]
) -> Features:
    """Features of recordings of any length and interval, one run each.

    Raises
    ------
    InputError : naming the recording that the method cannot use
    """
    from . import reconstruct  # the registry, which is built on this package's other modules

    parts = []
    for recording in recordings:
        signals = {name: getattr(recording, name) for name in _SIGNALS if getattr(recording, name) is not None}
        try:
            parts.append(reconstruct(method, signals, recording.interval, actuator, settings))
        except InputError as error:
            raise InputError(f"{recording.name}: {error}") from error
    if not parts:
        raise InputError("recordings: none given, at least one is needed")
    return join_features(parts)


_SIGNALS = ("phase_voltage", "phase_current", "phase_current_end", "rotor_speed", "rotor_angle")


def calibrate_recordings(
    recordings: Sequence[Recording],
    actuator: ActuatorParameters,
    method: str = "weighted",
    settings: Mapping[str, Any] | None = None,
    **options: Any,
) -> Calibration:
    """Calibrate a unit on healthy recordings; ``options`` are those of ``calibrate``.

    Raises
    ------
    InputError : a recording that the method cannot use
    """
    features = reconstruct_recordings(recordings, method, actuator, settings or {})
    ambient = np.array([recording.ambient_temperature for recording in recordings])
    return calibrate(features, ambient, actuator, **options)

"""Scales of the speed and the currents that a recording itself tells: what they do to its features, and in words."""

from collections.abc import Sequence

import numpy as np
from scipy.special import ndtri

from ..errors import InputError
from ..io.recording import PHASES, Recording
from ..io.scales import Scale, current_scales, speed_scale
from ..io.sensors import cut_off
from .identifier import Identifier

WHAT = ("rotor_speed", *(f"phase_current of phase {phase}" for phase in PHASES))
OF = ("the rate of rotor_angle", *["what adds up to zero with the other two"] * 3)
DOES = ("k", *["R and L"] * 3)
Scales = tuple[Scale, ...]


def scales_of(recording: Recording) -> Scales:
    """Scales of the speed and of the currents of phases a, b, c, without what a current's range cuts off."""
    cut = cut_off(recording).get("phase_current")
    whole = None if cut is None else np.asarray(~cut.any(axis=1))
    return (speed_scale(recording), *current_scales(recording, whole))


def beside(own: Scales, reference: Sequence[Scales]) -> Scales:
    """The same scales over those of a unit's healthy recordings, which calibrate the sensors with it."""
    if not reference:
        return own
    out = []
    for n, scale in enumerate(own):
        value = float(np.mean([other[n].value for other in reference]))
        error = float(np.mean([other[n].error for other in reference]))
        out.append(Scale(scale.value / value, float(np.hypot(scale.error, error))))
    return tuple(out)


def in_words(name: str, scales: Scales, largest: float) -> list[str]:
    """The scales that are off one by more than noise.

    Parameters
    ----------
    name : of the recording
    largest : by how much a scale may be off one

    Raises
    ------
    InputError : a scale that is further off
    """
    said = []
    for scale, what, of, does in zip(scales, WHAT, OF, DOES, strict=True):
        if abs(scale.off) > largest:
            raise InputError(
                f"{name}: {what} is {scale.value:.3g} times {of}, accepted is {1.0 - largest:g} to {1.0 + largest:g}; "
                f"its scale is mistaken, --reference calibrates on healthy recordings"
            )
        if scale.off:
            said.append(f"{what} is {scale.value:.4g} times {of}: intervals are widened by what that does to {does}")
    return said


def errors_of(scales: Scales, width: int) -> np.ndarray:
    """(scale, width) relative errors of R, k and L of phases a, b, c, the first ``width``, or of R, k and xi."""
    out = np.zeros((len(scales), 9))
    out[0, 3:6] = scales[0].off
    for j in range(3):
        out[1 + j, [j, 6 + j]] = scales[1 + j].off
    if width == 8:  # xi, measured by itself, is a ratio
        out[:, 6:] = 0.0
    return out[:, :width]


def widened_noise(noise: np.ndarray, features: np.ndarray, scales: Scales) -> np.ndarray:
    """(1, width, width) covariance of R, k and L, the scales' errors in it; ``features`` (1, width or more)."""
    width = noise.shape[-1]
    errors = errors_of(scales, width) * features[:, :width]
    return noise + errors.T @ errors


def widened_estimate(
    estimate: dict[str, dict[str, float]],
    identifier: Identifier,
    features: np.ndarray,
    scales: Scales,
    level: float,
    unit: np.ndarray | None,
) -> dict[str, dict[str, float]]:
    """An estimate of features (1, width) whose noise is not told, with what the scales' errors move it by."""
    errors = errors_of(scales, features.shape[1])
    if not errors.any():
        return estimate
    at = identifier.predict(features, None, unit)
    moved = np.concatenate([identifier.predict(features * (1.0 + e), None, unit) - at for e in errors])
    by = ndtri(0.5 + 0.5 * level) * np.sqrt(np.sum(moved**2, axis=0))
    return {
        name: {
            "value": e["value"],
            "low": e["value"] - float(np.hypot(e["value"] - e["low"], by[j])),
            "high": e["value"] + float(np.hypot(e["high"] - e["value"], by[j])),
        }
        for j, (name, e) in enumerate(estimate.items())
    }

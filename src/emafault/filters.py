"""Low-pass filters of recorded voltages, currents and speed: of the sensors, before their noise, or of the logger.

Angles and positions are digital and pass: a filter makes all else late beside them. Of the sensors' a first-order
filter is that of values which run straight from one instant to the next (first-order hold), so that its delay is its
time constant however short that is; the logger's works on the recorded samples. A moving average has the present
sample as its last. A first-order filter that is known can be undone, by the logger exactly.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

FILTERS = ("none", "first_order", "moving_average")
FILTERED = ("phase_voltage", "phase_current", "phase_current_end", "rotor_speed")
HALF_POWER = 0.443  # cutoff times the width of a moving average


def low_passed(
    signals: Mapping[str, np.ndarray], interval: float, settings: Mapping[str, Any]
) -> dict[str, np.ndarray]:
    """Signals through a filter that starts at rest.

    Parameters
    ----------
    signals : (run, time) or (run, time, phase) each
    interval : of recording (s)
    settings : ``kind``, one of ``FILTERS``, ``cutoff`` (Hz), where it passes half of the power, and ``before_noise``,
        true of the sensors' filter
    """
    return _through(signals, *coefficients(interval, settings))


def undone(signals: Mapping[str, np.ndarray], interval: float, settings: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Signals as they were before a first-order filter; noise that came behind it grows. Arguments as before."""
    numerator, denominator = coefficients(interval, settings)
    return _through(signals, denominator, numerator)


def coefficients(interval: float, settings: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Numerator and denominator of a filter in z^-1."""
    if settings["kind"] == "none":
        return np.ones(1), np.ones(1)
    if settings["kind"] == "moving_average":
        width = max(round(HALF_POWER / (settings["cutoff"] * interval)), 1)
        return np.full(width, 1.0 / width), np.ones(1)
    constant = 1.0 / (2.0 * np.pi * settings["cutoff"])  # s
    pole = np.exp(-interval / constant)
    late = constant / interval * (1.0 - pole) if settings["before_noise"] else 0.0
    ahead = [1.0 - late, late - pole] if settings["before_noise"] else [1.0 - pole]
    return np.array(ahead), np.array([1.0, -pole])


def _through(
    signals: Mapping[str, np.ndarray], numerator: np.ndarray, denominator: np.ndarray
) -> dict[str, np.ndarray]:
    from scipy.signal import lfilter  # its import takes longer than many a job

    return {
        name: lfilter(numerator, denominator, values, axis=1) if name in FILTERED else values
        for name, values in signals.items()
    }

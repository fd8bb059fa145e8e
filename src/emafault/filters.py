"""Low-pass filters of recorded voltages, currents and speed: of the sensors, before their noise, or of the logger.

Angles and positions are digital and pass. At the resolution of the recording intervals: a first-order filter is that of
their values held over each interval, a moving average that of whole intervals, the present one the last.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.signal import lfilter

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
    settings : ``kind``, one of ``FILTERS``, and ``cutoff`` (Hz), where it passes half of the power
    """
    if settings["kind"] == "none":
        return dict(signals)
    numerator, denominator = coefficients(interval, settings["kind"], settings["cutoff"])
    return {
        name: lfilter(numerator, denominator, values, axis=1) if name in FILTERED else values
        for name, values in signals.items()
    }


def coefficients(interval: float, kind: str, cutoff: float) -> tuple[np.ndarray, np.ndarray]:
    """Numerator and denominator of a filter in z^-1; ``cutoff`` in Hz."""
    if kind == "first_order":
        pole = np.exp(-2.0 * np.pi * cutoff * interval)
        return np.array([1.0 - pole]), np.array([1.0, -pole])
    width = max(round(HALF_POWER / (cutoff * interval)), 1)
    return np.full(width, 1.0 / width), np.array([1.0])

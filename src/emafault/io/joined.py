"""Recordings that are faster than their own angle: intervals joined until each ends with an angle that is new."""

from dataclasses import replace

import numpy as np

from .recording import Recording
from .updates import APART, updates

AT_END = ("phase_current_end", "rotor_angle", "output_position", "commanded_position", "time")
MEANS = ("phase_voltage", "phase_current", "rotor_speed", "bus_voltage")


def joined(recording: Recording) -> tuple[Recording, int]:
    """The recording at the rate at which its angle is new, and how many intervals are joined to one.

    Means are those over the joined intervals, but for a channel that is held for as long as the angle, whose new sample
    counts.
    """
    new = np.flatnonzero(updates(recording.rotor_angle))
    period = int(np.median(np.diff(new))) if len(new) > 1 else 1
    places = np.bincount(new % period)
    if period == 1 or places.max() < APART * len(new):
        return recording, 1
    first = int(places.argmax())
    ends = np.arange(first, len(recording.time), period)
    ends = ends[ends >= period - 1]

    def of(name: str, x: np.ndarray) -> np.ndarray:
        if name in AT_END or _held_as_long(x, ends):
            return x[ends]
        sums = np.concatenate([np.zeros_like(x[:1]), np.cumsum(x, axis=0)])
        return (sums[ends + 1] - sums[ends + 1 - period]) / period

    found = {n: x for n in (*AT_END, *MEANS) if (x := getattr(recording, n)) is not None}
    return replace(recording, **{n: of(n, x) for n, x in found.items()}), period  # type: ignore[arg-type]


def _held_as_long(x: np.ndarray, ends: np.ndarray) -> bool:
    """Whether a channel has other values where the angle is new, and nowhere else."""
    changed = 1 + np.flatnonzero(np.diff(x.reshape(len(x), -1)[:, 0]) != 0.0)
    return len(changed) > 0 and bool(np.mean(np.isin(changed, ends)) > APART)

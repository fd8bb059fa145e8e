"""Recordings that are faster than their own angle: intervals joined until each ends with an angle that is new."""

from dataclasses import replace

import numpy as np

from .recording import Recording
from .updates import updates

AT_END = ("phase_current_end", "rotor_angle", "output_position", "commanded_position", "time")
MEANS = ("phase_voltage", "phase_current", "rotor_speed", "bus_voltage")
REGULAR = 0.98  # of the new samples, that lie a whole number of periods apart


def slower_angle(recording: Recording) -> int:
    """Intervals from one new sample of the angle to the next; 1 where it is as fast as the recording, or irregular."""
    at = np.flatnonzero(updates(recording.rotor_angle))
    period = int(np.median(np.diff(at))) if len(at) > 1 else 1
    return period if period > 1 and np.bincount(at % period).max() >= REGULAR * len(at) else 1


def joined(recording: Recording) -> tuple[Recording, int]:
    """The recording at the rate at which its angle is new, and how many intervals are joined to one.

    Means are those over the joined intervals, but for a channel that is held for as long as the angle, whose new sample
    counts.
    """
    period = slower_angle(recording)
    if period == 1:
        return recording, 1
    new = np.flatnonzero(updates(recording.rotor_angle))
    first = int(np.bincount(new % period).argmax())
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
    return len(changed) > 0 and bool(np.mean(np.isin(changed, ends)) > REGULAR)

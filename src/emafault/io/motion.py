"""Angle, speed and output position without what is no measurement: spikes, and the counts that an encoder has lost."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import maximum_filter1d, median_filter, minimum_filter1d

from .lattice import spacing
from .recording import Recording
from .updates import across, updates

MOVING = 2.0  # rad/s, of a rotor that is not at rest
MOTION = ("rotor_angle", "rotor_speed", "output_position")
SPIKE = 10.0  # robust standard deviations of a second difference, or from a cubic
AROUND, NEAR = 9, 4  # samples on either side of one in which counts or time may be lost, and those nearest
STAYS = 0.5  # of a jump, that the medians on either side of it may differ from it by
ROW = 1.5  # times the command's changes around, from which there is a row missing


def calm_motion(recording: Recording) -> Recording:
    """A recording whose signals of the motion have no spikes, whose angle has lost no counts, and with straight lines
    between the new samples of a channel that is slower than the recording."""
    calm = without_spikes_of_motion(recording)
    return replace(calm, rotor_angle=without_slips(calm.rotor_angle, *slips(calm)))


def without_spikes_of_motion(recording: Recording) -> Recording:
    """A recording whose signals of the motion have no spikes, and straight lines between the new samples of a channel
    that is slower than the recording."""
    angle, speed, output = (_calm(getattr(recording, n)) for n in MOTION)
    return replace(recording, rotor_angle=angle, rotor_speed=speed, output_position=output)


def _calm(x: np.ndarray) -> np.ndarray:
    new = updates(x)
    calm = x.copy()
    calm[new] = without_outliers(x[new])[0]
    return across(calm, new)


def without_outliers(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A signal of the motion (sample,) less spikes, with what their neighbours say there; and (spike,) their samples.

    A spike stands out of a cubic through two samples on either side, by more than twice what these differ by beyond
    the local slope, and than twice the local curvature.
    """
    out, rows = values.copy(), np.zeros(0, int)
    if len(values) < 8:
        return out, rows
    x = values
    between = (4.0 * (x[2:-4] + x[4:-2]) - (x[1:-5] + x[5:-1])) / 6.0  # of samples 3 to -3
    off = np.abs(x[3:-3] - between)
    scale = max(float(np.median(off)) / 0.6745, spacing(values) / np.sqrt(6.0))
    second = np.abs(np.diff(x, 2))
    bends = np.maximum(second[:-4], second[4:])  # of the three samples before, of those after
    slope = (x[2:-4] - x[1:-5]) + (x[5:-1] - x[4:-2])  # over two intervals, from those beside
    alone = off > 2.0 * np.maximum(bends, np.abs(x[4:-2] - x[2:-4] - slope))
    if scale > 0.0:
        rows = 3 + np.flatnonzero((off > SPIKE * scale) & alone)
    out[rows] = between[rows - 3]
    return out, rows


@dataclass(frozen=True)
class Jump:
    """From ``row`` on the angle is off by ``size`` (rad) more than before; ``missing``: with the command as well."""

    row: int
    size: float
    missing: bool


def slips(recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Samples from which on the angle is off by more than before, as an encoder's that has lost counts, and by how much
    (rad); (slip,) each, of a recording without spikes."""
    found = [j for j in jumps(recording) if not j.missing]
    return np.array([j.row for j in found], int), np.array([j.size for j in found])


def jumps(recording: Recording) -> list[Jump]:
    """Where the angle of a recording without spikes is off by more than before.

    In that interval its change less the integrated speed stands out of those around it by more than these differ, and
    by more than any lag of either would make of how the speed changes there; and it stays. An angle that repeats
    samples makes up for what it missed, and where the command changes by more too, rows are missing.
    """
    angle, speed, h = recording.rotor_angle, recording.rotor_speed[1:], recording.interval
    beside = 2 * AROUND + 1
    if len(angle) < 2 * beside or recording.known.get("rotor_angle", {}).get("source"):
        return []
    beyond = np.diff(angle) - h * speed
    off = np.abs(beyond - median_filter(beyond, beside, mode="nearest"))
    scale = np.maximum(median_filter(off, beside, mode="nearest"), np.median(off)) / 0.6745
    changes = h * (maximum_filter1d(speed, beside) - minimum_filter1d(speed, beside))
    found = off > np.maximum(SPIKE * np.maximum(scale, spacing(angle) / np.sqrt(6.0)), changes)
    steps = np.abs(np.diff(recording.commanded_position))
    out = []
    for at in np.flatnonzero(found[AROUND:-AROUND]):
        around = beyond[at : at + beside]
        level = np.cumsum(around - (around.sum() - around[AROUND]) / (beside - 1))
        # of a spike beside another, which is left, the one is in no median
        size = float(np.median(level[AROUND : AROUND + NEAR]) - np.median(level[AROUND - NEAR : AROUND]))
        row = int(at) + AROUND + 1
        repeats = bool(np.any(np.diff(angle[row - AROUND : row + AROUND]) == 0.0))
        stays = abs(size - around[AROUND]) < STAYS * abs(size)
        commanded = steps[at : at + beside]
        if stays and not repeats:
            out.append(Jump(row, size, bool(commanded[AROUND] > ROW * np.delete(commanded, AROUND).max())))
    return out


def without_slips(angle: np.ndarray, rows: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """An angle (sample,) less what it is off by from some samples on."""
    out = angle.copy()
    for row, size in zip(rows, sizes, strict=True):
        out[row:] -= size
    return out

"""Samples that are no new ones: of channels slower than the recording, whose value is held until the next one comes or
goes to it in a straight line, and single ones that repeat the one before."""

import numpy as np

from .lattice import spacing

MOST = 0.6  # of the samples, that are new on such a channel
FEWEST = 50  # new samples
APART = 0.98  # of the new samples, that no other is next to; or that lie a period apart
LONGEST = 200  # samples of a period
HELD = 3  # samples equal to the one before, which a channel with noise never shows
STRAIGHT = 1e-7  # of a signal's largest value, that a straight line may be rounded by


def updates(x: np.ndarray) -> np.ndarray:
    """(sample,) bool: new samples of a channel (sample,); all of them, unless it is slower than the recording."""
    held = np.append(True, np.diff(x) != 0.0)
    joined = np.ones(len(x), bool)
    joined[1:-1] = np.abs(np.diff(x, 2)) > STRAIGHT * np.abs(x).max()
    for new in (held, joined):
        rows = _slower(x, new)
        if rows is not None:
            rows[-1] &= new is held  # where a line is cut off nothing is known to be new
            return rows
    return np.ones(len(x), bool)


def repeated(x: np.ndarray) -> np.ndarray:
    """(sample,) bool: samples of a channel (sample,) that repeat the one before to the last digit, where it moves
    otherwise; what stays at an end of its range is cut off there, and what stays at zero is off."""
    same = np.append(False, np.diff(x) == 0.0) & (x > x.min()) & (x < x.max()) & (x != 0.0)
    return same if HELD <= same.sum() < 0.5 * len(x) else np.zeros(len(x), bool)


def across(x: np.ndarray, new: np.ndarray) -> np.ndarray:
    """(sample,) a channel with straight lines between its new samples."""
    return x if new.all() else np.interp(np.arange(len(x)), np.flatnonzero(new), x[new])


def _slower(x: np.ndarray, new: np.ndarray) -> np.ndarray | None:
    """The new samples of a channel whose values change at some; None where that tells of no slower channel."""
    at = np.flatnonzero(new)
    if not FEWEST <= len(at) <= MOST * len(x):
        return None
    if spacing(x[at]) == 0.0:
        return new if np.mean(np.diff(at) > 1) > APART else None
    # what lies on a lattice stays where it is by itself, but not for whole periods
    periods = [p for p in range(2, LONGEST) if np.bincount(at % p).max() > APART * len(at)]
    if not periods:
        return None
    first = int(np.bincount(at % periods[-1]).argmax())
    return np.arange(len(x)) % periods[-1] == first

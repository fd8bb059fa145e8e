"""Phase currents that add up to nothing by construction: one is less the sum of the two that have a sensor, or their
mean was taken off all three. Their sum then tells nothing of the sensors, nor of the noise."""

from collections.abc import Sequence

import numpy as np

from .recording import PHASES, Recording

EXACT = 1e-6  # of the largest current, that a sum which is nothing may be rounded by
OFF = 0.25  # of the conducting phases' current, below which a phase is off
FEWEST_OFF = 100  # samples in which a phase is off, that its noise is told from
ALIKE = 1.5  # ratio of the largest variance to the smallest, 2 where one is a sum of two and 1 where all are alike


def adds_up(recording: Recording) -> bool:
    """Whether the recorded currents add up to nothing, to the last digits."""
    current = recording.phase_current
    return bool(np.abs(current.sum(axis=1)).max() <= EXACT * np.abs(current).max())


def derived_phase(recordings: Sequence[Recording]) -> int | None:
    """Phase whose current is less the sum of the other two, in recordings that add up; None where all are measured.

    It is what the recordings state, or the phase that has twice the variance of the others while it is off.
    """
    stated = [str(r.known["phase_current"].get("derived", "")) for r in recordings if "phase_current" in r.known]
    for phase in PHASES:
        if phase in stated:
            return PHASES.index(phase)
    variance = _resting(recordings) ** 2
    loudest = int(np.argmax(variance))
    others = np.delete(variance, loudest)
    return loudest if np.isfinite(variance).all() and variance[loudest] > ALIKE * others.mean() else None


def _resting(recordings: Sequence[Recording], end: bool = False) -> np.ndarray:
    """(phase,) standard deviation (A) of the noise of each current, or of those at intervals' ends, while its phase is
    off, robust; infinite where too few samples tell it.

    What is left of a current that runs out is in second differences of neighbours that are off alike.
    """
    found: list[list[np.ndarray]] = [[], [], []]
    for r in recordings:
        values = r.phase_current_end if end else r.phase_current
        if values is None:
            continue
        level = np.abs(r.phase_current)
        off = (level < OFF * level.max(axis=1, keepdims=True)) & (level == level.min(axis=1, keepdims=True))
        second = np.diff(values, 2, axis=0)
        for j in range(3):
            found[j].append(second[off[:-2, j] & off[1:-1, j] & off[2:, j], j])
    parts = [np.concatenate(x) if x else np.zeros(0) for x in found]
    return np.array(
        [float(np.median(np.abs(x))) / 0.6745 / np.sqrt(6.0) if len(x) >= FEWEST_OFF else np.inf for x in parts]
    )


def resting_noise(recordings: Sequence[Recording], end: bool = False) -> float:
    """Standard deviation (A) of the noise of a current's sensor, or of the currents at intervals' ends, while its phase
    is off; infinite where too few samples tell it. All recordings add up, or none."""
    noise = _resting(recordings, end)
    if not adds_up(recordings[0]):
        return float(noise.mean())
    derived = derived_phase(recordings)
    if derived is not None:
        return float(np.delete(noise, derived).mean())
    return float(noise.mean()) * np.sqrt(1.5)  # a third of each is gone with their mean

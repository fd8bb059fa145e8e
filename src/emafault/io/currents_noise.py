"""The noise of the currents' sensors where their sum does not tell it: of channels that differ, and of currents that
add up to nothing by construction, for one is less the sum of the two that have a sensor, or the mean was taken off."""

from collections.abc import Sequence

import numpy as np

from .lattice import lattice_step
from .recording import PHASES, Recording

EXACT = 1e-6  # of the largest current, that a sum which is nothing may be rounded by
OFF = 0.25  # of the conducting phases' current, below which a phase is off
FEWEST_OFF = 100  # samples in which a phase is off, that its noise is told from
#: number of samples times the variance of the logarithm of a variance that a median of their second differences tells:
#: 4 times 1.36 of independent ones (Huber and Ronchetti 2009, Robust Statistics, section 5.1), of neighbours twice that
MEDIAN_OF_SQUARES = 10.9
ALIKE = 1.5  # ratio of the largest variance to the smallest, 2 where one is a sum of two and 1 where all are alike


def adds_up(recording: Recording) -> bool:
    """Whether the recorded currents add up to nothing, to the last digits, although they have noise or steps."""
    current = recording.phase_current
    if np.abs(current.sum(axis=1)).max() > EXACT * np.abs(current).max():
        return False
    return bool((_resting([recording]) > 0.0).any()) or any(lattice_step(x) > 0.0 for x in current.T)


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


def resting_noise(recordings: Sequence[Recording], end: bool = False) -> float:
    """Standard deviation (A) of the noise of a current's sensor, or of the currents at intervals' ends, while its phase
    is off, that of a sensor with the mean variance; infinite where too few samples tell it. All recordings add up, or
    none."""
    noise = _resting(recordings, end)
    if not adds_up(recordings[0]):
        return float(np.sqrt(np.mean(noise**2)))
    derived = derived_phase(recordings)
    if derived is not None:
        return float(np.sqrt(np.mean(np.delete(noise, derived) ** 2)))
    return float(np.sqrt(1.5 * np.mean(noise**2)))  # a third of each is gone with their mean


def shares_of_noise(recordings: Sequence[Recording], end: bool = False) -> np.ndarray:
    """(phase,) variance of the noise of each current's sensor over the mean of all three; one, unless the sensors
    differ by more than the criterion of Bayes and Schwarz asks for of two more parameters."""
    alike = np.ones(3)
    second = _while_off(recordings, end)
    count = np.array([len(x) for x in second])
    noise = _resting(recordings, end)
    if adds_up(recordings[0]) or not np.isfinite(noise).all() or noise.min() == 0.0:
        return alike
    log, weight = 2.0 * np.log(noise), count / MEDIAN_OF_SQUARES
    differ = float(weight @ (log - weight @ log / weight.sum()) ** 2)
    return noise**2 / np.mean(noise**2) if differ > 2.0 * np.log(count.sum()) else alike


def _resting(recordings: Sequence[Recording], end: bool = False) -> np.ndarray:
    """(phase,) standard deviation (A) of the noise of each current, or of those at intervals' ends, while its phase is
    off, robust; infinite where too few samples tell it."""
    return np.array([
        float(np.median(np.abs(x))) / 0.6745 / np.sqrt(6.0) if len(x) >= FEWEST_OFF else np.inf
        for x in _while_off(recordings, end)
    ])  # fmt: skip


def _while_off(recordings: Sequence[Recording], end: bool) -> list[np.ndarray]:
    """Second differences of each current while its phase is off, of neighbours that are off alike: what is left of one
    that runs out is not in them."""
    found: list[list[np.ndarray]] = [[np.zeros(0)], [np.zeros(0)], [np.zeros(0)]]
    for r in recordings:
        values = r.phase_current_end if end else r.phase_current
        if values is None:
            continue
        level = np.abs(r.phase_current)
        off = (level < OFF * level.max(axis=1, keepdims=True)) & (level == level.min(axis=1, keepdims=True))
        second = np.diff(values, 2, axis=0)
        for j in range(3):
            found[j].append(second[off[:-2, j] & off[1:-1, j] & off[2:, j], j])
    return [np.concatenate(x) for x in found]

"""Lines in the spectrum of what a model leaves: a frequency in time, or an order of the rotor, common to recordings.

The periodogram of each recording, over its running median, is the log likelihood that a sinusoid of that frequency and of any
amplitude and phase gains (Scargle 1982, Astrophys. J. 263, 835); recordings add up.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter
from scipy.stats import gamma

OVERSAMPLED = 4
AROUND = 129  # places of the oversampled spectrum that its median is taken of
FALSE_ALARM = 1e-3  # probability that noise alone holds a line as high anywhere
FEWEST = 4.0  # periods that a recording must hold


@dataclass(frozen=True)
class Line:
    """A line: ``along`` ``time`` (Hz) or ``angle`` (per turn), the equations it is seen in, its place and the number of
    places that were looked at."""

    along: str
    equations: tuple[str, ...]
    place: float
    trials: float


def strongest(
    parts: Sequence[tuple[Mapping[str, np.ndarray], np.ndarray]],
    along: str,
    equations: tuple[str, ...],
    width: float,
    unit: float = 1.0,
) -> Line | None:
    """The highest line, or None where noise alone may hold one as high.

    Parameters
    ----------
    parts : coordinates and (row,) white residual of each block, zero where a row is not used
    width : of the bins along the coordinate
    unit : of the coordinate, that the place is per
    """
    spans = [float(np.ptp(c[along])) for c, _ in parts]
    longest = max(spans, default=0.0)
    if longest < 8.0 * width:
        return None
    size = 1 << int(np.ceil(np.log2(OVERSAMPLED * longest / width)))
    places = np.fft.rfftfreq(size, width)
    total = np.zeros(len(places))
    count = np.zeros(len(places))
    for (coordinates, left), span in zip(parts, spans, strict=True):
        used = left != 0.0
        if used.sum() < 50 or span <= 0.0:
            continue
        x = coordinates[along]
        cell = np.floor((x - x.min()) / width).astype(int)
        sums = np.bincount(cell[used], left[used], size)
        power = np.abs(np.fft.rfft(sums, size)) ** 2 / used.sum()
        level = median_filter(power, AROUND, mode="nearest") / np.log(2.0)
        seen = places > FEWEST / span
        total[seen] += (power / np.maximum(level, 1e-12))[seen]
        count[seen] += 1
    seen = count > 0
    if not seen.any():
        return None
    chance = np.zeros(len(places))
    chance[seen] = gamma.logsf(total[seen], count[seen])
    best = int(np.argmin(chance))
    trials = len(places) / OVERSAMPLED
    if chance[best] + np.log(trials) > np.log(FALSE_ALARM):
        return None
    return Line(along, equations, _between(places, total, best) * unit, trials)


def _between(places: np.ndarray, total: np.ndarray, best: int) -> float:
    """Place of a maximum between the grid's, by the parabola through its neighbours."""
    if not 0 < best < len(places) - 1:
        return float(places[best])
    a, b, c = total[best - 1 : best + 2]
    bend = a - 2.0 * b + c
    shift = 0.5 * (a - c) / bend if bend < 0.0 else 0.0
    return float(places[best] + shift * (places[1] - places[0]))

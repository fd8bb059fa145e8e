"""What the current regulator does that no equation holds: the limit of its demand and its band, where they show.

At its limit the demand stands still, whatever the control law asks for: the pair's currents pile up at one value, with
none above. Within its band the pair's current goes up and down evenly, so that where an interval ends it is as likely
in any place of it.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from . import control
from .machine import ReferenceActuator
from .saturated import CHANCE, SPREAD, VARIED, pile
from .signals import Signals

FEWEST = 50  # intervals that tell a scale
DELAYED = 0.05  # of a band: a comparator's delay widens it


def settings(
    machine: ReferenceActuator, recordings: Sequence[str], values: Mapping[str, float]
) -> dict[str, tuple[float, float]]:
    """Value and standard deviation (A) of ``current_limit`` and ``hysteresis``, the half band, where recordings show
    them.

    Parameters
    ----------
    values : of all parameters, by which the control law asks for a current
    """
    pairs = [_Pair(machine.recordings[n]) for n in recordings]
    scatter = _scatter(pairs)
    if not scatter:
        return {}
    found = {"current_limit": _limit(machine, pairs, values, scatter), "hysteresis": _half_band(pairs, scatter)}
    return {name: f for name, f in found.items() if f is not None}


class _Pair:
    """The current of the pair that is switched on (A), (sample,), and where it is known: away from commutations."""

    def __init__(self, rec: Signals):
        self.rec = rec
        edges = control.edges(rec) > 0
        counted = np.stack(control.counted(rec), axis=1)
        self.current = 0.5 * (counted * rec.current).sum(axis=1)
        off = rec.lost | control.without_headroom(rec) | ~rec.resolved | (np.abs(counted).sum(axis=1) != 2)
        self.known = ~(off | edges | np.roll(edges, 1) | np.roll(edges, -1))
        self.known[[0, -1]] = False
        # two intervals one after the other with the same pair: what the current is where the first of them ends
        self.joined = self.known[:-1] & self.known[1:] & np.all(np.equal(counted[:-1], counted[1:]), axis=1)
        self.change = np.diff(self.current)
        self.ends = None
        if rec.current_end is not None:
            at_end = 0.5 * (counted * rec.current_end).sum(axis=1)
            self.ends = (at_end[:-1] - 0.5 * (self.current[:-1] + self.current[1:]))[self.joined]


def _scatter(pairs: Sequence[_Pair]) -> float | None:
    """Standard deviation (A) of a mean of the pair's current: of the ripple's part in it and of the sensors, whose
    rounding most differences do not show; None where there are too few."""
    bent = np.concatenate([np.diff(p.change)[p.joined[:-1] & p.joined[1:]] for p in pairs])
    if len(bent) < FEWEST:
        return None
    seen = float(np.median(np.abs(bent)) / 0.6745 / np.sqrt(6.0))
    return max(seen, pairs[0].rec.noise.current / np.sqrt(2.0))


def _limit(
    machine: ReferenceActuator, pairs: Sequence[_Pair], values: Mapping[str, float], scatter: float
) -> tuple[float, float] | None:
    level = np.concatenate([np.abs(p.current) for p in pairs])
    known = np.concatenate([p.known for p in pairs])
    log_chance, piled = pile(level, known, scatter)
    if log_chance > np.log(CHANCE):
        return None
    # by how much the law's demand changes from block to block where the current does not
    asked = []
    begins = np.cumsum([0, *(p.rec.size for p in pairs)])
    for p, begin in zip(pairs, begins, strict=False):
        own = piled[begin : begin + p.rec.size]
        if own.any():
            width = control.block_length(p.rec)
            blocks = np.any(own[: p.rec.size // width * width].reshape(-1, width), axis=1).ravel()
            (law,) = (b.residual for b in machine.blocks(values, p.rec.name, wanted=()) if b.equation == "control")
            asked.append(law[blocks[1:] & blocks[:-1]])
    changes = np.concatenate(asked)
    if not len(changes) or np.sqrt(np.mean(changes**2)) < VARIED * 2.0 * SPREAD * scatter:
        return None
    return float(np.median(level[piled])), float(scatter / np.sqrt(piled.sum()))


def _half_band(pairs: Sequence[_Pair], scatter: float) -> tuple[float, float] | None:
    even = [p.ends[np.abs(p.change[p.joined]) < SPREAD * np.sqrt(2.0) * scatter] for p in pairs if p.ends is not None]
    ends = np.concatenate([np.zeros(0), *even])
    if len(ends) < FEWEST:
        return None
    value = 2.0 * float(np.median(np.abs(ends)))
    return value, value * float(np.hypot(1.0 / np.sqrt(len(ends)), DELAYED))

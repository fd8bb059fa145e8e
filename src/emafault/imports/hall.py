"""The rotor's angle from three hall sensors."""

import numpy as np
from scipy.interpolate import CubicSpline

from ..errors import InputError
from .signal import Signal

SECTORS = {(1, 0, 0): 0, (1, 1, 0): 1, (0, 1, 0): 2, (0, 1, 1): 3, (0, 0, 1): 4, (1, 0, 1): 5}
SLIPPED = 0.01  # of the edges that may skip a sector: noise, not another wiring


def angle_of_halls(name: str, halls: list[Signal], pole_pairs: int) -> Signal:
    """Mechanical angle (rad): known at each edge, smooth between them; from rest half a sector before the first, and to
    rest half a sector after the last.

    Where its zero lies, and which way it counts, is found from the voltages as for any sensor.

    Raises
    ------
    InputError : sensors that all agree, or that skip sectors
    """
    state = np.stack([h.values > 0.5 * (h.values.min() + h.values.max()) for h in halls], axis=1).astype(int)
    if np.any(state.min(axis=1) == state.max(axis=1)):
        raise InputError(f"{name}: the three hall signals agree somewhere, which 120 degrees apart they never do")
    sector = np.array([SECTORS[tuple(row)] for row in state])
    steps = (np.diff(sector) + 3) % 6 - 3
    edges = np.flatnonzero(steps)
    if len(edges) < 12 or np.mean(np.abs(steps[edges]) != 1) > SLIPPED:
        raise InputError(
            f"{name}: the hall signals have {len(edges)} edges or skip sectors; two turns of them are needed"
        )
    time = halls[0].time
    # an edge going forward is the lower end of the sector that begins, going back the upper one
    turned = sector[0] + np.cumsum(steps)
    at_edge = turned[edges] + np.where(steps[edges] > 0, 0.0, 1.0)
    when = 0.5 * (time[edges] + time[edges + 1])
    spline = CubicSpline(when, at_edge)
    angle = spline(np.clip(time, when[0], when[-1]))
    for end, side in ((0, time < when[0]), (-1, time > when[-1])):
        angle[side] += _to_rest(time[side] - when[end], float(spline(when[end], 1)))
    return Signal(time, angle * np.pi / 3.0 / pole_pairs, False, halls[0].logger, "rotor_angle")


def _to_rest(since: np.ndarray, rate: float) -> np.ndarray:
    """Sectors from an edge passed at a rate (sectors/s) to rest half a sector away, evenly slowed."""
    lasts = 1.0 / max(abs(rate), 1e-9)
    part = 1.0 - np.clip(np.abs(since) / lasts, 0.0, 1.0)
    return 0.5 * np.sign(rate) * np.sign(since) * (1.0 - part**2)

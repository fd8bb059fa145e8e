"""Where the current passes from phase to phase: shares of the staying phase's current around each commutation edge.

In an interval in which the edge at 30 (or 210) degrees of phase j lies, the mean current of phase j is that of the
staying phase times the share of the interval beyond the edge. The time that a current takes to pass over is the
controller's own: a constant and a part in proportion to the current.
"""

import numpy as np

from .dual import Dual
from .point import State, effect_name
from .terms import with_hook

EDGE = np.pi / 6.0
REACH = np.deg2rad(6.0)  # electrical rad around an edge that displaced sensors may move it by
LONGEST = 0.35  # of an interval, that a current may take to pass over
STAYS = (1, 2, 0)  # phase that stays on where a, b, c are switched on


def rows_of(state: State, j: int) -> np.ndarray:
    """Intervals in which an edge of phase j may lie."""
    low, high, _ = _sweep(state.rec.rows_from, j)
    rec = state.rec.rows_from
    half = high - low < np.pi / 3.0
    a = rec.actuator
    passing = 2.0 * a.inductance * np.abs(rec.current[:, STAYS[j]]) / a.bus_voltage  # s, about
    short = passing < LONGEST * rec.interval
    return np.flatnonzero((low < REACH) & (high > -REACH) & rec.moving & half & short)


def _sweep(rec, j: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Electrical angle from the nearest edge at the lower and upper end of each interval, and the middle's."""
    poles = rec.actuator.pole_pairs
    middle = poles * rec.middle - rec.axis[j] - EDGE
    middle = middle - np.pi * np.round(middle / np.pi)
    half = poles * np.abs(rec.half_sweep)
    return middle - half, middle + half, middle


def residual(state: State) -> Dual:
    """Mean current of the phase less its share (A), intervals of phase a, then b, then c."""
    rec, p = state.rec, state.p
    out: list[Dual] = []
    for j in range(3):
        rows = rows_of(state, j)
        low, high, _ = (x[rows] for x in _sweep(rec, j))
        early: Dual | float = p(f"controller.edge_{'abc'[j]}@{rec.name}")
        for m in with_hook("commutation"):
            early = early + m.commutation(p.of(effect_name(m)), j)
        stays, own = (np.asarray(state.current[q].value)[rows] for q in (STAYS[j], j))
        time = p("controller.commutation_time") + p("controller.commutation_slope") * np.abs(stays)
        time = time + p(f"controller.commutation_time_{'abc'[j]}")
        w = rec.actuator.back_emf * np.abs(rec.speed[rows]) / (0.5 * rec.actuator.bus_voltage)
        time = time + (p("controller.commutation_speed") + p("controller.commutation_power") * np.abs(stays)) * w
        edge = time * (rec.actuator.pole_pairs * rec.speed[rows]) - early
        width = high - low
        inside = (edge.value > low) & (edge.value < high)
        share = (high - edge) * (1.0 / width)
        share = share.kept(inside) + np.where(edge.value <= low, 1.0, 0.0)
        out.append(own + share * stays)
    names = {n for d in out for n in d.slopes}
    sizes = [len(np.atleast_1d(d.value)) for d in out]
    slopes = {
        n: np.concatenate([np.broadcast_to(d.slopes.get(n, 0.0), size) for d, size in zip(out, sizes, strict=True)])
        for n in names
    }
    return Dual(np.concatenate([np.atleast_1d(d.value) for d in out]), slopes)


def noise_bands(state: State, count: int) -> list[np.ndarray]:
    """Diagonal of the noise's covariance (A2): the sensors', and where the edge falls on the switching ripple."""
    rec = state.rec
    ripple = 0.15 * rec.actuator.hysteresis * min(1.0, 5e-5 / rec.interval)
    return [np.full(count, 2.0 * rec.noise.current**2 + ripple**2)]

"""Where the current passes from phase to phase: shares of the staying phase's current around each commutation edge.

In an interval in which the edge at 30 (or 210) degrees of phase j lies, the mean current of phase j is that of the
staying phase times the share of the interval beyond the edge. The time that a current takes to pass over is the
controller's own: a constant and a part in proportion to the current. At a constant speed all commutations at an edge
meet the switching ripple at one and the same place, so that in a recording their time is off alike.
"""

from itertools import pairwise

import numpy as np
from scipy.special import ndtr

from ..actuator.parameters import ActuatorParameters
from .acquisition import gain
from .dual import Dual, Number
from .point import State, effect_name
from .signals import passing_time
from .terms import with_hook

EDGE = np.pi / 6.0
REACH = np.deg2rad(6.0)  # electrical rad around an edge that displaced sensors may move it by
LONGEST = 0.35  # of an interval, that a current may take to pass over
WIDEST = 0.25  # variance that a share of an interval has at most
SHIFTS = ("skew.current@", "lag.current_")  # parameters
STAYS = (1, 2, 0)  # phase that stays on where a, b, c are switched on


def rows_of(state: State, j: int) -> np.ndarray:
    """Intervals in which an edge of phase j may lie."""
    rec = state.rec.rows_from
    return rec.once(("rows_of", j), lambda: _rows_of(rec, j))


def _rows_of(rec, j: int) -> np.ndarray:
    low, high, _ = sweep(rec, j)
    half = high - low < np.pi / 3.0
    short = passing_time(rec.actuator, np.abs(rec.current[:, STAYS[j]])) < LONGEST * rec.interval
    return np.flatnonzero((low < REACH) & (high > -REACH) & rec.moving & half & short)


def sweep(rec, j: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Electrical angle from the nearest edge at the lower and upper end of each interval, and the middle's."""
    poles = rec.actuator.pole_pairs
    middle = poles * rec.middle - rec.axis[j] - EDGE
    middle = middle - np.pi * np.round(middle / np.pi)
    half = poles * np.abs(rec.half_sweep)
    return middle - half, middle + half, middle


def residual(state: State) -> Dual:
    """Mean current of the phase less its share (A), intervals of phase a, then b, then c."""
    out: list[Dual] = []
    for j in range(3):
        rows, edge, share, slope = _shares(state, j)
        stays, own = (_shifted(state.current[q], rows) for q in (STAYS[j], j))
        # the measured quantity keeps its coefficient: a gain of all currents alike would shrink its noise
        out.append((own + edge.through(share, slope) * stays) * float(1.0 / gain(state.p, j).value))
    ends = np.cumsum([0, *(len(np.atleast_1d(d.value)) for d in out)]).tolist()
    slopes = {n: np.zeros(ends[-1]) for d in out for n in d.slopes}
    for d, (first, end) in zip(out, pairwise(ends), strict=True):
        for n, s in d.slopes.items():
            slopes[n][first:end] = s
    return Dual(np.concatenate([np.atleast_1d(d.value) for d in out]), dict[str, Number](slopes))


def _shifted(x: Dual, rows: np.ndarray) -> Dual:
    """Some samples of a current, with derivatives by what shifts it in time; what multiplies it would its noise too."""
    slopes = {n: np.asarray(s)[rows] for n, s in x.slopes.items() if n.startswith(SHIFTS)}
    return Dual(np.asarray(x.value)[rows], dict[str, Number](slopes))


def by_angle(state: State) -> np.ndarray:
    """(row,) how the residual changes with the electrical angle at which the edges lie (A/rad)."""
    out = []
    for j in range(3):
        rows, _, _, slope = _shares(state, j)
        out.append(slope * np.asarray(state.current[STAYS[j]].value)[rows])
    return np.concatenate(out)


def by_angle_of_phase(state: State) -> np.ndarray:
    """(phase, row) how it changes with the angle at which one phase's edges lie (A/rad)."""
    phase = np.repeat(range(3), [len(rows_of(state, j)) for j in range(3)])
    return np.where(phase == np.arange(3)[:, None], by_angle(state), 0.0)


def _shares(state: State, j: int) -> tuple[np.ndarray, Dual, np.ndarray, np.ndarray]:
    """Intervals of phase j, where the current passes over (electrical rad), (row,) the share of an interval beyond
    that, and how it changes with that."""
    rows, low, high, edge = _edges(state, j)
    reach, width = _spread(state, j, low, high)
    above, below = (high - edge.value) / reach, (low - edge.value) / reach
    share = reach * (_above_zero(above) - _above_zero(below)) / width
    return rows, edge, share, (ndtr(below) - ndtr(above)) / width


def _edges(state: State, j: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, Dual]:
    """Intervals of phase j, their ends from the nominal edge, and where the current passes over (electrical rad)."""
    rec, p = state.rec, state.p
    rows = rows_of(state, j)
    # a share is the mean over what the recorded angle leaves open, which no further draw of its noise changes
    # (Berkson's error: Fuller 1987, Measurement Error Models, section 1.6.4)
    angle = rec.drawn_from
    low, high = angle.once(("ends", j), lambda: tuple(x[rows] for x in sweep(angle, j)[:2]))
    early = p(f"controller.edge_{'abc'[j]}") - p.own("zero")
    for m in with_hook("commutation"):
        early = early + m.commutation(p.of(effect_name(m)), j)
    stays = np.abs(np.asarray(state.current[STAYS[j]].value)[rows])
    time = p("controller.commutation_time") + p("controller.commutation_slope") * stays
    time = time + p(f"controller.commutation_time_{'abc'[j]}")
    for name, there in rec.rows_from.once(("edges_of", j), lambda: _edges_of(rec.rows_from, rows, j)).items():
        time = time + p(name) * there
    w = rec.actuator.back_emf * np.abs(angle.speed[rows]) / (0.5 * rec.actuator.bus_voltage)
    time = time + (p("controller.commutation_speed") + p("controller.commutation_power") * stays) * w
    edge = time * (rec.actuator.pole_pairs * angle.speed[rows]) - early
    return rows, low, high, edge


def passing(j: int, recording: str) -> list[str]:
    """Names of the times by which passings over at the edges of phase j are off: ahead and back, where the phase that
    stays on carries its current out of the motor and into it. The ripple may meet each at another place."""
    ways = [f"{way}_{side}" for way in ("ahead", "back") for side in ("out", "in")]
    return [f"controller.passing_{'abc'[j]}_{way}@{recording}" for way in ways]


def _edges_of(rec, rows: np.ndarray, j: int) -> dict[str, np.ndarray]:
    """Which intervals have which of them, (row,) of 0 and 1 by name."""
    ahead, out = rec.speed[rows] > 0.0, rec.current[rows, STAYS[j]] < 0.0
    kinds = ahead & out, ahead & ~out, ~ahead & out, ~ahead & ~out
    return {n: k.astype(float) for n, k in zip(passing(j, rec.name), kinds, strict=True)}


def _spread(state: State, j: int, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(row,) over how far the current passes over, by the ripple, by its own rise and by what the recorded angle leaves
    open, and the interval's width (electrical rad)."""
    rec, rows = state.rec, rows_of(state, j)
    return rec.once(("spread", j), lambda: _new_spread(rec, rows, j, high - low))


def _new_spread(rec, rows: np.ndarray, j: int, width: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    poles = rec.actuator.pole_pairs
    ends = poles * rec.angle_noise[rows]
    ramp = passing_time(rec.actuator, np.abs(rec.current[rows, STAYS[j]])) / np.sqrt(12.0)
    time = np.hypot(ripple_time(rec.actuator), ramp)
    return np.hypot(poles * np.abs(rec.speed[rows]) * time, ends), np.maximum(width, ends)


def ripple_time(actuator: ActuatorParameters) -> float:
    """Standard deviation (s) of the time in which a current i passes over, 3 L i / V: it is anywhere in the regulator's
    band when it begins to."""
    return 3.0 * actuator.inductance * actuator.hysteresis / (np.sqrt(12.0) * actuator.bus_voltage)


def _above_zero(z: np.ndarray) -> np.ndarray:
    """Mean of what a standard normal deviate about ``z`` has above zero."""
    return z * ndtr(z) + np.exp(-0.5 * z * z) / np.sqrt(2.0 * np.pi)


def noise_bands(state: State) -> list[np.ndarray]:
    """Diagonal of the noise's covariance (A2): the sensors' of true currents, which add up to nothing, when within the
    ripple a current passes over and by what the ends of its interval are off, and where the current that passes over
    changes within the interval."""
    rec, a = state.rec, state.rec.actuator
    change = rec.rows_from.current_change
    out = []
    for j in range(3):
        rows, low, high, edge = _edges(state, j)
        stays = np.abs(rec.current[rows, STAYS[j]])
        reach, width = _spread(state, j, low, high)
        inside = ndtr((high - edge.value) / reach) - ndtr((low - edge.value) / reach)
        share = np.clip((high - edge.value) / width, 0.0, 1.0)
        ends = a.pole_pairs * rec.angle_noise[rows] / width
        off = (ripple_time(a) / rec.interval) ** 2 + (share**2 + (1.0 - share) ** 2) * ends**2
        passing = inside * np.minimum(off, WIDEST) * stays**2
        # of two currents that add up to nothing with the third, the second times the share
        c, k = rec.current_covariance, STAYS[j]
        sensors = (c[j, j] + 2.0 * share * c[j, k] + share**2 * c[k, k]) * rec.noise.current**2
        # of a current that changes evenly in the interval, the share has another mean than the whole
        bent = 0.5 * share * (1.0 - share) * change[rows]
        out.append(sensors + passing + bent**2)
    return [np.concatenate(out)]

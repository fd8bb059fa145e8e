"""v_j = R_j i_j + d(flux)/dt + e_j of each phase, means over the interval: exact for any motion within it.

The mean of e_j is k_j times the integral of f over the angle swept, the mean of the flux term the difference of the
flux between the interval's ends.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.ndimage import binary_dilation

from ..switches import direction
from .acquisition import bent, drifted, dropped, gain_of_its_own, recorded_late
from .commutation import EDGE, LONGEST, REACH, rows_of, sweep
from .dual import Dual, Number, value_of
from .point import State, effect_name
from .signals import passing_time
from .terms import with_hook
from .windings import MUTUAL, factor, saliency

RUN = 1e-3  # s, longest run of intervals that is averaged in motion
RESTING = 5e-2  # s, at rest
LENGTHS = (0.5, 1.0)  # of the longest, drawn for each run
UNKNOWN = 0.2  # of the inductance's voltage, where no end currents tell of tolerance and saturation
TURNING = 0.5  # of a drop of the switches, that is not known of a current while its direction turns
BESIDE = 2  # intervals in which a current may fade after its phase is switched off
NAMES = ("electrical_a", "electrical_b", "electrical_c")


def voltages(state: State) -> list[Dual]:
    """Mean true voltage of each phase, terminal to star point, without that of the inductance (V)."""
    rec, a = state.rec, state.rec.actuator
    out = []
    state.rise, state.inductance, fluxes = [], [], []
    for j in range(3):
        flux = state.current_end[j]
        if rec.current_end is None:  # to the ripple, by which it is off, its own errors are nothing
            flux = Dual(flux.value)
        for m in with_hook("flux"):
            flux = m.flux(state.p.of(effect_name(m)), flux)
        by_angle = saliency(state.p, rec, j)
        if isinstance(by_angle, Dual):
            flux = flux + flux * by_angle
        L: Dual | float = factor(state.p, "inductance", j) * a.inductance
        for m in with_hook("inductance"):
            L = L * m.inductance(state.p.of(effect_name(m)), rec, j)
        L = L * state.turns[j] * state.turns[j]
        state.inductance.append(float(value_of(L)))
        fluxes.append(flux.linear(_difference, rec.size) * (a.inductance / rec.interval))
        state.rise.append(fluxes[j] * (L * (1.0 / a.inductance)))
        back_emf = np.asarray(value_of(state.k[j] * state.swept[j]))
        by_calm = state.k[j] * state.regressor[j]
        out.append(state.resistance[j] * state.current[j] + Dual(back_emf, by_calm.slopes))
    for name, (j, q) in MUTUAL.items():
        share = state.p(name)
        if share.slopes or share.value:
            state.rise[j], state.rise[q] = state.rise[j] + share * fluxes[q], state.rise[q] + share * fluxes[j]
    state.rise = [_known_rise(state, j, rise) for j, rise in enumerate(state.rise)]
    return out


def _known_rise(state: State, j: int, rise: Dual) -> Dual:
    """Without end currents the derivatives are known across commutations alone."""
    if state.rec.current_end is not None:
        return rise
    across = _runs(state, j).across
    return Dual(rise.value, {n: np.where(across, s, 0.0) for n, s in rise.slopes.items()})


def _difference(x: np.ndarray) -> np.ndarray:
    out = np.array(x, float)
    out[1:] -= x[:-1]
    return out


def residuals(state: State) -> dict[str, Dual]:
    """Recorded less predicted voltage (V) of each phase."""
    rec = state.rec
    true = recorded(state, [v + rise for v, rise in zip(voltages(state), state.rise, strict=True)])
    out = {}
    for j, name in enumerate(NAMES):
        residual = rec.voltage[:, j] - true[j] - drifted(state.p, "voltage", "abc"[j], rec)
        if rec.current_end is None:
            of = averaging(state, j)
            residual = residual.linear(lambda x, of=of: of(x), rec.size)
        out[name] = residual
    return out


def recorded(state: State, true: list[Dual]) -> list[Dual]:
    """What is recorded of the true voltages: lag, gains, the star point, the channels' curves, the switches' drop."""
    p, rec, a = state.p, state.rec, state.rec.actuator
    true = [recorded_late(p, "voltage", v, state.rec.size, j) for j, v in zip("abc", true, strict=True)]
    for m in sorted(with_hook("voltage"), key=lambda m: getattr(m, "RECORDED_LAST", False)):
        true = [m.voltage(p.of(effect_name(m)), j, true) for j in range(3)]
    true = [v * gain_of_its_own(p, "voltage", j, state.rec) for j, v in zip("abc", true, strict=True)]
    true = [_with_crosstalk(state, j, true) for j in range(3)]
    bends = [bent(p, "voltage", j, v, a) for j, v in zip("abc", true, strict=True)]
    drops = [dropped(p, j, i) for j, i in zip("abc", rec.current.T, strict=True)]
    return [v - bend + drop for v, bend, drop in zip(true, bends, drops, strict=True)]


def _with_crosstalk(state: State, j: int, voltages: list[Dual]) -> Dual:
    """What the channel of phase j records of its voltage and of the others'."""
    out = voltages[j]
    for q in (q for q in range(3) if q != j):
        gain = state.p(f"crosstalk_voltage.{'abc'[j]}{'abc'[q]}")
        if gain.slopes or gain.value:
            out = out + gain * voltages[q]
    return out


def usable(state: State, j: int) -> np.ndarray:
    """(row,) which rows count."""
    if state.rec.current_end is None:
        return np.ones(len(_runs(state, j).starts), bool)
    out = np.ones(state.rec.size, bool)
    out[0] = out[-1] = False
    return out


@dataclass(frozen=True)
class Runs:
    """Intervals that are averaged to one row where no end currents are recorded, and those that cross a commutation."""

    rows: np.ndarray  # (sample,) intervals that belong to a run, in their order
    starts: np.ndarray  # (run,) where each begins among ``rows``
    lengths: np.ndarray  # (run,) intervals in it
    across: np.ndarray  # (interval,) bool: of a run in which the phase is switched on or off
    crosses: np.ndarray  # (run,) bool: the same of the run

    def mean(self, x: np.ndarray) -> np.ndarray:
        """(run,) of (interval,)."""
        return np.add.reduceat(np.asarray(x, float)[self.rows], self.starts) / self.lengths

    def beside(self, x: np.ndarray) -> np.ndarray:
        """(run,) sum over the intervals before and after each run of (interval,)."""
        return x[self.rows[self.starts] - 1] + x[self.rows[self.starts + self.lengths - 1] + 1]


def averaging(state: State, j: int) -> Callable[[np.ndarray], np.ndarray]:
    """Means over runs of intervals, where no end currents are recorded: (interval,) -> (run,).

    The flux's change over a run is that between its ends, so that the ripple in between drops out, which neighbouring
    means do not tell and which goes with the ripple of the regressors. A run that crosses a commutation has its phase's
    whole current as its change, and so tells the inductance to the ripple at the end at which it conducts.
    """
    return _runs(state, j).mean


def _runs(state: State, j: int) -> Runs:
    """Runs of phase j: between its commutations, and one across each of them or of several that lie close."""
    rec = state.rec.rows_from
    return rec.once(("runs", j), lambda: _new_runs(state, j))


def _new_runs(state: State, j: int) -> Runs:
    rec = state.rec.rows_from
    crossing = np.zeros(rec.size, bool)
    for edge in (j, (j + 1) % 3):
        for rows, after in ((rows_of(state, edge), 1), *_slow_edges(rec, edge)):
            for shift in range(-1, after + 1):
                crossing[np.clip(rows + shift, 0, rec.size - 1)] = True
    rows = np.arange(1, rec.size - 1)
    kind = np.where(crossing, 2, rec.moving)[rows]
    # at rest the ripple is the same again and again, and beats with short runs in a way that motion does not
    fresh = np.concatenate([[True], np.diff(kind) != 0])
    # ends that follow commutations regularly would show the ripple, aliased, as a wave at constant speed
    rng = np.random.default_rng(0)
    starts = []
    for at, end in pairwise([*np.flatnonzero(fresh), len(rows)]):
        if kind[at] == 2:
            starts.append(at)
            continue
        longest = (RUN if kind[at] else RESTING) / rec.interval
        while at < end:
            starts.append(at)
            at += max(1, round(longest * rng.uniform(*LENGTHS)))
    first = np.array(starts)
    return Runs(rows, first, np.diff(first, append=len(rows)), crossing, crossing[rows[first]])


def _slow_edges(rec, edge: int) -> list[tuple[np.ndarray, int]]:
    """Intervals with an edge at which a current takes too long to pass over within one, and how many it takes; where
    a phase, off, rests for longer than that before it is on again."""
    low, high, _ = sweep(rec, edge)
    there = np.flatnonzero((low < REACH) & (high > -REACH) & rec.moving)
    takes = passing_time(rec.actuator, np.abs(rec.current[there]).max(axis=1)) / rec.interval
    rests = (np.pi / 3.0) / np.maximum(high - low, 1e-12)[there]
    after = 1 + np.ceil(takes).astype(int)
    slow = (takes > LONGEST) & (rests > after + 4)  # two intervals of rest on either side
    return [(there[slow & (after == n)], n) for n in np.unique(after[slow]).tolist()]


def switched_on(state: State, j: int) -> np.ndarray:
    """(sample,) where phase j conducts at any time of an interval or of the ``BESIDE`` next to it on either side."""
    rec = state.rec.rows_from
    return rec.once(("switched_on", j), lambda: binary_dilation(conducts(state, j), iterations=BESIDE))


def conducts(state: State, j: int) -> np.ndarray:
    """(sample,) where phase j conducts at any time of an interval."""
    rec = state.rec.rows_from
    return rec.once(("conducts", j), lambda: _conducts(rec, j))


def _conducts(rec, j: int) -> np.ndarray:
    x = np.mod(rec.actuator.pole_pairs * rec.middle - rec.axis[j], np.pi)
    reach = EDGE - REACH - rec.actuator.pole_pairs * np.abs(rec.half_sweep)
    return (x > reach) & (x < np.pi - reach)


def noise_bands(state: State, j: int) -> list[np.ndarray]:
    """Diagonals of the noise's covariance (V2): white, and that of differenced end currents and angles."""
    p, rec, a, s = state.p, state.rec, state.rec.actuator, state.rec.noise
    # a current that is less the sum of two has the noise of both
    of_mean, of_end = (2.0 if j == rec.derived else float(shares[j]) for shares in rec.shares)
    white: Number = s.voltage**2 + of_mean * (a.resistance * s.current) ** 2
    if drop := sum(float(p(f"drop.{of}").value) for of in ("voltage", f"voltage_{'abc'[j]}")):
        turned = direction(rec.current[:, j], float(p("drop.turn").value))
        white = white + (TURNING * drop * (1.0 - turned**2)) ** 2
    f = np.asarray(value_of(state.conducting[j]))
    angle = (a.back_emf * rec.angle_noise / rec.interval) ** 2 * f * f
    if rec.current_end is None:
        runs = _runs(state, j)
        of, lengths = runs.mean, runs.lengths
        white = of(np.broadcast_to(white, rec.size))
        # at a run's ends the mean of two neighbours is off by the ripple, and by a sixth of the curvature
        i = rec.current[:, j]
        bend = np.abs(np.diff(i, 2, prepend=i[:1], append=i[-1:])) / 6.0
        ripple = a.hysteresis**2 / 3.0
        between = 2.0 * of(switched_on(state, j) * ripple + bend**2)
        across = runs.beside(conducts(state, j) * ripple + bend**2)
        ends = (state.inductance[j] / rec.interval / lengths) ** 2 * np.where(runs.crosses, across, between)
        unknown = np.where(runs.crosses, 0.0, UNKNOWN * of(np.asarray(value_of(state.rise[j])))) ** 2
        return [(white + 2.0 * of(angle) / lengths) / lengths + ends + unknown]
    differenced = of_end * (a.inductance / rec.interval * s.current_end) ** 2 + angle
    before = np.concatenate([differenced[:1], differenced[:-1]])
    return [white + differenced + before, -differenced[:-1]]

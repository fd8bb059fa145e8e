"""v_j = R_j i_j + d(flux)/dt + e_j of each phase, means over the interval: exact for any motion within it.

The mean of e_j is k_j times the integral of f over the angle swept, the mean of the flux term the difference of the
flux between the interval's ends.
"""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from scipy.ndimage import binary_dilation

from .acquisition import bent, recorded_late
from .commutation import EDGE, REACH, rows_of
from .dual import Dual, value_of
from .point import State, effect_name
from .terms import with_hook

RUN = 1e-3  # s, longest run of intervals that is averaged in motion
RESTING = 5e-2  # s, at rest
LENGTHS = (0.5, 1.0)  # of the longest, drawn for each run
UNKNOWN = 0.2  # of the inductance's voltage, where no end currents tell of tolerance and saturation
BESIDE = 2  # intervals in which a current may fade after its phase is switched off
NAMES = ("electrical_a", "electrical_b", "electrical_c")


def voltages(state: State) -> list[Dual]:
    """Mean true voltage of each phase, terminal to star point, without that of the inductance (V)."""
    rec, a = state.rec, state.rec.actuator
    out = []
    state.rise = []
    for j in range(3):
        flux = state.current_end[j]
        for m in with_hook("flux"):
            flux = m.flux(state.p.of(effect_name(m)), flux)
        L: Dual | float = a.inductance
        for m in with_hook("inductance"):
            L = L * m.inductance(state.p.of(effect_name(m)), rec, j)
        L = L * state.turns[j] * state.turns[j]
        rise = L * flux.linear(_difference, rec.size) * (1.0 / rec.interval)
        if rec.current_end is None:  # the ripple outweighs what neighbouring means tell of the flux
            rise = Dual(rise.value) + state.p(f"ends.{'abc'[j]}@{rec.name}") * _by_curvature(state, j)
        state.rise.append(rise)
        back_emf = np.asarray(value_of(state.k[j] * state.swept[j]))
        by_calm = state.k[j] * state.regressor[j]
        out.append(state.resistance[j] * state.current[j] + Dual(back_emf, by_calm.slopes))
    return out


def _difference(x: np.ndarray) -> np.ndarray:
    out = np.array(x, float)
    out[1:] -= x[:-1]
    return out


def _by_curvature(state: State, j: int) -> np.ndarray:
    """Voltage (V) of the inductance that the mean of two neighbouring means of the current lacks for its curvature.

    A cubic through four means has an end a twelfth of both second differences below their mean. Where a current sets
    in, fades or is chopped within an interval it is off by another amount, but in the same way each time.
    """
    rec = state.rec
    i = rec.current[:, j]
    bend = np.diff(i, 2, prepend=i[:1], append=i[-1:])
    below = -(bend + np.append(bend[1:], 0.0)) / 12.0
    return _difference(below) * (rec.actuator.inductance / rec.interval)


def residuals(state: State) -> dict[str, Dual]:
    """Recorded less predicted voltage (V) of each phase."""
    rec = state.rec
    true = _recorded(state, [v + rise for v, rise in zip(voltages(state), state.rise, strict=True)])
    share = rec.time / rec.time[-1]
    out = {}
    for j, name in enumerate(NAMES):
        drift = state.p(f"drift_voltage.{'abc'[j]}@{rec.name}")
        residual = rec.voltage[:, j] - true[j] - drift * share
        if rec.current_end is None:
            of = averaging(state, j)
            residual = residual.linear(lambda x, of=of: of(x), rec.size)
        out[name] = residual
    return out


def _recorded(state: State, true: list[Dual]) -> list[Dual]:
    """What is recorded of the true voltages: lag, gains, the star point, then the channels' curves."""
    p = state.p
    true = [recorded_late(p, "voltage", v, state.rec.size) for v in true]
    for m in sorted(with_hook("voltage"), key=lambda m: getattr(m, "RECORDED_LAST", False)):
        true = [m.voltage(p.of(effect_name(m)), j, true) for j in range(3)]
    return [v - bent(p, "voltage", "abc"[j], v, state.rec.actuator) for j, v in enumerate(true)]


def usable(state: State, j: int) -> np.ndarray:
    """(row,) which rows count."""
    if state.rec.current_end is None:
        return np.ones(len(_runs(state, j)[0]), bool)
    out = np.ones(state.rec.size, bool)
    out[0] = out[-1] = False
    return out


def averaging(state: State, j: int) -> Callable[[np.ndarray], np.ndarray]:
    """Means over runs of intervals between commutations, where no end currents are recorded: (sample,) -> (run,).

    The flux's change over a run is that between its ends, so that the ripple in between drops out, which neighbouring
    means do not tell and which goes with the ripple of the regressors.
    """
    starts, lengths, rows = _runs(state, j)
    return lambda x: np.add.reduceat(np.asarray(x, float)[rows], starts) / lengths


def _runs(state: State, j: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where runs begin among their rows, their lengths, and the rows (sample,): none around phase j's commutations."""
    rec = state.rec.rows_from
    return rec.once(("runs", j), lambda: _new_runs(state, j))


def _new_runs(state: State, j: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rec = state.rec.rows_from
    known = np.ones(rec.size, bool)
    known[[0, -1]] = False
    for edge in (j, (j + 1) % 3):
        for shift in (-1, 0, 1):
            known[np.clip(rows_of(state, edge) + shift, 0, rec.size - 1)] = False
    rows = np.flatnonzero(known)
    moves = rec.moving[rows]
    # at rest the ripple is the same again and again, and beats with short runs in a way that motion does not
    fresh = np.concatenate([[True], (np.diff(rows) > 1) | np.diff(moves)])
    # ends that follow commutations regularly would show the ripple, aliased, as a wave at constant speed
    rng = np.random.default_rng(0)
    starts = []
    for first, end in pairwise([*np.flatnonzero(fresh), len(rows)]):
        longest = (RUN if moves[first] else RESTING) / rec.interval
        at = first
        while at < end:
            starts.append(at)
            at += max(1, round(longest * rng.uniform(*LENGTHS)))
    return np.array(starts), np.diff(starts, append=len(rows)), rows


def switched_on(state: State, j: int) -> np.ndarray:
    """(sample,) where phase j conducts at any time of an interval or of the ``BESIDE`` next to it on either side."""
    rec = state.rec.rows_from
    return rec.once(("switched_on", j), lambda: _switched_on(rec, j))


def _switched_on(rec, j: int) -> np.ndarray:
    x = np.mod(rec.actuator.pole_pairs * rec.middle - rec.axis[j], np.pi)
    reach = EDGE - REACH - rec.actuator.pole_pairs * np.abs(rec.half_sweep)
    return binary_dilation((x > reach) & (x < np.pi - reach), iterations=BESIDE)


def noise_bands(state: State, j: int) -> list[np.ndarray]:
    """Diagonals of the noise's covariance (V2): white, and that of differenced end currents and angles."""
    rec, a, s = state.rec, state.rec.actuator, state.rec.noise
    white = s.voltage**2 + (a.resistance * s.current) ** 2
    f = np.asarray(value_of(state.conducting[j]))
    angle = (a.back_emf * s.angle / rec.interval) ** 2 * f * f
    if rec.current_end is None:
        of, (_, lengths, _) = averaging(state, j), _runs(state, j)
        # at a run's ends the mean of two neighbours is off by the ripple, and by a sixth of the curvature
        i = rec.current[:, j]
        bend = np.abs(np.diff(i, 2, prepend=i[:1], append=i[-1:])) / 6.0
        ends = switched_on(state, j) * a.hysteresis**2 / 3.0 + bend**2
        ends = 2.0 * (a.inductance / rec.interval / lengths) ** 2 * of(ends)
        unknown = (UNKNOWN * of(np.asarray(value_of(state.rise[j])))) ** 2
        return [(white + 2.0 * of(angle) / lengths) / lengths + ends + unknown]
    differenced = (a.inductance / rec.interval * s.current_end) ** 2 + angle
    before = np.concatenate([differenced[:1], differenced[:-1]])
    return [white + differenced + before, -differenced[:-1]]

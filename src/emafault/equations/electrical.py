"""v_j = R_j i_j + d(flux)/dt + e_j of each phase, means over the interval: exact for any motion within it.

The mean of e_j is k_j times the integral of f over the angle swept, the mean of the flux term the difference of the
flux between the interval's ends.
"""

import numpy as np
from scipy.ndimage import binary_dilation

from .acquisition import recorded_late
from .commutation import EDGE, REACH, rows_of
from .dual import Dual, value_of
from .point import State, effect_name
from .terms import with_hook

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
            rise = Dual(rise.value)
        state.rise.append(rise)
        back_emf = np.asarray(value_of(state.k[j] * state.swept[j]))
        by_calm = state.k[j] * state.regressor[j]
        out.append(state.resistance[j] * state.current[j] + Dual(back_emf, by_calm.slopes))
    return out


def _difference(x: np.ndarray) -> np.ndarray:
    return np.diff(x, prepend=0.0)


def residuals(state: State) -> dict[str, Dual]:
    """Recorded less predicted voltage (V) of each phase."""
    rec = state.rec
    true = _recorded(state, [v + rise for v, rise in zip(voltages(state), state.rise, strict=True)])
    share = rec.time / rec.time[-1]
    out = {}
    for j, name in enumerate(NAMES):
        drift = state.p(f"drift_voltage.{'abc'[j]}@{rec.name}")
        out[name] = rec.voltage[:, j] - true[j] - drift * share
    return out


def _recorded(state: State, true: list[Dual]) -> list[Dual]:
    """What is recorded of the true voltages: lag, gains, then the star point."""
    p = state.p
    true = [recorded_late(p, "voltage", v, state.rec.size) for v in true]
    for m in sorted(with_hook("voltage"), key=lambda m: getattr(m, "RECORDED_LAST", False)):
        true = [m.voltage(p.of(effect_name(m)), j, true) for j in range(3)]
    return true


def usable(state: State, j: int) -> np.ndarray:
    """(sample,) where the flux's change is known: without end currents not where the phase is switched on or off."""
    rec = state.rec
    out = np.ones(rec.size, bool)
    if rec.current_end is None:
        for edge in (j, (j + 1) % 3):
            for shift in (-1, 0, 1):
                out[np.clip(rows_of(state, edge) + shift, 0, rec.size - 1)] = False
    return out


def switched_on(state: State, j: int) -> np.ndarray:
    """(sample,) where phase j conducts at any time of an interval or of the ``BESIDE`` next to it on either side."""
    rec = state.rec.rows_from
    x = np.mod(rec.actuator.pole_pairs * rec.middle - rec.axis[j], np.pi)
    reach = EDGE - REACH - rec.actuator.pole_pairs * np.abs(rec.half_sweep)
    return binary_dilation((x > reach) & (x < np.pi - reach), iterations=BESIDE)


def noise_bands(state: State, j: int) -> list[np.ndarray]:
    """Diagonals of the noise's covariance (V2): white, and that of differenced end currents and angles."""
    rec, a, s = state.rec, state.rec.actuator, state.rec.noise
    white = s.voltage**2 + (a.resistance * s.current) ** 2
    f = np.asarray(value_of(state.conducting[j]))
    angle = (a.back_emf * s.angle / rec.interval) ** 2 * f * f
    if rec.current_end is None:  # the mean of two neighbours is off by the ripple, and by a sixth of the curvature
        i = rec.current[:, j]
        bend = np.abs(np.diff(i, 2, prepend=i[:1], append=i[-1:]))
        bend = np.maximum(bend, np.concatenate([bend[:1], bend[:-1]])) / 6.0
        on = switched_on(state, j)
        white = white + 2.0 * (a.inductance / rec.interval) ** 2 * (on * a.hysteresis**2 / 3.0 + bend**2)
        differenced = angle
    else:
        differenced = (a.inductance / rec.interval * s.current_end) ** 2 + angle
    before = np.concatenate([differenced[:1], differenced[:-1]])
    return [white + differenced + before, -differenced[:-1]]

"""The recorded speed against the rate of the recorded angle."""

import numpy as np

from .acquisition import recorded_late
from .dual import Dual
from .point import State, effect_name
from .terms import with_hook


def residual(state: State) -> Dual:
    """Recorded less predicted speed (rad/s).

    Its derivatives are taken of the smoothed speed, whose noise is nearly independent of the residual's.
    """
    rec = state.rec
    exact = recorded_late(state.p, "speed", seen_speed(state, Dual(rec.rate)), rec.size)
    return rec.speed_recorded - Dual(exact.value, predicted(state).slopes)


def predicted(state: State) -> Dual:
    """Recorded speed as the smoothed speed predicts it (rad/s)."""
    return recorded_late(state.p, "speed", seen_speed(state, Dual(state.rec.speed)), state.rec.size)


def seen_speed(state: State, w: Dual) -> Dual:
    """What the sensor makes of a true speed (rad/s)."""
    for m in with_hook("speed"):
        w = m.speed(state.p.of(effect_name(m)), state.rec, w)
    return w


def noise_bands(state: State) -> list[np.ndarray]:
    """Diagonals of the noise's covariance ((rad/s)2)."""
    rec = state.rec
    angle = (rec.noise.angle / rec.interval) ** 2
    rounded = (0.5 * rec.speed_step) ** 2  # next to a change
    return [
        np.full(rec.size, rec.noise.speed**2 + rounded + 2.0 * angle),
        np.full(rec.size - 1, -angle),
    ]


def usable(state: State) -> np.ndarray:
    """(sample,) all but the first and last, where the speed lies on a lattice those next to a change: in between, what
    rounding leaves is the same again and again, and on both sides of a change together it is nothing."""
    rec = state.rec
    changes = np.diff(rec.speed_recorded) != 0.0
    out = np.ones(rec.size, bool)
    if rec.speed_step > 0.0:
        out[1:-1] = changes[1:] | changes[:-1]
    out[0] = out[-1] = False
    return out

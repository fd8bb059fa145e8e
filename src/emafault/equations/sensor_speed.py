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
    return [
        np.full(rec.size, rec.noise.speed**2 + rec.speed_step**2 / 12.0 + 2.0 * angle),
        np.full(rec.size - 1, -angle),
    ]

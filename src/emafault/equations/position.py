"""theta_u against theta/ratio through the play, which is integrated along the measured angle."""

import numpy as np

from .acquisition import recorded_late
from .dual import Dual, value_of
from .flexible import through_play
from .point import State, effect_name
from .terms import with_hook


def shaft_angle(state: State) -> Dual:
    """Angle of the user shaft behind the gear's play and flexibility (rad)."""
    rec = state.rec
    value, slope = through_play(rec.turned / rec.actuator.gear_ratio, 0.5 * float(value_of(rec.play)))
    shaft = rec.play.through(value, 0.5 * slope)
    for m in with_hook("twist"):
        shaft = m.twist(state.p.of(effect_name(m)), rec, shaft)
    return shaft


def residual(state: State) -> Dual:
    """Recorded less predicted angle of the user shaft (rad)."""
    shaft = shaft_angle(state) + state.p(f"output_zero@{state.rec.name}")
    return state.rec.output - recorded_late(state.p, "output", shaft, state.rec.size)


def noise_bands(state: State) -> list[np.ndarray]:
    """Diagonal of the noise's covariance (rad2)."""
    rec = state.rec
    return [np.full(rec.size, rec.noise.position**2 + (rec.noise.angle / rec.actuator.gear_ratio) ** 2)]

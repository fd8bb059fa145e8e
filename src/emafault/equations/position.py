"""theta_u against theta/ratio through the play, which is integrated along the measured angle."""

import numpy as np

from .acquisition import drifted, recorded_late
from .dual import Dual, value_of
from .flexible import through_play
from .point import State, effect_name
from .rounding import harmonics
from .terms import with_hook

SCALED = ("recorder", "sensor")  # whose scale of the output may be off: the controller sees its sensor's


def shaft_angle(state: State) -> Dual:
    """Angle of the user shaft behind the gear's play and flexibility (rad)."""
    rec = state.rec
    value, slope = through_play(rec.turned / rec.actuator.gear_ratio, 0.5 * float(value_of(rec.play)))
    shaft = rec.play.through(value, 0.5 * slope)
    for m in with_hook("twist"):
        shaft = m.twist(state.p.of(effect_name(m)), rec, shaft)
    return shaft


def scaled(state: State, shaft: Dual, whose: str) -> Dual | float:
    """(sample,) what a scale of the output position that is off adds to the shaft's angle (rad); ``whose``: of
    ``SCALED``."""
    gain = state.p(f"gain_output.{whose}")
    return gain * shaft if gain.slopes or gain.value else 0.0


def residual(state: State) -> Dual:
    """Recorded less predicted angle of the user shaft (rad)."""
    shaft = shaft_angle(state)
    for whose in SCALED:
        shaft = shaft + scaled(state, shaft, whose)
    shaft = shaft + state.p(f"output_zero@{state.rec.name}")
    seen = recorded_late(state.p, "output", shaft + _rounding(state, shaft), state.rec.size)
    return state.rec.output - (seen + drifted(state.p, "output", "all", state.rec))


def _rounding(state: State, shaft: Dual) -> Dual:
    """What an output in coarse counts q is off by: sum of (-1)^k q/(pi k) sin(2 pi k x/q) of the true angle x (Widrow
    and Kollar 2008, Quantization Noise, chapter 3), less where noise shakes it, and with the phase left open."""
    out = Dual(0.0)
    if state.rec.output_step == 0.0:
        return out
    place = 2.0 * np.pi * np.asarray(shaft.value) / state.rec.output_step
    for name, k, function in harmonics("counts", state.rec.name):
        out = out + state.p(name) * function(k * place)
    return out


def noise_bands(state: State) -> list[np.ndarray]:
    """Diagonal of the noise's covariance (rad2)."""
    rec = state.rec
    return [rec.noise.position**2 + (rec.angle_noise / rec.actuator.gear_ratio) ** 2]

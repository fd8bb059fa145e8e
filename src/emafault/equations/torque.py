"""J dw/dt = T_e - B w - T_load - T_F, in the second difference of the recorded angle.

Both sides are averaged over the triangle of two intervals that the second difference weighs an acceleration with: what
goes along the angle exactly (hook ``between``), means over intervals as those of something that bends but little.
Samples around rest are left out: dry friction has no known sign there.
"""

import numpy as np

from .dual import Dual, value_of
from .point import State, effect_name
from .signals import UNRESOLVED
from .terms import with_hook
from .windings import saliency_slope


def net_torque(state: State) -> Dual:
    """Mean torque on the rotor in each interval (N m)."""
    rec, a = state.rec, state.rec.actuator
    drive = [state.k[j] * state.conducting[j] * state.current[j] for j in range(3)]
    state.drive = sum((np.asarray(d.value) for d in drive), np.zeros(rec.size))
    state.shared = state.drive
    level: Dual | float = a.coulomb_friction
    for m in with_hook("friction"):
        level = level * m.friction(state.p.of(effect_name(m)), rec)
    viscous: Dual | float = a.viscous_friction
    for m in with_hook("viscous"):
        viscous = viscous * m.viscous(state.p.of(effect_name(m)))
    net = drive[0] + drive[1] + drive[2] - viscous * rec.speed - level * rec.direction
    for j in range(3):
        slope = saliency_slope(state.p, rec, j)
        if isinstance(slope, Dual):
            square = np.square(np.asarray(state.current[j].value)) * np.asarray(state.turns[j].value) ** 2
            net = net + slope * (0.5 * a.inductance * square)
    loads = [m.torque(state.p.of(effect_name(m)), rec) for m in with_hook("torque")]
    for load in loads if rec.flexible else [*loads, state.own_load]:
        net = net - load
        state.shared = state.shared - np.asarray(load.value)
    return net


def _beyond_means(state: State) -> Dual | float:
    """(sample,) what terms that go along the angle have, over two intervals, beyond what their means have (N m)."""
    out: Dual | float = 0.0
    for m in with_hook("between"):
        p = state.p.of(effect_name(m))
        out = out + m.between(p, state.rec) - m.torque(p, state.rec).linear(two_intervals, state.rec.size)
    return out


def residual(state: State) -> Dual:
    """J0 times the measured acceleration less that of the model (N m)."""
    rec, a = state.rec, state.rec.actuator
    inertia: Dual | float = 1.0
    for m in with_hook("inertia"):
        inertia = inertia * m.inertia(state.p.of(effect_name(m)))
    for m in with_hook("rotor_share"):
        inertia = inertia * m.rotor_share(state.p.of(effect_name(m)), rec)
    state.inertia = float(value_of(inertia))
    net = net_torque(state)
    state.net = np.asarray(net.value)
    balance = (net.linear(two_intervals, rec.size) - _beyond_means(state)) / inertia
    theta = rec.angle
    second = np.zeros(rec.size)
    second[1:-1] = (theta[2:] - 2.0 * theta[1:-1] + theta[:-2]) / rec.interval**2
    return a.inertia * second - balance


def two_intervals(x: np.ndarray) -> np.ndarray:
    """Mean over an interval and the next, at the angle sample between them."""
    out = np.array(x, copy=True)
    out[:-1] = 0.5 * (x[:-1] + x[1:])
    return out


def usable(state: State) -> np.ndarray:
    """(sample,) where the rotor moves throughout, and the mean currents tell the torque."""
    known = state.rec.moving & state.rec.resolved
    out = known & np.roll(known, -1)
    out[:2] = out[-2:] = False
    return out


def noise_bands(state: State) -> list[np.ndarray]:
    """Diagonals of the noise's covariance ((N m)2)."""
    rec, a, s = state.rec, state.rec.actuator, state.rec.noise
    angle = (a.inertia * rec.angle_noise / rec.interval**2) ** 2
    before, later = np.append(angle[:1], angle[:-1]), np.append(angle[1:], angle[-1:])
    current = _of_pair(state) * (a.back_emf * s.current / state.inertia) ** 2
    after = np.append(current[1:], current[-1:])
    change = np.abs(np.diff(state.shared, append=state.shared[-1:]))
    change = np.maximum(change, np.concatenate([change[:1], change[:-1]]))
    return [
        before + 4.0 * angle + later + 0.25 * (current + after) + (UNRESOLVED / state.inertia * change) ** 2,
        -2.0 * (angle[:-1] + angle[1:]) + 0.25 * after[:-1],
        angle[1:-1],
    ]


def _of_pair(state: State) -> np.ndarray:
    """(sample,) variance of what the currents' noise makes of the torque, in units of a sensor's times k squared: that
    of two sensors, or what it is where these differ or one has none."""
    rec = state.rec
    if rec.derived is None and (rec.shares[0] == 1.0).all():
        return np.full(rec.size, 2.0)
    shape = np.array([np.broadcast_to(np.asarray(value_of(f)), rec.size) for f in state.conducting])
    return np.einsum("jn,jk,kn->n", shape, rec.current_covariance, shape)

"""The mechanics of the fixed step: rotor, friction, transmission and load, over one step."""

from typing import NamedTuple

import numpy as np

from ..compiled import compiled_inline
from .forms import (
    F_ASYMMETRY,
    F_COGGING,
    F_COLD,
    F_INERTIA,
    F_LEVEL,
    F_LOAD,
    F_SPRING,
    F_STRIBECK,
    F_VISCOUS,
)
from .unlisted import AT_INERTIA, AT_TORQUE, AT_TORQUE_CONSTANT

SLOTS = 72.0


class Mechanics(NamedTuple):
    """Constants of a run: gear ratio, inertia of motor and shaft (kg m2), dry friction (N m), whether it bends."""

    ratio: float
    J_motor: float
    J_shaft: float
    coulomb: float
    compliant: bool


class Motion(NamedTuple):
    """State: rotor and user shaft (rad, rad/s), the rotor's acceleration (rad/s2), a bristle (rad), a disc (rad/s)."""

    theta: float
    w: float
    acceleration: float
    theta_u: float
    w_u: float
    bristle: float
    w_disc: float


@compiled_inline
def mechanics_of(record, forms):
    """Constants of a run."""
    ambient, ratio, beta = record.dT, record.gear_ratio, record.friction_temperature_beta
    coulomb = record.coulomb_friction * record.friction_level_scale
    coulomb *= np.exp(beta * ambient) if forms[F_COLD] else max(0.0, 1.0 + beta * ambient)
    J = record.inertia if forms[F_INERTIA] else record.inertia * record.inertia_scale
    compliant = record.compliance_K > 0.0
    return Mechanics(ratio, 0.7 * J if compliant else J, 0.3 * J * ratio * ratio, coulomb, compliant)


@compiled_inline
def load_torque(record, forms, now, theta_u):
    """Torque of the load (N m) at a time (s) and angle of the user shaft (rad)."""
    T_load = record.load_constant_T
    if forms[F_LOAD]:
        T_load *= 1.0 - 0.2 * np.exp(-now / 0.1)
    stiffness = record.load_spring_c
    if forms[F_SPRING]:
        stiffness *= 1.0 + 0.3 * (theta_u / 0.15) ** 2
    T_load += stiffness * theta_u
    return T_load


@compiled_inline
def friction_torque(record, forms, coulomb, theta, w, active, bristle, dt):
    """Friction (N m) against the torque that drives the rotor (N m), and the bristle (rad) after dt (s)."""
    direction = np.sign(w) if w != 0.0 else np.sign(active)
    level = coulomb
    if forms[F_LEVEL]:
        level *= 1.0 + 0.1 * np.cos(theta)
    asymmetry = record.friction_asymmetry_a * direction
    if forms[F_ASYMMETRY]:
        asymmetry = record.friction_asymmetry_a * np.tanh(w / 3.0)
    level *= 1.0 + asymmetry
    bump = record.stribeck_a
    static = max(record.static_over_coulomb * level, level + bump)
    if bump != 0.0:
        sliding = level + bump * np.exp(-abs(w) / record.stribeck_w_s)
    else:
        sliding = level
    if forms[F_STRIBECK]:
        peak = sliding + max(0.0, static - level - bump) * np.exp(-((w / 0.2) ** 2))
        before = bristle
        bristle = (bristle + w * dt) / (1.0 + 60.0 * abs(w) / peak * dt)
        T_F = 60.0 * bristle + 0.02 * (bristle - before) / dt
    elif w == 0.0:
        T_F = min(max(active, -static), static)
    else:
        T_F = sliding * direction
    return T_F, bristle


@compiled_inline
def moved(record, forms, mechanics, motion, torque, T_load, T_shaft, play, added, dt):
    """Take the motion over a step.

    Parameters
    ----------
    torque : of the motor, mean of the step (N m)
    T_load, T_shaft, play : torques of the load and of the transmission at the user shaft (N m), play in it (rad)
    added : (place,) what no catalogue lists
    dt : length of the step (s)

    Returns
    -------
    the motion after it, and the mean speed in it (rad/s)
    """
    ratio, J_motor, J_shaft, coulomb, compliant = mechanics
    theta, w, _, theta_u, w_u, bristle, w_disc = motion
    B = record.viscous_friction
    drag = B * record.viscous_friction_scale * w
    if forms[F_VISCOUS]:
        drag = B * w + (record.viscous_friction_scale - 1.0) * B * np.sign(w) * abs(w) ** 0.8 * 100.0**0.2
    active = torque * (1.0 + added[AT_TORQUE_CONSTANT]) - drag + added[AT_TORQUE]
    if record.cogging_a != 0.0:
        active -= record.cogging_a * np.sin(SLOTS * theta)
    if forms[F_COGGING]:
        active -= 0.25 * record.cogging_a * np.sin(2.0 * SLOTS * theta + 0.5)
    active -= T_shaft / ratio
    if forms[F_INERTIA]:
        coupling = (record.inertia_scale - 1.0) * record.inertia / 2e-3
        active -= coupling * (w - w_disc)
        w_disc += dt * (w - w_disc) / 2e-3
    T_F, bristle = friction_torque(record, forms, coulomb, theta, w, active, bristle, dt)
    w_new = w + dt * (active - T_F) / (J_motor * (1.0 + added[AT_INERTIA]))
    if not forms[F_STRIBECK] and w * w_new < 0.0:
        w_new = 0.0
    acceleration = (w_new - w) / dt
    theta += 0.5 * dt * (w + w_new)
    position = (theta - record.theta_0) / ratio
    if compliant:
        w_u += dt * (T_shaft - T_load - 2.0 * w_u) / J_shaft
        theta_u += dt * w_u
        if abs(theta_u) >= record.end_stop:
            theta_u, w_u = np.sign(theta_u) * record.end_stop, 0.0
    else:
        theta_u = min(max(theta_u, position - 0.5 * play), position + 0.5 * play)
        if abs(theta_u) >= record.end_stop and theta_u * w_new > 0.0:
            side = np.sign(theta_u)
            theta_u, w_new = side * record.end_stop, 0.0
            theta = record.theta_0 + ratio * (theta_u + side * 0.5 * play)
    return Motion(theta, w_new, acceleration, theta_u, w_u, bristle, w_disc), 0.5 * (w + w_new)

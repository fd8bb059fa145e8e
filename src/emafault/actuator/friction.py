"""Dry friction in the Borello form, with the catalogue's friction effects."""

import numpy as np

from ..compiled import compiled


@compiled
def coulomb_torque(p, direction):
    """Sliding Coulomb torque T_c (N m) of this unit at its temperature for motion in ``direction`` (+1 or -1)."""
    level = p.coulomb_friction * p.friction_level_scale * (1.0 + p.friction_temperature_beta * p.dT)
    return level * (1.0 + p.friction_asymmetry_a * direction)


@compiled
def sliding_torque(p, coulomb, speed):
    """Sliding friction T_c + a exp(-|w|/w_s) (N m) and its slope by |w| (N m s/rad); ``speed`` = |w| (rad/s)."""
    if p.stribeck_a == 0.0:
        return coulomb, 0.0
    extra = p.stribeck_a * np.exp(-speed / p.stribeck_w_s)
    return coulomb + extra, -extra / p.stribeck_w_s


@compiled
def static_limit(p, coulomb):
    """Largest torque held at rest (N m): FSD T_c, never below the sliding friction at w = 0."""
    return max(p.static_over_coulomb * coulomb, coulomb + p.stribeck_a)

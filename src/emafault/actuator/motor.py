"""Motor: phase constants under faults and effects, the trapezoid, and the table of electrical-angle cells.

A *cell* is a stretch of electrical angle in which the trapezoid of every phase is linear and the commutation does not
change; the simulation only has to notice when the rotor passes from one cell to the next.
"""

import numpy as np

from ..compiled import compiled
from .grammar import ORDERS

TWO_PI = 2.0 * np.pi
AXIS = np.array([0.0, TWO_PI / 3.0, 2.0 * TWO_PI / 3.0])  # alpha_j, electrical rad
MAX_CELLS = 20
#: phase switched on at the commutation edges 30, 90, ... 330 degrees, and the (+, -) pair from there on
SWITCHED_ON = np.array([0, 2, 1, 0, 2, 1])
PAIR = np.array([[0, 1], [0, 2], [1, 2], [1, 0], [2, 0], [2, 1]])


@compiled
def trapezoid(x, ramp):
    """Unit trapezoid f(x) and its slope; x electrical rad, ``ramp`` = (pi - plateau width)/2 (pi/6 for 120 degrees)."""
    x -= TWO_PI * np.floor(x * (1.0 / TWO_PI))  # several times faster than the remainder operator
    if x < ramp:
        return x / ramp, 1.0 / ramp
    if x < np.pi - ramp:
        return 1.0, 0.0
    if x < np.pi + ramp:
        return (np.pi - x) / ramp, -1.0 / ramp
    if x < TWO_PI - ramp:
        return -1.0, 0.0
    return (x - TWO_PI) / ramp, 1.0 / ramp


@compiled
def phase_constants(p, R_winding, L, k):
    """Fill R_j at the reference temperature (ohm), L_j (H) and k_j (V s/rad, angle dependence apart), each (phase,)."""
    magnet = 1.0 + p.magnet_temperature_alpha_m * p.dT_magnet
    for j in range(3):
        turns = 1.0 - p.shorted_turns[j]
        R_winding[j] = p.resistance * p.unit_calibration_R_scale * turns
        L[j] = p.inductance * p.inductance_tolerance_L_scale * turns * turns * (1.0 + p.inductance_share[j])
        k[j] = p.back_emf * p.unit_calibration_k_scale * turns * magnet * (1.0 + p.back_emf_share[j])
        if p.eccentricity_law == 0:
            k[j] *= 1.0 + p.eccentricity[0] * np.cos(AXIS[j]) + p.eccentricity[1] * np.sin(AXIS[j])


@compiled
def angle_modulation(p, theta, j):
    """g_j(theta) of the rotor-angle eccentricity laws and dynamic eccentricity, dg/dtheta and d2g/dtheta2."""
    g, dg, ddg = 1.0, 0.0, 0.0
    if p.eccentricity_law > 0:
        angle = theta - (AXIS[j] if p.eccentricity_law == 2 else 0.0)
        c, s = np.cos(angle), np.sin(angle)
        ddg = -(p.eccentricity[0] * c + p.eccentricity[1] * s)
        g -= ddg
        dg += p.eccentricity[1] * c - p.eccentricity[0] * s
    if p.dynamic_eccentricity_d != 0.0:
        angle = theta - AXIS[j] - p.dynamic_eccentricity_psi
        swing, d1 = p.dynamic_eccentricity_d * np.cos(angle), -p.dynamic_eccentricity_d * np.sin(angle)
        ddg = ddg * (1.0 + swing) + 2.0 * dg * d1 - g * swing
        dg = dg * (1.0 + swing) + g * d1
        g *= 1.0 + swing
    return g, dg, ddg


@compiled
def modulate(p, theta, j, f, df):
    """Add the shape's harmonics and the angle modulation of phase j to the trapezoid f and its derivative by theta.

    Returns the coefficient and its first and second derivative by theta.
    """
    ddf = 0.0
    if p.back_emf_shape_h5 != 0.0 or p.back_emf_shape_h7 != 0.0:
        x = p.pole_pairs * theta - AXIS[j]
        fifth, seventh = p.back_emf_shape_h5 * np.sin(5.0 * x), p.back_emf_shape_h7 * np.sin(7.0 * x)
        slope = 5.0 * p.back_emf_shape_h5 * np.cos(5.0 * x) + 7.0 * p.back_emf_shape_h7 * np.cos(7.0 * x)
        f += fifth + seventh
        df += p.pole_pairs * slope
        ddf = -p.pole_pairs * p.pole_pairs * (25.0 * fifth + 49.0 * seventh)
    if has_more_harmonics(p):
        x = p.pole_pairs * theta - AXIS[j]
        for m in range(len(ORDERS)):
            n, size = ORDERS[m], p.emf_harmonics[m]
            wave = size * np.sin(n * x)
            f += wave
            df += p.pole_pairs * n * size * np.cos(n * x)
            ddf -= (p.pole_pairs * n) ** 2 * wave
    g, dg, ddg = angle_modulation(p, theta, j)
    return f * g, df * g + f * dg, ddf * g + 2.0 * df * dg + f * ddg


@compiled
def is_modulated(p):
    """Whether k_j depends on the angle by more than the trapezoid."""
    eccentric = p.eccentricity_law > 0 and (p.eccentricity[0] != 0.0 or p.eccentricity[1] != 0.0)
    harmonic = p.back_emf_shape_h5 != 0.0 or p.back_emf_shape_h7 != 0.0
    return eccentric or harmonic or has_more_harmonics(p) or p.dynamic_eccentricity_d != 0.0


@compiled
def has_more_harmonics(p):
    """Whether the shape of the back-EMF has harmonics that no catalogue lists."""
    return np.any(p.emf_harmonics != 0.0)


@compiled
def build_cells(p, edge, value, slope, pair):
    """Fill the cell table and return the number of cells.

    ``edge`` (cell,) lower electrical angle (rad), ``value`` and ``slope`` (cell, phase) of f at that edge, ``pair``
    (cell, 2) phases driven + and -. An angle offset moves every commutation, a Hall displacement those of its phase.
    """
    ramp = 0.5 * (np.pi - np.deg2rad(p.back_emf_shape_width))
    commutation = np.empty(6)
    for e in range(6):
        j = SWITCHED_ON[e]
        early = p.hall_displacement_d_a if j == 0 else (p.hall_displacement_d_b if j == 1 else p.hall_displacement_d_c)
        commutation[e] = (np.pi / 6.0 + e * np.pi / 3.0 - np.deg2rad(early + p.angle_offset_offset)) % TWO_PI
    angles = np.empty(MAX_CELLS)
    n = 0
    for e in range(6):
        angles[n] = commutation[e]
        n += 1
    for j in range(3):
        for corner in (ramp, np.pi - ramp, np.pi + ramp, TWO_PI - ramp):
            angle = (corner + AXIS[j]) % TWO_PI
            known = False
            for m in range(n):
                gap = abs(angle - angles[m])
                if min(gap, TWO_PI - gap) < 1e-9:
                    known = True
            if not known:
                angles[n] = angle
                n += 1
    edge[:n] = np.sort(angles[:n])
    for c in range(n):
        upper = edge[c + 1] if c + 1 < n else edge[0] + TWO_PI
        middle = 0.5 * (edge[c] + upper)
        for j in range(3):
            f, df = trapezoid(middle - AXIS[j], ramp)
            value[c, j] = f - df * (middle - edge[c])
            slope[c, j] = df
        # the pair in force is the one of the commutation edge most recently passed going forward
        best, nearest = 0, 10.0
        for e in range(6):
            behind = (middle - commutation[e]) % TWO_PI
            if behind < nearest:
                nearest, best = behind, e
        pair[c, 0], pair[c, 1] = PAIR[best, 0], PAIR[best, 1]
    return n

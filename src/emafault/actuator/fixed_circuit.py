"""The circuit of the fixed step: inverter, star network and sensors of currents, over one step."""

import numpy as np

from ..compiled import compiled, compiled_inline
from .forms import (
    F_ANGLE,
    F_CONTACT,
    F_DYNAMIC,
    F_HALL,
    F_L,
    F_MAGNET,
    F_SHAPE,
    F_UNIT,
)
from .grammar import ORDERS
from .unlisted import AT_EMF, AT_RESISTANCE

TABLE = 720  # entries of the back-EMF table per electrical turn
ALPHA = np.array([0.0, 2.0 * np.pi / 3.0, 4.0 * np.pi / 3.0])


def back_emf_table(record: np.void) -> np.ndarray:
    """Trapezoid with corners rounded over 12 electrical degrees, with h5, h7 and an eleventh harmonic, (TABLE,)."""
    x = 2.0 * np.pi * np.arange(TABLE) / TABLE
    ramp = np.deg2rad(180.0 - record["back_emf_shape_width"]) / 2.0
    folded = np.where(x < np.pi, x, x - np.pi)
    shape = np.where(x < np.pi, 1.0, -1.0) * np.minimum(1.0, np.minimum(folded, np.pi - folded) / ramp)
    half = round(6 * TABLE / 360)
    shape = np.mean([np.roll(shape, s) for s in range(-half, half + 1)], axis=0)
    h5, h7 = record["back_emf_shape_h5"], record["back_emf_shape_h7"]
    shape += sum(size * np.sin(n * x) for n, size in zip(ORDERS, record["emf_harmonics"], strict=True))
    return shape + h5 * np.sin(5 * x) + h7 * np.sin(7 * x) + 0.3 * h5 * np.sin(11 * x)


@compiled
def shape(x, record, table, tabulated):
    """Unit back-EMF at electrical angle x (rad)."""
    x -= 2.0 * np.pi * np.floor(x / (2.0 * np.pi))
    if tabulated:
        u = x * TABLE / (2.0 * np.pi)
        low = int(u)
        return table[low % TABLE] + (u - low) * (table[(low + 1) % TABLE] - table[low % TABLE])
    ramp = (180.0 - record.back_emf_shape_width) * np.pi / 360.0
    y = x if x < np.pi else x - np.pi
    f = min(1.0, min(y, np.pi - y) / ramp)
    if x >= np.pi:
        f = -f
    if record.back_emf_shape_h5 != 0.0 or record.back_emf_shape_h7 != 0.0:
        f += record.back_emf_shape_h5 * np.sin(5.0 * x) + record.back_emf_shape_h7 * np.sin(7.0 * x)
    for m in range(len(ORDERS)):
        if record.emf_harmonics[m] != 0.0:
            f += record.emf_harmonics[m] * np.sin(ORDERS[m] * x)
    return f


@compiled
def edges(d, unequal):
    """Electrical angles (rad) at which a+, c-, b+, a-, c+, b- are switched on, each d (rad) of its phase early."""
    back = 0.8 if unequal else 1.0
    edge = np.empty(6)
    for n in range(6):
        phase = (0, 2, 1)[n % 3]
        edge[n] = (30.0 + 60.0 * n) * np.pi / 180.0 - (d[phase] if n % 2 == 0 else back * d[phase])
    return edge


@compiled
def active_pair(electrical, edges):
    """Phases driven + and - at an electrical angle (rad)."""
    x = electrical - 2.0 * np.pi * np.floor(electrical / (2.0 * np.pi))
    n = 0
    while n < 6 and x >= edges[n]:
        n += 1
    if n == 0:
        return 2, 1
    return (0, 0, 1, 1, 2, 2)[n - 1], (1, 2, 2, 0, 0, 1)[n - 1]


@compiled
def inductance(L, s, current, smooth):
    """Incremental inductance (H)."""
    if s == 0.0:
        return L
    if smooth:
        return L * (1.0 - 0.6 * np.tanh(current * np.sqrt(s / 0.6)) ** 2)
    return L / (1.0 + s * current * current)


@compiled
def slopes(i, base, Rds, R, L, s, smooth, e, conducts, out):
    """di/dt of the star network (A/s) into ``out``; returns the star point's voltage (V)."""
    above = below = 0.0
    for j in range(3):
        if conducts[j]:
            inverse = 1.0 / inductance(L[j], s, i[j], smooth)
            above += (base[j] - (R[j] + Rds[j]) * i[j] - e[j]) * inverse
            below += inverse
    star = above / below
    for j in range(3):
        out[j] = 0.0
        if conducts[j]:
            out[j] = (base[j] - (R[j] + Rds[j]) * i[j] - e[j] - star) / inductance(L[j], s, i[j], smooth)
    return star


@compiled
def advance(i, tau, base, Rds, R, L, s, smooth, e, conducts, k1, middle, k2, new):
    """One midpoint step of the currents over tau (s), from ``i`` to ``new``."""
    slopes(i, base, Rds, R, L, s, smooth, e, conducts, k1)
    for j in range(3):
        middle[j] = i[j] + 0.5 * tau * k1[j]
    slopes(middle, base, Rds, R, L, s, smooth, e, conducts, k2)
    for j in range(3):
        new[j] = i[j] + tau * k2[j]


@compiled
def sense(i, gain, offset, curved):
    """Measured phase current (A)."""
    if curved:
        return i + (gain - 1.0) * i * (1.0 + 0.3 * np.tanh(abs(i))) + offset
    return gain * i + offset


@compiled_inline
def constants(record, forms):
    """Resistance of the windings and outside (ohm), inductance (H) and k (V s/rad) of a run, (3,) by phase."""
    N, ambient = record.shorted_turns, record.dT
    R20, Rx, L, k0 = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    Rx[0], Rx[1], Rx[2] = (
        record.contact_resistance_R_x_a,
        record.contact_resistance_R_x_b,
        record.contact_resistance_R_x_c,
    )
    magnet = record.magnet_temperature_alpha_m * record.dT_magnet
    if forms[F_MAGNET]:
        magnet *= 1.0 + 2e-3 * record.dT_magnet
    for j in range(3):
        R20[j] = record.resistance * (1.0 - N[j]) * (1.0 if forms[F_UNIT] else record.unit_calibration_R_scale)
        L[j] = record.inductance * (1.0 - N[j]) ** 2 * record.inductance_tolerance_L_scale
        L[j] *= 1.0 + record.inductance_share[j]
        if forms[F_L]:
            L[j] *= 1.0 + 0.02 * np.cos(ALPHA[j])
        if forms[F_CONTACT]:
            Rx[j] *= 1.0 + 3e-3 * ambient
        if forms[F_UNIT]:  # the excess is a lead common in kind: neither shorted nor heated
            Rx[j] += record.resistance * (record.unit_calibration_R_scale - 1.0)
        k0[j] = record.back_emf * record.unit_calibration_k_scale * (1.0 - N[j]) * (1.0 + magnet)
        k0[j] *= 1.0 + record.back_emf_share[j]
        if record.eccentricity_law == 0:
            k0[j] *= 1.0 + record.eccentricity[0] * np.cos(ALPHA[j]) + record.eccentricity[1] * np.sin(ALPHA[j])
    return R20, Rx, L, k0


@compiled_inline
def sensors(record):
    """Gain and offset (A) of the current sensors, gain of the voltage sensors, (3,) by phase."""
    g, o, gv = np.zeros(3), np.zeros(3), np.zeros(3)
    g[0], g[1], g[2] = record.current_gain_g_a, record.current_gain_g_b, record.current_gain_g_c
    o[0], o[1], o[2] = record.current_offset_o_a, record.current_offset_o_b, record.current_offset_o_c
    gv[0], gv[1], gv[2] = record.voltage_gain_g_a, record.voltage_gain_g_b, record.voltage_gain_g_c
    return g, o, gv


@compiled_inline
def switching(record, forms):
    """Electrical angles (rad) at which switches close, see ``edges``."""
    d = np.zeros(3)
    d[0], d[1], d[2] = record.hall_displacement_d_a, record.hall_displacement_d_b, record.hall_displacement_d_c
    return edges(d * (np.pi / 180.0), forms[F_HALL])


@compiled_inline
def set_coefficients(record, forms, k0, R20, Rx, k, e, R, table, theta, middle_angle, w, heat, added):
    """Take back-EMF and resistance of the phases for a step.

    Parameters
    ----------
    k0, R20, Rx : constants, by phase
    k, e, R : what is filled, by phase (V s/rad, V, ohm)
    table : (TABLE,) unit back-EMF where it takes its alternative form
    theta, middle_angle : rotor angle at the start and in the middle of the step (rad)
    w, heat : speed in its middle (rad/s), rise of the winding's temperature (K)
    added : (place,) what no catalogue lists
    """
    factor = 1.0
    if record.eccentricity_law == 1:
        factor += record.eccentricity[0] * np.cos(theta) + record.eccentricity[1] * np.sin(theta)
    for j in range(3):
        k[j] = k0[j] * factor * shape(record.pole_pairs * middle_angle - ALPHA[j], record, table, forms[F_SHAPE])
        if record.eccentricity_law == 2:
            k[j] *= (
                1.0
                + record.eccentricity[0] * np.cos(theta - ALPHA[j])
                + record.eccentricity[1] * np.sin(theta - ALPHA[j])
            )
        if record.dynamic_eccentricity_d != 0.0:
            y = middle_angle - ALPHA[j] - record.dynamic_eccentricity_psi
            swing = record.dynamic_eccentricity_d * np.cos(y)
            if forms[F_DYNAMIC]:
                swing = swing / (1.0 - swing) + 0.2 * record.dynamic_eccentricity_d * np.cos(2.0 * y)
            k[j] *= 1.0 + swing
        k[j] *= 1.0 + added[AT_EMF + j]
        e[j] = k[j] * w
        R[j] = R20[j] * (1.0 + record.copper_coefficient * (record.dT + heat)) + Rx[j] + added[AT_RESISTANCE + j]


@compiled_inline
def driven(forms, at, theta, offset, p, dt, w, sampled):
    """Phases driven + and - at the start of a step and after a commutation in it, and the time until that (s).

    Parameters
    ----------
    at : (6,) of ``switching``
    theta, offset : rotor angle (rad), offset of the angle that commutates (electrical rad)
    p, dt, w : pole pairs, length of the step (s), speed in its middle (rad/s)
    sampled : a commutation waits for the step's end
    """
    seen = p * theta + offset
    if forms[F_ANGLE]:
        seen += 0.2 * offset * np.cos(theta)
    plus, minus = active_pair(seen, at)
    turn = p * dt * w
    next_plus, next_minus = active_pair(seen + turn, at)
    until = 2.0 * dt
    if not sampled and (next_plus != plus or next_minus != minus):
        low, high = 0.0, 1.0
        for _ in range(30):
            half = 0.5 * (low + high)
            now_plus, now_minus = active_pair(seen + half * turn, at)
            if now_plus == plus and now_minus == minus:
                low = half
            else:
                high = half
        until = high * dt
    return plus, minus, next_plus, next_minus, until


@compiled_inline
def connect(record, i, R, L, s, smooth, e, plus, minus, bus, forward, diode, base, Rds, conducts, k1):
    """Put the phases to the rails, or leave the one that is off floating.

    Parameters
    ----------
    i, R, L, s, smooth, e : as of ``slopes``
    plus, minus, bus, forward : driven phases, supply (V), whether the comparator drives their current up
    diode : by phase, +1 the lower one conducts, -1 the upper one, 0 the phase floats or is driven
    base, Rds, conducts : what is filled, by phase: rail (V), switch (ohm), whether it conducts
    k1 : by phase, to work in
    """
    off, Vf = 3 - plus - minus, record.diode_voltage
    for j in range(3):
        conducts[j] = True
        Rds[j] = record.switch_resistance
        base[j] = bus if (j == plus) == forward else 0.0
        if j != off:
            diode[j] = 0.0
    if diode[off] == 0.0 and i[off] != 0.0:
        diode[off] = 1.0 if i[off] > 0.0 else -1.0
    Rds[off] = 0.0
    if diode[off] == 0.0:
        conducts[off] = False
        terminal = slopes(i, base, Rds, R, L, s, smooth, e, conducts, k1) + e[off]
        if terminal < -Vf - 1e-9:
            diode[off] = 1.0
        elif terminal > bus + Vf + 1e-9:
            diode[off] = -1.0
    if diode[off] != 0.0:
        conducts[off] = True
        base[off] = -Vf if diode[off] > 0.0 else bus + Vf

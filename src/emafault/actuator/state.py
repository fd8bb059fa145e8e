"""What a run is between two of its events: its constants, its state, and its sums since the last recording instant."""

import numpy as np

from ..compiled import compiled
from .conduction import NEVER
from .friction import coulomb_torque, static_limit
from .grammar import MOST_TERMS, ORDERS
from .motor import MAX_CELLS, TWO_PI, build_cells, has_more_harmonics, is_modulated, modulate, phase_constants
from .unlisted import (
    AT_EMF,
    AT_INERTIA,
    AT_RESISTANCE,
    AT_TORQUE,
    AT_TORQUE_CONSTANT,
    PLACES,
    add_up,
    longest_hold,
    remembered,
)

FLOATING = 0.5  # of the supply; below it the three back-EMFs together bring no floating terminal to a rail
COGGING_ORDER = 72.0  # lcm(slots, poles)
MOTOR_SHARE = 0.7  # of the inertia, when the transmission is compliant
PENDING = 8  # demands that a controller's delay may hold back

CONSTANTS = [
    ("row", np.int64),  # of the run in its batch, -1 where a lane has none left
    ("R_winding", float, 3), ("R_outside", float, 3), ("L", float, 3), ("k", float, 3),  # ohm, ohm, H, V s/rad
    ("inverse_L_pair", float, 3),  # of the two phases that conduct when one is off (1/H)
    ("gain_i", float, 3), ("offset_i", float, 3), ("gain_v", float, 3),
    ("cells", np.int64), ("edge", float, MAX_CELLS), ("pair", np.int64, (MAX_CELLS, 2)),
    ("value", float, (MAX_CELLS, 3)), ("slope", float, (MAX_CELLS, 3)),
    ("modulated", np.bool_), ("heated", np.bool_), ("compliant", np.bool_), ("sagging", np.bool_),
    ("extras", np.bool_),  # whether what ``conduct`` calls so is needed
    ("largest_k", float),  # sum of the phases', V s/rad
    ("slow", float),  # rad/s, below which the back-EMFs together bring no floating terminal to a rail
    ("free_travel", float),  # rad of the rotor, within which the end stops are far
    ("angle_offset", float),  # of the recorded rotor angle, rad
    ("fastest", float),  # angular order of the fastest change of a torque or back-EMF coefficient within a cell
    ("inverse_inertia", float), ("shaft_inertia", float), ("viscous", float),
    ("coulomb_forward", float), ("coulomb_backward", float), ("limit_forward", float), ("limit_backward", float),
]  # fmt: skip
STATE = [
    ("t", float), ("tick", np.int64), ("record", np.int64), ("stalled", np.int64), ("stopped_short", np.bool_),
    ("i", float, 3), ("R", float, 3), ("high", np.bool_),
    ("diode", np.int64),  # of the off phase: +1 lower (i > 0), -1 upper (i < 0), 0 floating
    ("keep_floating", np.bool_),
    ("theta", float), ("w", float), ("moving", np.int64), ("at_stop", np.int64),
    ("turns", float), ("cell", np.int64), ("cogging_sine", float), ("cogging_cosine", float),
    ("shaft", float), ("w_shaft", float), ("contact", np.int64),
    ("filtered", float),  # measured speed behind the latency
    ("heat", float),  # T_w, K
    ("bus_current", float),  # filtered, A
    ("integral", float), ("I_ref", float), ("pending_time", float, PENDING), ("pending_value", float, PENDING),
]  # fmt: skip
SUMS = [
    ("sum_i", float, 3), ("sum_Ri", float, 3), ("sum_e", float, 3), ("start_flux", float, 3),
    ("start_theta", float), ("start_filtered", float), ("sum_bus", float),
]  # fmt: skip
#: while two phases conduct: whether they do, until when at most (s), and their coefficients with two derivatives
CONDUCTION = [
    ("conducting", np.bool_), ("until", float), ("ends_at", float),
    ("K", float, 3), ("dK", float, 3), ("ddK", float, 3),
]  # fmt: skip
#: what no catalogue lists: the torque it adds (N m); from when until when terms are held (s) and in which direction of
#: motion; what they add by place, and their states; constants without them
UNLISTED = [
    ("added_torque", float), ("held_from", float), ("held_until", float), ("held_moving", np.int64),
    ("added", float, len(PLACES)), ("memory", float, MOST_TERMS), ("k_listed", float, 3), ("inertia", float),
]  # fmt: skip
RUN_STATE = np.dtype(CONSTANTS + STATE + SUMS + CONDUCTION + UNLISTED, align=True)


@compiled
def has_extras(p):
    """Whether a run needs what ``conduct`` calls extras."""
    return p.inductance_saturation_s != 0.0 or p.bus_resistance_R != 0.0 or p.self_heating_heating_rate > 0.0


@compiled
def begin(p, s, row):
    """Fill ``s`` (RUN_STATE) with the constants and the state at rest of run ``row``; p : its record of RUN_DTYPE."""
    s.row = row
    R_winding, L, k = s.R_winding, s.L, s.k
    phase_constants(p, R_winding, L, k)
    R_outside, gain_i, offset_i, gain_v = s.R_outside, s.gain_i, s.offset_i, s.gain_v
    R_outside[0], R_outside[1] = p.contact_resistance_R_x_a, p.contact_resistance_R_x_b
    R_outside[2] = p.contact_resistance_R_x_c
    gain_i[0], gain_i[1], gain_i[2] = p.current_gain_g_a, p.current_gain_g_b, p.current_gain_g_c
    offset_i[0], offset_i[1], offset_i[2] = p.current_offset_o_a, p.current_offset_o_b, p.current_offset_o_c
    gain_v[0], gain_v[1], gain_v[2] = p.voltage_gain_g_a, p.voltage_gain_g_b, p.voltage_gain_g_c
    edge = s.edge
    s.cells = build_cells(p, edge, s.value, s.slope, s.pair)
    s.modulated = is_modulated(p)
    s.fastest = 0.0
    if s.modulated:
        s.fastest = 7.0 * p.pole_pairs if p.back_emf_shape_h5 != 0.0 or p.back_emf_shape_h7 != 0.0 else 1.0
        if has_more_harmonics(p):
            s.fastest = ORDERS[-1] * p.pole_pairs
    if p.cogging_a != 0.0:
        s.fastest = max(s.fastest, 0.5 * COGGING_ORDER)  # a small part of the torque
    s.heated, s.compliant = p.self_heating_heating_rate > 0.0, p.compliance_K > 0.0
    s.sagging = p.bus_resistance_R != 0.0
    s.extras = has_extras(p)
    s.largest_k = abs(k[0]) + abs(k[1]) + abs(k[2])
    s.slow = FLOATING * p.bus_voltage_Vdc / s.largest_k
    s.free_travel = 0.9 * p.end_stop * p.gear_ratio
    s.angle_offset = np.deg2rad(p.angle_offset_offset) / p.pole_pairs
    inertia = p.inertia * p.inertia_scale
    s.shaft_inertia = (1.0 - MOTOR_SHARE) * inertia * p.gear_ratio * p.gear_ratio
    if s.compliant:
        inertia *= MOTOR_SHARE
    s.inverse_inertia, s.inertia = 1.0 / inertia, inertia
    s.viscous = p.viscous_friction * p.viscous_friction_scale
    s.coulomb_forward, s.coulomb_backward = coulomb_torque(p, 1.0), coulomb_torque(p, -1.0)
    s.limit_forward, s.limit_backward = static_limit(p, s.coulomb_forward), static_limit(p, s.coulomb_backward)
    i, R, inverse_L_pair = s.i, s.R, s.inverse_L_pair
    sum_i, sum_Ri, sum_e, start_flux, ddK = s.sum_i, s.sum_Ri, s.sum_e, s.start_flux, s.ddK
    for j in range(3):
        inverse_L_pair[j] = 1.0 / (L[(j + 1) % 3] + L[(j + 2) % 3])
        R[j] = R_winding[j] * (1.0 + p.copper_coefficient * p.dT) + R_outside[j]
        i[j] = sum_i[j] = sum_Ri[j] = sum_e[j] = start_flux[j] = ddK[j] = 0.0
    s.t, s.tick, s.record, s.stalled, s.stopped_short, s.conducting = 0.0, 0, 0, 0, False, False
    s.high, s.diode, s.keep_floating = True, 0, False
    theta = p.theta_0
    s.theta, s.w, s.moving, s.at_stop = theta, 0.0, 0, 0
    s.cogging_sine, s.cogging_cosine = np.sin(COGGING_ORDER * theta), np.cos(COGGING_ORDER * theta)
    s.turns, s.cell = np.floor((p.pole_pairs * theta - edge[0]) / TWO_PI), 0
    while s.cell + 1 < s.cells and p.pole_pairs * theta - s.turns * TWO_PI >= edge[s.cell + 1]:
        s.cell += 1
    s.shaft, s.w_shaft, s.contact = 0.0, 0.0, 0
    s.filtered, s.heat, s.bus_current = 0.0, 0.0, 0.0
    s.integral, s.I_ref = 0.0, 0.0
    pending_time, pending_value = s.pending_time, s.pending_value
    for slot in range(PENDING):
        pending_time[slot], pending_value[slot] = NEVER, 0.0
    s.start_theta, s.start_filtered, s.sum_bus = theta, 0.0, 0.0
    s.added_torque, s.held_from, s.held_until, s.held_moving = 0.0, 0.0, 0.0, 0
    k_listed, memory = s.k_listed, s.memory
    for j in range(3):
        k_listed[j] = k[j]
    for m in range(MOST_TERMS):
        memory[m] = 0.0


@compiled
def hold_terms(p, s, terms, table, ends_at):
    """Take what no catalogue lists as it is in the middle of the time that follows, and say how long that is.

    Parameters
    ----------
    p, s : records of RUN_DTYPE and RUN_STATE
    terms : (term, number) rows of ``unlisted.term``
    table : (entry,) what a term of shape ``table`` follows
    ends_at : s, by which the time ends in any case
    """
    i, k, R, added, memory = s.i, s.k, s.R, s.added, s.memory
    R_winding, R_outside, k_listed = s.R_winding, s.R_outside, s.k_listed
    w = s.w if s.w != 0.0 else 1e-12 * s.moving  # which has its direction already as it breaks away
    current = 0.5 * (abs(i[0]) + abs(i[1]) + abs(i[2]))
    for m in range(len(terms)):
        memory[m] = remembered(terms[m], w, current, memory[m], s.t - s.held_from)
    s.held_from, s.held_moving = s.t, s.moving
    s.held_until = min(s.t + longest_hold(terms, s.t, w), ends_at)
    half = 0.5 * (s.held_until - s.t)
    theta = s.theta + half * w
    turned = (theta - p.theta_0) / p.gear_ratio
    ambient = p.reference_temperature + p.dT
    add_up(terms, s.t + half, theta, w, current, turned, ambient, memory, table, added)
    torque = added[AT_TORQUE]
    if added[AT_TORQUE_CONSTANT] != 0.0:
        cell, into = s.cell, p.pole_pairs * s.theta - s.turns * TWO_PI - s.edge[s.cell]
        for j in range(3):
            f = s.value[cell, j] + s.slope[cell, j] * into
            if s.modulated:
                f = modulate(p, s.theta, j, f, 0.0)[0]
            torque += added[AT_TORQUE_CONSTANT] * k[j] * f * i[j]
    s.added_torque = torque
    s.inverse_inertia = 1.0 / (s.inertia * (1.0 + added[AT_INERTIA]))
    for j in range(3):
        k[j] = k_listed[j] * (1.0 + added[AT_EMF + j])
        R[j] = R_winding[j] * (1.0 + p.copper_coefficient * (p.dT + s.heat)) + R_outside[j] + added[AT_RESISTANCE + j]
    s.largest_k = abs(k[0]) + abs(k[1]) + abs(k[2])
    s.slow = FLOATING * p.bus_voltage_Vdc / s.largest_k

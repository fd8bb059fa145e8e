"""A run's way into a lane of ``conduct`` where only its comparator switches, and back."""

import numpy as np

from ..compiled import compiled_inline
from .conduction import (
    ANGLE,
    AREA,
    BACK_EMF,
    BEND,
    BOTTOM,
    BUS_AREA,
    BUS_CURRENT,
    BUS_RESISTANCE,
    CURRENT_TOLERANCE,
    CURVATURE,
    DURATION,
    INVERSE_INERTIA,
    INVERSE_L,
    LIMIT_BACKWARD,
    LIMIT_FORWARD,
    LIVE,
    LOWER,
    MOVING,
    RESISTANCE,
    SATURATION,
    SIGN,
    SLOPE,
    SPEED,
    SQUARE,
    STIFFNESS,
    SUPPLY,
    TIME,
    TOP,
    TORQUE,
    TRIP,
    UPPER,
    VISCOUS,
    I,
)
from .friction import sliding_torque
from .instants import lagging
from .motor import TWO_PI, modulate
from .state import COGGING_ORDER

FINE = 0.1  # rad of the fastest harmonic, over which a coefficient follows three terms
SLOW_FRICTION = 0.1  # of Stribeck's speed, over which his friction is a straight line
SHORTEST_CHUNK = 1.0e-5  # s


@compiled_inline
def stays_off(p, s, plus, minus, off, w, gone, current):
    """Whether a floating terminal surely stays between the rails, and so carries no current.

    From the mean of the rails it is at most as far as its own back-EMF from that of the star point, which the two
    conducting phases divide by their inductances (``segment`` looks at the same voltage as it is).

    Parameters
    ----------
    p, s : records of RUN_DTYPE and RUN_STATE
    plus, minus, off : the phases by their role
    w, gone, current : largest speed (rad/s), angle (rad) and current (A) until something else happens
    """
    if s.sagging or p.inductance_saturation_s != 0.0:
        return False
    K, dK, L, R = s.K, s.dK, s.L, s.R
    share = L[minus] * s.inverse_L_pair[off]
    rest = 1.0 - share
    now = K[off] - share * K[plus] - rest * K[minus]
    then = now + gone * (dK[off] - share * dK[plus] - rest * dK[minus])
    resistive = abs(share * (R[plus] + p.switch_resistance) - rest * (R[minus] + p.switch_resistance)) * current
    farthest = abs(share - 0.5) * p.bus_voltage_Vdc + max(abs(now), abs(then)) * w + resistive
    return farthest < 0.5 * p.bus_voltage_Vdc + p.diode_voltage


@compiled_inline
def hand_over(p, s, x, lane, ends_at):
    """Put a run into its lane until ``ends_at`` (s) at most; returns whether nothing but its comparator will switch.

    Parameters
    ----------
    p, s : records of RUN_DTYPE and RUN_STATE
    x, lane : table of ``conduct``, and which lane is the run's
    """
    if s.stopped_short:
        s.stopped_short = False
        return False
    if s.compliant or s.diode != 0 or s.at_stop != 0:
        return False
    i, pair, cell, theta, w, moving = s.i, s.pair, s.cell, s.theta, s.w, s.moving
    plus, minus = pair[cell, 0], pair[cell, 1]
    off = 3 - plus - minus
    if i[off] != 0.0 or abs(theta - p.theta_0) >= s.free_travel:
        return False
    # ---- back-EMF coefficients and how far they are a short series
    poles, edge, value, slope = p.pole_pairs, s.edge, s.value, s.slope
    into = poles * theta - s.turns * TWO_PI - edge[cell]
    upper = edge[cell + 1] if cell + 1 < s.cells else edge[0] + TWO_PI
    k, K, dK, ddK = s.k, s.K, s.dK, s.ddK
    for j in range(3):
        K[j], dK[j] = value[cell, j] + slope[cell, j] * into, slope[cell, j] * poles
        if s.modulated:
            K[j], dK[j], ddK[j] = modulate(p, theta, j, K[j], dK[j])
        K[j], dK[j], ddK[j] = k[j] * K[j], k[j] * dK[j], k[j] * ddK[j]
    s.until = ends_at - s.t
    s.ends_at = ends_at
    duration = s.until
    if s.fastest * abs(w) * duration > FINE:
        duration = FINE / (s.fastest * abs(w))
    # ---- the torque against the motion
    ratio = p.gear_ratio
    torque, stiffness, bend = p.load_constant_T / ratio - s.added_torque, 0.0, 0.0
    damping = s.viscous
    if moving != 0:
        coulomb = s.coulomb_forward if moving > 0 else s.coulomb_backward
        friction, friction_slope = sliding_torque(p, coulomb, abs(w))
        torque += moving * friction
        if friction_slope != 0.0:
            damping += friction_slope
            torque -= friction_slope * w
            rate = (abs(i[plus]) * (abs(K[plus]) + abs(K[minus])) + abs(torque)) * s.inverse_inertia
            duration = min(duration, max(SLOW_FRICTION * p.stribeck_w_s / rate, SHORTEST_CHUNK))
    if p.cogging_a != 0.0:
        torque += p.cogging_a * s.cogging_sine
        stiffness += p.cogging_a * COGGING_ORDER * s.cogging_cosine
        bend -= p.cogging_a * COGGING_ORDER * COGGING_ORDER * s.cogging_sine
    if p.load_spring_c != 0.0:
        torque += p.load_spring_c * s.shaft / ratio
        if (
            abs((theta - p.theta_0) / ratio - moving * 0.5 * p.backlash_blk - s.shaft) < 1e-12
        ):  # the rotor takes it along
            stiffness += p.load_spring_c / (ratio * ratio)
    # ---- the comparator
    gain_i, offset_i, R = s.gain_i, s.offset_i, s.R
    per = 2.0 / (gain_i[plus] + gain_i[minus])
    centre, width = (s.I_ref - 0.5 * (offset_i[plus] - offset_i[minus])) * per, p.hysteresis * per
    high = s.high
    if high and i[plus] >= centre + width - CURRENT_TOLERANCE:
        high = False
    elif not high and i[plus] <= centre - width + CURRENT_TOLERANCE:
        high = True
    if abs(w) >= s.slow:
        current = max(abs(i[plus]), abs(centre) + width)
        drive = current * (abs(K[plus]) + abs(K[minus])) + abs(torque) + damping * abs(w)
        fastest = abs(w) + drive * s.inverse_inertia * duration
        gone = moving * min(fastest * duration, (upper - edge[cell] - into if moving > 0 else into) / poles)
        if not stays_off(p, s, plus, minus, off, fastest, gone, current):
            return False
    s.high = high
    x[I + lane], x[SPEED + lane], x[SIGN + lane] = i[plus], w, 1.0 if high else -1.0
    x[TIME + lane] = x[ANGLE + lane] = x[AREA + lane] = x[TRIP + lane] = 0.0
    x[LIVE + lane] = 1.0
    if s.extras:
        x[BUS_CURRENT + lane], x[BUS_RESISTANCE + lane] = s.bus_current, p.bus_resistance_R
        x[SQUARE + lane] = x[BUS_AREA + lane] = 0.0
    x[DURATION + lane], x[TOP + lane], x[BOTTOM + lane] = duration, centre + width, centre - width
    x[SUPPLY + lane] = p.bus_voltage_Vdc
    x[RESISTANCE + lane] = R[plus] + R[minus] + 2.0 * p.switch_resistance
    x[INVERSE_L + lane], x[SATURATION + lane] = s.inverse_L_pair[off], p.inductance_saturation_s
    x[BACK_EMF + lane], x[SLOPE + lane] = K[plus] - K[minus], dK[plus] - dK[minus]
    x[CURVATURE + lane] = ddK[plus] - ddK[minus]
    x[TORQUE + lane], x[STIFFNESS + lane], x[BEND + lane] = torque, stiffness, bend
    x[VISCOUS + lane], x[INVERSE_INERTIA + lane] = damping, s.inverse_inertia if moving != 0 else 0.0
    x[MOVING + lane] = moving
    x[LIMIT_FORWARD + lane], x[LIMIT_BACKWARD + lane] = s.limit_forward, s.limit_backward
    x[LOWER + lane], x[UPPER + lane] = -into / poles, (upper - edge[cell] - into) / poles
    s.conducting = True
    return True


@compiled_inline
def take_back(p, s, x, lane):
    """Take over what was conducted in a run's lane; arguments as those of ``hand_over``."""
    s.conducting = False
    pair, cell = s.pair, s.cell
    plus, minus = pair[cell, 0], pair[cell, 1]
    elapsed, end, area, gone = x[TIME + lane], x[I + lane], x[AREA + lane], x[ANGLE + lane]
    w_before, w = s.w, x[SPEED + lane]
    s.w, s.high = w, x[SIGN + lane] > 0.0
    i, R, K, dK, ddK, sum_i, sum_Ri, sum_e = s.i, s.R, s.K, s.dK, s.ddK, s.sum_i, s.sum_Ri, s.sum_e
    for j in range(3):
        sum_e[j] += gone * (K[j] + gone * (0.5 * dK[j] + gone * ddK[j] / 6.0))
    i[plus], i[minus] = end, -end
    sum_i[plus] += area
    sum_i[minus] -= area
    sum_Ri[plus] += R[plus] * area
    sum_Ri[minus] -= R[minus] * area
    if s.extras:
        R_outside = s.R_outside
        loss = (R[plus] - R_outside[plus] + R[minus] - R_outside[minus]) * x[SQUARE + lane]
        s.heat += p.self_heating_heating_rate * (loss - s.heat * elapsed / p.self_heating_Rth)
        s.bus_current, s.sum_bus = x[BUS_CURRENT + lane], s.sum_bus + x[BUS_AREA + lane]
    theta = s.theta + gone
    s.theta = theta
    if p.cogging_a != 0.0:
        s.cogging_sine, s.cogging_cosine = np.sin(COGGING_ORDER * theta), np.cos(COGGING_ORDER * theta)
    if p.speed_latency_tau > 0.0 and elapsed > 0.0:
        seen = p.speed_scale_scale
        mean = seen * gone / elapsed
        s.filtered = lagging(s.filtered, seen * w_before, seen * w, mean, elapsed, p.speed_latency_tau)
    reach, half_play = (theta - p.theta_0) / p.gear_ratio, 0.5 * p.backlash_blk
    s.shaft = min(max(s.shaft, reach - half_play), reach + half_play)
    s.stopped_short = elapsed < x[DURATION + lane]
    s.t = s.ends_at if elapsed == s.until else s.t + elapsed

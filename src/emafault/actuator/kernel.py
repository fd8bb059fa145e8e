"""The compiled, event-driven run of the actuator.

Between two events the three-phase circuit is linear (or smoothly saturating) and the currents follow a four-term Taylor
series; speed and angle follow the cubic and quartic that this torque gives. A segment ends at the earliest of: control
tick, recording instant, comparator trip, edge of a cell (commutation or corner of the trapezoid), free-wheel current
zero, a floating terminal reaching a rail, stop, break-away, end stop, contact of the play. Recorded means are exact
integrals of the series. It also runs uncompiled (NUMBA_DISABLE_JIT=1), to be stepped in a debugger.
"""

import numpy as np

from .compiled import compiled
from .conduction import CURRENT_TOLERANCE, LARGEST_CHANGE, MAX_SEGMENT, NEVER, conduct_pair, crossing, passing
from .friction import coulomb_torque, sliding_torque, static_limit
from .motor import MAX_CELLS, TWO_PI, build_cells, is_modulated, modulate, phase_constants

STALLED = 1000  # segments without progress in time, after which a run is given up
FINE = 0.1  # rad of the fastest harmonic, over which a coefficient follows three terms
SLOW_FRICTION = 0.1  # of Stribeck's speed, over which his friction is a straight line
SHORTEST_CHUNK = 1.0e-5  # s
FLOATING = 0.5  # of the supply; below it the three back-EMFs together bring no floating terminal to a rail
BUS_FILTER = 1.0e-3  # s
COGGING_ORDER = 72.0  # lcm(slots, poles)
MOTOR_SHARE = 0.7  # of the inertia, when the transmission is compliant
SHAFT_DAMPING = 2.0  # N m s/rad to ground, at the user shaft of the compliant transmission


@compiled
def mean_square(start, end, mean):
    """Mean square of a current over a segment from its ends and mean (exact for a parabola up to its bow squared)."""
    middle = 1.5 * mean - 0.25 * (start + end)
    return (start * start + 4.0 * middle * middle + end * end) / 6.0


@compiled
def linkage(L, s, i):
    """Flux linkage (V s) of the incremental inductance L / (1 + s i^2)."""
    if s == 0.0:
        return L * i
    root = np.sqrt(s)
    return L * np.arctan(root * i) / root


@compiled
def lagging(filtered, before, after, mean, h, tau):
    """First-order lag of time constant tau (s) behind a signal that goes from ``before`` to ``after`` in h (s).

    It goes straight but for a bow that gives it its mean, and that counts as if it were spread evenly.
    """
    rise, decay = (after - before) / h, np.exp(-h / tau)
    bow = mean - 0.5 * (before + after)
    return after - rise * tau + (filtered - before + rise * tau) * decay + bow * (1.0 - decay)


@compiled
def run_actuator(p, command, interval, voltage, current, current_end, speed, angle, position, bus):
    """Simulate one run and fill its recorded signals.

    Parameters
    ----------
    p : record of RUN_DTYPE
    command : (tick+1,) commanded user-shaft angle at the control ticks (rad)
    interval : recording interval (s)
    voltage, current, current_end : (time, phase) outputs (V, A, A)
    speed, angle, position, bus : (time,) outputs (rad/s, rad, rad, V)

    Returns
    -------
    number of segments
    """
    records = speed.shape[0]
    tick_period = p.control_period
    # ---- constants of the run
    R_winding, L, k = np.empty(3), np.empty(3), np.empty(3)
    phase_constants(p, R_winding, L, k)
    R_outside = np.array([p.contact_resistance_R_x_a, p.contact_resistance_R_x_b, p.contact_resistance_R_x_c])
    gain_i = np.array([p.current_gain_g_a, p.current_gain_g_b, p.current_gain_g_c])
    offset_i = np.array([p.current_offset_o_a, p.current_offset_o_b, p.current_offset_o_c])
    gain_v = np.array([p.voltage_gain_g_a, p.voltage_gain_g_b, p.voltage_gain_g_c])
    edge, value, slope = np.empty(MAX_CELLS), np.empty((MAX_CELLS, 3)), np.empty((MAX_CELLS, 3))
    pair = np.empty((MAX_CELLS, 2), np.int64)
    cells = build_cells(p, edge, value, slope, pair)
    modulated = is_modulated(p)
    saturation = p.inductance_saturation_s
    heated = p.self_heating_heating_rate > 0.0
    compliant = p.compliance_K > 0.0
    sagging = p.bus_resistance_R != 0.0
    tau = p.speed_latency_tau
    poles = p.pole_pairs
    ratio = p.gear_ratio
    plain = not (heated or compliant or sagging)
    fastest = 0.0  # angular order of the fastest change of a torque or back-EMF coefficient within a cell
    if modulated:
        fastest = 7.0 * poles if p.back_emf_shape_h5 != 0.0 or p.back_emf_shape_h7 != 0.0 else 1.0
    if p.cogging_a != 0.0:
        fastest = max(fastest, 0.5 * COGGING_ORDER)  # a small part of the torque
    K, dK, ddK = np.empty(3), np.empty(3), np.zeros(3)
    free_travel = 0.9 * p.end_stop * ratio
    inertia = p.inertia * p.inertia_scale
    shaft_inertia = (1.0 - MOTOR_SHARE) * inertia * ratio * ratio
    if compliant:
        inertia *= MOTOR_SHARE
    inverse_inertia = 1.0 / inertia
    viscous = p.viscous_friction * p.viscous_friction_scale
    coulomb_forward, coulomb_backward = coulomb_torque(p, 1.0), coulomb_torque(p, -1.0)
    limit_forward, limit_backward = static_limit(p, coulomb_forward), static_limit(p, coulomb_backward)
    half_play = 0.5 * p.backlash_blk
    band, drop, supply = p.hysteresis, p.switch_resistance, p.bus_voltage_Vdc
    largest_k = abs(k[0]) + abs(k[1]) + abs(k[2])
    inverse_L_pair = np.empty(3)  # of the two phases that conduct when phase j is off
    for j in range(3):
        inverse_L_pair[j] = 1.0 / (L[(j + 1) % 3] + L[(j + 2) % 3])
    # ---- state
    i, R = np.zeros(3), np.empty(3)
    for j in range(3):
        R[j] = R_winding[j] * (1.0 + p.copper_coefficient * p.dT) + R_outside[j]
    theta, w, moving = p.theta_0, 0.0, 0
    cogging_sine, cogging_cosine = np.sin(COGGING_ORDER * theta), np.cos(COGGING_ORDER * theta)
    at_stop = 0
    shaft, w_shaft, contact = 0.0, 0.0, 0
    filtered = 0.0  # measured speed behind the latency
    heat = 0.0  # T_w, K
    bus_current = 0.0  # filtered, A
    integral, I_ref, high = 0.0, 0.0, True
    pending_time, pending_value = np.full(8, NEVER), np.zeros(8)
    turns = np.floor((poles * theta - edge[0]) / TWO_PI)
    cell = 0
    while cell + 1 < cells and poles * theta - turns * TWO_PI >= edge[cell + 1]:
        cell += 1
    diode = 0  # of the off phase: +1 lower (i > 0), -1 upper (i < 0), 0 floating
    keep_floating = False
    # ---- accumulators of the recording interval
    sum_i, sum_Ri, sum_e, start_flux = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    start_theta, start_filtered, sum_bus = theta, 0.0, 0.0
    t, tick, record, segments, stalled, stopped_short = 0.0, 0, 0, 0, 0, False
    while True:
        # ---- recording instant
        if t >= (record + 1) * interval - 1e-12:
            mean_v = 0.0
            for j in range(3):
                flux = linkage(L[j], saturation, i[j])
                voltage[record, j] = gain_v[j] * (sum_Ri[j] + flux - start_flux[j] + sum_e[j]) / interval
                mean_v += voltage[record, j] / 3.0
                current[record, j] = gain_i[j] * sum_i[j] / interval + offset_i[j]
                current_end[record, j] = gain_i[j] * i[j] + offset_i[j]
                start_flux[j] = flux
                sum_i[j] = sum_Ri[j] = sum_e[j] = 0.0
            if p.virtual_neutral_on != 0.0:
                for j in range(3):
                    voltage[record, j] -= mean_v
            speed[record] = (p.speed_scale_scale * (theta - start_theta) - tau * (filtered - start_filtered)) / interval
            angle[record] = theta + np.deg2rad(p.angle_offset_offset) / poles
            position[record] = shaft
            bus[record] = sum_bus / interval if sagging else p.bus_voltage_Vdc
            start_theta, start_filtered, sum_bus = theta, filtered, 0.0
            record += 1
            if record == records:
                break
        # ---- control tick
        if t >= tick * tick_period - 1e-12:
            measured = filtered if tau > 0.0 else p.speed_scale_scale * w
            w_ref = ratio * p.position_gain * (command[min(tick, command.shape[0] - 1)] - shaft)
            w_ref = min(max(w_ref, -p.speed_limit), p.speed_limit)
            error = w_ref - measured
            advanced = integral + error * tick_period
            demand = p.speed_gain * error + p.speed_integral_gain * advanced
            if abs(demand) > p.current_limit:
                demand = p.speed_gain * error + p.speed_integral_gain * integral
                demand = min(max(demand, -p.current_limit), p.current_limit)
            else:
                integral = advanced
            if p.control_delay_delay > 0.0:
                slot = tick % 8
                pending_time[slot], pending_value[slot] = t + p.control_delay_delay, demand
            else:
                I_ref = demand
            if heated:
                for j in range(3):
                    R[j] = R_winding[j] * (1.0 + p.copper_coefficient * (p.dT + heat)) + R_outside[j]
            tick += 1
        h = min(tick * tick_period, (record + 1) * interval) - t
        ends_at = min(tick * tick_period, (record + 1) * interval)
        if p.control_delay_delay > 0.0:
            for slot in range(8):
                if pending_time[slot] <= t + 1e-12:
                    I_ref = pending_value[slot]
                    pending_time[slot] = NEVER
                elif pending_time[slot] < ends_at:
                    ends_at = pending_time[slot]
                    h = ends_at - t
        free = diode == 0 and at_stop == 0 and i[3 - pair[cell, 0] - pair[cell, 1]] == 0.0
        slow = abs(w) * largest_k < FLOATING * supply and abs(theta - p.theta_0) < free_travel
        if plain and free and slow and not stopped_short:
            # ---- most of the time two phases conduct and the comparator is all that happens until the next instant
            plus, minus = pair[cell, 0], pair[cell, 1]
            off = 3 - plus - minus
            gain = 0.5 * (gain_i[plus] + gain_i[minus])
            into = poles * theta - turns * TWO_PI - edge[cell]
            upper = edge[cell + 1] if cell + 1 < cells else edge[0] + TWO_PI
            for j in range(3):
                K[j], dK[j] = value[cell, j] + slope[cell, j] * into, slope[cell, j] * poles
                if modulated:
                    K[j], dK[j], ddK[j] = modulate(p, theta, j, K[j], dK[j])
                K[j], dK[j], ddK[j] = k[j] * K[j], k[j] * dK[j], k[j] * ddK[j]
            chunk = h
            if fastest * abs(w) * h > FINE:
                chunk = FINE / (fastest * abs(w))
            torque, stiffness, bend = p.load_constant_T / ratio, 0.0, 0.0
            damping = viscous
            if moving != 0:
                coulomb = coulomb_forward if moving > 0 else coulomb_backward
                friction, friction_slope = sliding_torque(p, coulomb, abs(w))
                torque += moving * friction
                if friction_slope != 0.0:
                    damping += friction_slope
                    torque -= friction_slope * w
                    rate = (abs(i[plus]) * (abs(K[plus]) + abs(K[minus])) + abs(torque)) * inverse_inertia
                    chunk = min(chunk, max(SLOW_FRICTION * p.stribeck_w_s / rate, SHORTEST_CHUNK))
            if p.cogging_a != 0.0:
                torque += p.cogging_a * cogging_sine
                stiffness += p.cogging_a * COGGING_ORDER * cogging_cosine
                bend -= p.cogging_a * COGGING_ORDER * COGGING_ORDER * cogging_sine
            if p.load_spring_c != 0.0:
                torque += p.load_spring_c * shaft / ratio
                if abs((theta - p.theta_0) / ratio - moving * half_play - shaft) < 1e-12:  # the rotor takes it along
                    stiffness += p.load_spring_c / (ratio * ratio)
            w_before = w
            count, elapsed, end_p, w, d_theta, area_p, high = conduct_pair(
                i[plus],
                w,
                high,
                chunk,
                (I_ref - 0.5 * (offset_i[plus] - offset_i[minus])) / gain,
                band / gain,
                supply,
                R[plus] + R[minus] + 2.0 * drop,
                inverse_L_pair[off],
                saturation,
                (K[plus] - K[minus], dK[plus] - dK[minus], ddK[plus] - ddK[minus]),
                (torque, stiffness, bend),
                damping,
                inverse_inertia if moving != 0 else 0.0,
                moving,
                limit_forward,
                limit_backward,
                -into / poles,
                (upper - edge[cell] - into) / poles,
            )
            for j in range(3):
                sum_e[j] += d_theta * (K[j] + d_theta * (0.5 * dK[j] + d_theta * ddK[j] / 6.0))
            i[plus], i[minus] = end_p, -end_p
            sum_i[plus] += area_p
            sum_i[minus] -= area_p
            sum_Ri[plus] += R[plus] * area_p
            sum_Ri[minus] -= R[minus] * area_p
            theta += d_theta
            if p.cogging_a != 0.0:
                cogging_sine, cogging_cosine = np.sin(COGGING_ORDER * theta), np.cos(COGGING_ORDER * theta)
            if tau > 0.0 and elapsed > 0.0:
                seen = p.speed_scale_scale
                filtered = lagging(filtered, seen * w_before, seen * w, seen * d_theta / elapsed, elapsed, tau)
            reach = (theta - p.theta_0) / ratio
            shaft = min(max(shaft, reach - half_play), reach + half_play)
            stopped_short = elapsed < chunk
            t = ends_at if elapsed == h else t + elapsed
            segments += count
            continue
        stopped_short = False
        timed = True
        if h > MAX_SEGMENT:
            h = MAX_SEGMENT
            timed = False
        # ---- inverter; phases by their role: p driven +, m driven -, o off
        plus, minus = pair[cell, 0], pair[cell, 1]
        off = 3 - plus - minus
        ip, im, io = i[plus], i[minus], i[off]
        gp, gm = 0.5 * gain_i[plus], 0.5 * gain_i[minus]
        measured_pair = gp * ip - gm * im + 0.5 * (offset_i[plus] - offset_i[minus])
        if high and measured_pair >= I_ref + band - CURRENT_TOLERANCE:
            high = False
        elif not high and measured_pair <= I_ref - band + CURRENT_TOLERANCE:
            high = True
        V = p.bus_voltage_Vdc - p.bus_resistance_R * bus_current if sagging else supply
        vp = V if high else 0.0
        vm = V - vp
        vo = 0.0
        Rp, Rm, Ro = R[plus] + drop, R[minus] + drop, R[off]
        if io != 0.0:
            diode = 1 if io > 0.0 else -1
        # ---- back-EMF coefficients k_j(theta) and their derivatives by theta
        into = poles * theta - turns * TWO_PI - edge[cell]
        dKp, dKm, dKo = slope[cell, plus], slope[cell, minus], slope[cell, off]
        Kp, Km, Ko = value[cell, plus] + dKp * into, value[cell, minus] + dKm * into, value[cell, off] + dKo * into
        dKp, dKm, dKo = dKp * poles, dKm * poles, dKo * poles
        if modulated:
            Kp, dKp, _ = modulate(p, theta, plus, Kp, dKp)
            Km, dKm, _ = modulate(p, theta, minus, Km, dKm)
            Ko, dKo, _ = modulate(p, theta, off, Ko, dKo)
        kp, km, ko = k[plus], k[minus], k[off]
        Kp, Km, Ko = kp * Kp, km * Km, ko * Ko
        dKp, dKm, dKo = kp * dKp, km * dKm, ko * dKo
        # ---- star network: which phases conduct, first derivatives of the currents
        if diode == 0 and not keep_floating and abs(w) * largest_k >= FLOATING * V:
            star = 0.5 * (vp + vm - (Kp + Km) * w)
            if saturation == 0.0:
                xp, xm = vp - Kp * w - Rp * ip, vm - Km * w - Rm * im
                star = (xp / L[plus] + xm / L[minus]) / (1.0 / L[plus] + 1.0 / L[minus])
            if star + Ko * w < -p.diode_voltage - 1e-9:
                diode = 1
            elif star + Ko * w > V + p.diode_voltage + 1e-9:
                diode = -1
        pair_only = diode == 0 and saturation == 0.0
        gammap = gammam = gammao = total = y1o = 0.0
        inverse_L = inverse_L_pair[off]
        if pair_only:
            y1p = (vp - vm - (Kp - Km) * w - (Rp + Rm) * ip) * inverse_L
            y1m = -y1p
        else:
            gammap = (1.0 + saturation * ip * ip) / L[plus]
            gammam = (1.0 + saturation * im * im) / L[minus]
            if diode != 0:
                gammao = (1.0 + saturation * io * io) / L[off]
                vo = -p.diode_voltage if diode > 0 else V + p.diode_voltage
            total = 1.0 / (gammap + gammam + gammao)
            xp, xm, xo = vp - Kp * w - Rp * ip, vm - Km * w - Rm * im, vo - Ko * w - Ro * io
            star = (gammap * xp + gammam * xm + gammao * xo) * total
            y1p, y1m, y1o = gammap * (xp - star), gammam * (xm - star), gammao * (xo - star)
        if saturation != 0.0:
            # the inductance, and with it the time constant, must not change much within the segment
            rate = max(Rp * gammap, Rm * gammam, Ro * gammao)
            rate = max(rate, 2.0 * saturation * abs(ip * y1p) / (1.0 + saturation * ip * ip))
            rate = max(rate, 2.0 * saturation * abs(im * y1m) / (1.0 + saturation * im * im))
            if h * rate > LARGEST_CHANGE:
                h = LARGEST_CHANGE / rate
                timed = False
        # ---- mechanics: driving torque, acceleration
        drive = Kp * ip + Km * im + Ko * io
        drive_1 = Kp * y1p + Km * y1m + Ko * y1o + w * (dKp * ip + dKm * im + dKo * io)
        if p.cogging_a != 0.0:
            drive -= p.cogging_a * cogging_sine
            drive_1 -= p.cogging_a * COGGING_ORDER * w * cogging_cosine
        load = p.load_constant_T + p.load_spring_c * shaft
        twist = twist_1 = shaft_torque = 0.0
        side = 0
        if compliant:
            twist = (theta - p.theta_0) / ratio - shaft
            twist_1 = w / ratio - w_shaft
            if contact != 0:
                shaft_torque = p.compliance_K * (twist - contact * half_play) + p.compliance_C * twist_1
            drive -= shaft_torque / ratio
        else:
            drive -= load / ratio
        if moving == 0:
            held = limit_forward if drive > 0.0 else limit_backward
            if (at_stop == 0 or at_stop * drive < 0.0) and abs(drive) > held * (1.0 + 1e-12):
                moving = 1 if drive > 0.0 else -1
                at_stop = 0
        a = b = c = 0.0
        friction_slope = 0.0
        if moving != 0:
            friction, friction_slope = sliding_torque(p, coulomb_forward if moving > 0 else coulomb_backward, abs(w))
            a = (drive - viscous * w - friction * moving) * inverse_inertia
        shaft_acceleration = twist_2 = 0.0
        if compliant:
            shaft_acceleration = (shaft_torque - SHAFT_DAMPING * w_shaft - load) / shaft_inertia
            if abs(shaft) >= p.end_stop and shaft * shaft_acceleration >= 0.0 and w_shaft == 0.0:
                shaft_acceleration = 0.0
            twist_2 = a / ratio - shaft_acceleration
            if contact != 0:
                drive_1 -= (p.compliance_K * twist_1 + p.compliance_C * twist_2) / ratio
        if moving != 0:
            b = (drive_1 - (viscous + friction_slope) * a) * inverse_inertia
        # ---- higher derivatives, then Taylor coefficients
        y2o = y3o = y4o = 0.0
        if pair_only:
            y2p = (-(dKp - dKm) * w * w - (Kp - Km) * a - (Rp + Rm) * y1p) * inverse_L
            y2m = -y2p
        else:
            # the changing inductance: gamma' u, with u the voltage across the inductance
            up, um, uo = xp - star, xm - star, xo - star
            gp1 = 2.0 * saturation * ip * y1p / L[plus]
            gm1 = 2.0 * saturation * im * y1m / L[minus]
            go1 = 2.0 * saturation * io * y1o / L[off] if diode != 0 else 0.0
            xp = -dKp * w * w - Kp * a - Rp * y1p
            xm = -dKm * w * w - Km * a - Rm * y1m
            xo = -dKo * w * w - Ko * a - Ro * y1o
            star = (gammap * xp + gammam * xm + gammao * xo + gp1 * up + gm1 * um + go1 * uo) * total
            up1, um1, uo1 = xp - star, xm - star, xo - star
            y2p, y2m, y2o = gammap * up1 + gp1 * up, gammam * um1 + gm1 * um, gammao * uo1 + go1 * uo
        if moving != 0:
            drive_2 = Kp * y2p + Km * y2m + Ko * y2o + 2.0 * w * (dKp * y1p + dKm * y1m + dKo * y1o)
            drive_2 += a * (dKp * ip + dKm * im + dKo * io)
            c = (drive_2 - viscous * b) * inverse_inertia
        if pair_only:
            y3p = (-3.0 * (dKp - dKm) * w * a - (Kp - Km) * b - (Rp + Rm) * y2p) * inverse_L
            y4p = -(Rp + Rm) * y3p * inverse_L
            y3m, y4m = -y3p, -y4p
        else:
            gp2 = 2.0 * saturation * (y1p * y1p + ip * y2p) / L[plus]
            gm2 = 2.0 * saturation * (y1m * y1m + im * y2m) / L[minus]
            go2 = 2.0 * saturation * (y1o * y1o + io * y2o) / L[off] if diode != 0 else 0.0
            hp, hm, ho = gp2 * up + 2.0 * gp1 * up1, gm2 * um + 2.0 * gm1 * um1, go2 * uo + 2.0 * go1 * uo1
            xp = -3.0 * dKp * w * a - Kp * b - Rp * y2p
            xm = -3.0 * dKm * w * a - Km * b - Rm * y2m
            xo = -3.0 * dKo * w * a - Ko * b - Ro * y2o
            star = (gammap * xp + gammam * xm + gammao * xo + hp + hm + ho) * total
            y3p, y3m, y3o = gammap * (xp - star) + hp, gammam * (xm - star) + hm, gammao * (xo - star) + ho
            star = -(gammap * Rp * y3p + gammam * Rm * y3m + gammao * Ro * y3o) * total
            y4p, y4m, y4o = gammap * (-Rp * y3p - star), gammam * (-Rm * y3m - star), gammao * (-Ro * y3o - star)
        y2p, y2m, y2o = 0.5 * y2p, 0.5 * y2m, 0.5 * y2o
        y3p, y3m, y3o = y3p / 6.0, y3m / 6.0, y3o / 6.0
        y4p, y4m, y4o = y4p / 24.0, y4m / 24.0, y4o / 24.0
        # ---- earliest event
        event = 0
        target = I_ref + band if high else I_ref - band
        te = crossing(
            measured_pair - target,
            gp * y1p - gm * y1m,
            gp * y2p - gm * y2m,
            gp * y3p - gm * y3m,
            gp * y4p - gm * y4m,
            h,
        )
        if te < h:
            h, event = te, 1
        if diode != 0:
            te = crossing(io, y1o, y2o, y3o, y4o, h)
            if te <= h:
                h, event = te, 2
            elif io == 0.0 and y1o * diode <= 0.0:
                diode, keep_floating = 0, True  # pushed back at once
                continue
        keep_floating = False
        if moving != 0:
            if moving > 0:
                ahead = (edge[cell + 1] if cell + 1 < cells else edge[0] + TWO_PI) - edge[cell]
            else:
                ahead = 0.0
            te = passing(into - ahead, moving, poles * w, 0.5 * poles * a, poles * b / 6.0, h)
            if te < h:
                h, event = te, 3
            te = crossing(w, a, 0.5 * b, c / 6.0, 0.0, h)
            if te < h:
                h, event = te, 4
            if not compliant:
                reach = (theta - p.theta_0) / ratio - moving * half_play
                if abs(reach) > 0.9 * p.end_stop and reach * moving > 0.0:
                    te = passing(reach - moving * p.end_stop, moving, w / ratio, 0.5 * a / ratio, b / ratio / 6.0, h)
                    if te < h:
                        h, event = te, 5
        else:
            held = limit_forward if drive > 0.0 else -limit_backward
            if at_stop == 0 or at_stop * drive < 0.0:
                torque_2, torque_3 = Kp * y2p + Km * y2m + Ko * y2o, Kp * y3p + Km * y3m + Ko * y3o
                te = crossing(drive - held, drive_1, torque_2, torque_3, 0.0, h)
                if te < h:
                    h, event = te, 6
        if compliant:
            # the sign of the rate decides at the very edge of the play, where rounding would flip the contact
            if contact != 0:
                gap, gap_1, gap_2 = contact * twist - half_play, contact * twist_1, 0.5 * contact * twist_2
                if gap > 0.0:
                    te = crossing(gap, gap_1, gap_2, 0.0, 0.0, h)
                    if te < h:
                        h, event = te, 7
                elif gap_1 < 0.0:
                    contact = 0
                    continue
            else:
                side = 1 if twist_1 >= 0.0 else -1
                gap, gap_1, gap_2 = side * twist - half_play, side * twist_1, 0.5 * side * twist_2
                if gap < 0.0:
                    te = crossing(gap, gap_1, gap_2, 0.0, 0.0, h)
                    if te < h:
                        h, event = te, 8
                elif gap_1 > 0.0:
                    contact = side
                    continue
        if diode == 0 and abs(w) * largest_k >= FLOATING * V:
            # a floating terminal may reach a rail inside the segment: its drift is slow, one secant is exact enough
            later = w + a * h
            was = (Ko - 0.5 * (Kp + Km)) * w
            will = (Ko + dKo * w * h - 0.5 * (Kp + Km + (dKp + dKm) * w * h)) * later
            reach_at = 0.5 * V + p.diode_voltage
            if abs(will) > reach_at and abs(was) < reach_at:
                te = max(h * (reach_at - abs(was)) / (abs(will) - abs(was)), 1e-9)
                if te < h:
                    h, event = te, 10
        if event != 0:
            timed = False
        # ---- advance
        d_theta = h * (w + h * (0.5 * a + h * (b / 6.0 + h * c / 24.0)))
        if modulated:
            middle = theta + 0.5 * d_theta
            for j in range(3):
                f = value[cell, j] + slope[cell, j] * (into + 0.5 * poles * d_theta)
                sum_e[j] += k[j] * modulate(p, middle, j, f, 0.0)[0] * d_theta
        else:
            sum_e[plus] += (Kp + 0.5 * dKp * d_theta) * d_theta
            sum_e[minus] += (Km + 0.5 * dKm * d_theta) * d_theta
            sum_e[off] += (Ko + 0.5 * dKo * d_theta) * d_theta
        area_p = h * (ip + h * (y1p * 0.5 + h * (y2p / 3.0 + h * (y3p * 0.25 + h * y4p * 0.2))))
        end_p = ip + h * (y1p + h * (y2p + h * (y3p + h * y4p)))
        if pair_only:
            area_m, area_o, end_m, end_o = -area_p, 0.0, -end_p, 0.0
        else:
            area_m = h * (im + h * (y1m * 0.5 + h * (y2m / 3.0 + h * (y3m * 0.25 + h * y4m * 0.2))))
            area_o = -area_p - area_m
            end_m = im + h * (y1m + h * (y2m + h * (y3m + h * y4m)))
            end_o = -end_p - end_m
            sum_i[off] += area_o
            sum_Ri[off] += Ro * area_o
        sum_i[plus] += area_p
        sum_i[minus] += area_m
        sum_Ri[plus] += R[plus] * area_p
        sum_Ri[minus] += R[minus] * area_m
        if heated:
            loss = (R[plus] - R_outside[plus]) * mean_square(ip, end_p, area_p / h if h > 0.0 else ip) * h
            loss += (R[minus] - R_outside[minus]) * mean_square(im, end_m, area_m / h if h > 0.0 else im) * h
            loss += (R[off] - R_outside[off]) * mean_square(io, end_o, area_o / h if h > 0.0 else io) * h
            heat += p.self_heating_heating_rate * (loss - heat * h / p.self_heating_Rth)
        if sagging:
            into_bus = (area_p if high else area_m) + (area_o if diode < 0 else 0.0)
            sum_bus += V * h
            if h > 0.0:
                bus_current += (into_bus / h - bus_current) * (1.0 - np.exp(-h / BUS_FILTER))
        i[plus], i[minus], i[off] = end_p, end_m, end_o
        w_before = w
        w += h * (a + h * (0.5 * b + h * c / 6.0))
        theta += d_theta
        if p.cogging_a != 0.0:  # not where it is used: calls up there cost a nominal run a tenth of its time
            cogging_sine, cogging_cosine = np.sin(COGGING_ORDER * theta), np.cos(COGGING_ORDER * theta)
        if tau > 0.0 and h > 0.0:
            seen = p.speed_scale_scale
            filtered = lagging(filtered, seen * w_before, seen * w, seen * d_theta / h, h, tau)
        if compliant:
            shaft += h * (w_shaft + 0.5 * h * shaft_acceleration)
            w_shaft += h * shaft_acceleration
            if abs(shaft) >= p.end_stop and shaft * w_shaft >= 0.0:
                shaft = p.end_stop if shaft > 0.0 else -p.end_stop
                w_shaft = 0.0
        # ---- what the event changes
        if event == 1:
            high = not high
        elif event == 2:
            i[off] = 0.0
            i[minus] = -i[plus]
            diode = 0
        elif event == 3:
            if moving > 0:
                cell += 1
                if cell == cells:
                    cell = 0
                    turns += 1.0
            else:
                cell -= 1
                if cell < 0:
                    cell = cells - 1
                    turns -= 1.0
            diode = 0
        elif event == 4:
            w, moving = 0.0, 0
        elif event == 5:
            w, at_stop, moving = 0.0, moving, 0
        elif event == 6:
            moving = 1 if drive > 0.0 else -1
            at_stop = 0
        elif event == 7:
            contact = 0
        elif event == 8:
            contact = side
        if moving * w < 0.0:
            w, moving = 0.0, 0
        if not compliant:
            reach = (theta - p.theta_0) / ratio
            shaft = min(max(shaft, reach - half_play), reach + half_play)
            shaft = min(max(shaft, -p.end_stop), p.end_stop)
        t = ends_at if timed else t + h
        segments += 1
        if h < 1e-13 and not timed:
            stalled += 1
            if stalled > STALLED:
                break
        else:
            stalled = 0
    for n in range(record, records):  # none, unless the parameters admit no motion that goes on
        voltage[n], current[n], current_end[n] = np.nan, np.nan, np.nan
        speed[n] = angle[n] = position[n] = bus[n] = np.nan
    return segments


@compiled
def run_batch(runs, command, shared, interval, voltage, current, current_end, speed, angle, position, bus):
    """Simulate every run of a batch; outputs have a leading run axis, ``command`` (run or 1, tick+1)."""
    for r in range(runs.shape[0]):
        run_actuator(
            runs[r],
            command[0 if shared else r],
            interval,
            voltage[r],
            current[r],
            current_end[r],
            speed[r],
            angle[r],
            position[r],
            bus[r],
        )

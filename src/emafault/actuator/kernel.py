"""The compiled, event-driven run of the actuator.

Between two events the three-phase circuit is linear (or smoothly saturating) and the currents follow a four-term Taylor
series; speed and angle follow the cubic and quartic that this torque gives. A segment ends at the earliest of: control
tick, recording instant, comparator trip, edge of a cell (commutation or corner of the trapezoid), free-wheel current zero,
a floating terminal reaching a rail, stop, break-away, end stop, contact of the play. Recorded means are exact integrals of
the series. It also runs uncompiled (NUMBA_DISABLE_JIT=1), to be stepped in a debugger.
"""

import numpy as np

from .compiled import compiled
from .friction import coulomb_torque, sliding_torque, static_limit
from .motor import AXIS, MAX_CELLS, TWO_PI, angle_modulation, build_cells, is_modulated, phase_constants

NEVER = 1.0e30
MAX_SEGMENT = 5.0e-5  # s; short against L/R, so that four terms are enough
CURRENT_TOLERANCE = 1.0e-9  # A
BUS_FILTER = 1.0e-3  # s
COGGING_ORDER = 72.0  # lcm(slots, poles)
MOTOR_SHARE = 0.7  # of the inertia, when the transmission is compliant
SHAFT_DAMPING = 2.0  # N m s/rad to ground, at the user shaft of the compliant transmission


@compiled
def crossing(c0, c1, c2, c3, c4, h):
    """First t in (0, h] at which c0 + c1 t + c2 t^2 + c3 t^3 + c4 t^4 changes sign; NEVER if it does not by t = h."""
    end = c0 + h * (c1 + h * (c2 + h * (c3 + h * c4)))
    if c0 == 0.0 or c0 * end > 0.0:
        return NEVER
    t = -c0 / c1 if c1 != 0.0 else h
    for _ in range(5):
        if not 0.0 <= t <= h:
            break
        value = c0 + t * (c1 + t * (c2 + t * (c3 + t * c4)))
        slope = c1 + t * (2.0 * c2 + t * (3.0 * c3 + t * 4.0 * c4))
        if slope == 0.0:
            break
        step = value / slope
        t -= step
        if abs(step) < 1e-17:
            break
    if 0.0 < t <= h and abs(c0 + t * (c1 + t * (c2 + t * (c3 + t * c4)))) <= 1e-9 * abs(c0) + 1e-15:
        return t
    low, high = 0.0, h
    for _ in range(60):
        t = 0.5 * (low + high)
        if c0 * (c0 + t * (c1 + t * (c2 + t * (c3 + t * c4)))) > 0.0:
            low = t
        else:
            high = t
    return high


@compiled
def linkage(L, s, i):
    """Flux linkage (V s) of the incremental inductance L / (1 + s i^2)."""
    if s == 0.0:
        return L * i
    root = np.sqrt(s)
    return L * np.arctan(root * i) / root


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
    # ---- constants of the run -------------------------------------------------------------------------------------
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
    inertia = p.inertia * p.inertia_scale
    shaft_inertia = (1.0 - MOTOR_SHARE) * inertia * ratio * ratio
    if compliant:
        inertia *= MOTOR_SHARE
    inverse_inertia = 1.0 / inertia
    viscous = p.viscous_friction * p.viscous_friction_scale
    coulomb_forward, coulomb_backward = coulomb_torque(p, 1.0), coulomb_torque(p, -1.0)
    limit_forward, limit_backward = static_limit(p, coulomb_forward), static_limit(p, coulomb_backward)
    half_play = 0.5 * p.backlash_blk
    # ---- state ------------------------------------------------------------------------------------------------------
    i, y1, y2, y3, y4 = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    R, x, gamma = np.empty(3), np.empty(3), np.empty(3)
    K, dK = np.empty(3), np.empty(3)  # k_j(theta) (V s/rad) and its derivative by theta
    rail, drop = np.zeros(3), np.zeros(3)
    for j in range(3):
        R[j] = R_winding[j] * (1.0 + p.copper_coefficient * p.dT) + R_outside[j]
    theta, w, moving = p.theta_0, 0.0, 0
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
    # ---- accumulators of the recording interval -----------------------------------------------------------------------
    sum_i, sum_Ri, sum_e, start_flux = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    start_theta, start_filtered, sum_bus = theta, 0.0, 0.0
    t, tick, record, segments = 0.0, 0, 0, 0
    while record < records:
        # ---- control tick ---------------------------------------------------------------------------------------------
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
        timed = True
        if h > MAX_SEGMENT:
            h = MAX_SEGMENT
            timed = False
        # ---- inverter ---------------------------------------------------------------------------------------------------
        plus, minus = pair[cell, 0], pair[cell, 1]
        off = 3 - plus - minus
        measured_pair = 0.5 * (gain_i[plus] * i[plus] - gain_i[minus] * i[minus] + offset_i[plus] - offset_i[minus])
        if high and measured_pair >= I_ref + p.hysteresis - CURRENT_TOLERANCE:
            high = False
        elif not high and measured_pair <= I_ref - p.hysteresis + CURRENT_TOLERANCE:
            high = True
        V = p.bus_voltage_Vdc - p.bus_resistance_R * bus_current
        rail[plus] = V if high else 0.0
        rail[minus] = 0.0 if high else V
        drop[plus] = drop[minus] = p.switch_resistance
        drop[off] = 0.0
        diode = 1 if i[off] > 0.0 else (-1 if i[off] < 0.0 else diode)
        # ---- back-EMF coefficients ------------------------------------------------------------------------------------------
        into = poles * theta - turns * TWO_PI - edge[cell]
        for j in range(3):
            K[j] = value[cell, j] + slope[cell, j] * into
            dK[j] = slope[cell, j] * poles
        if modulated:
            for j in range(3):
                angle_j = poles * theta - AXIS[j]
                K[j] += p.back_emf_shape_h5 * np.sin(5.0 * angle_j) + p.back_emf_shape_h7 * np.sin(7.0 * angle_j)
                dK[j] += poles * (
                    5.0 * p.back_emf_shape_h5 * np.cos(5.0 * angle_j) + 7.0 * p.back_emf_shape_h7 * np.cos(7.0 * angle_j)
                )
                g, dg = angle_modulation(p, theta, j)
                dK[j] = dK[j] * g + K[j] * dg
                K[j] *= g
        for j in range(3):
            K[j] *= k[j]
            dK[j] *= k[j]
        # ---- star network: which phases conduct, star potential ---------------------------------------------------------------
        for j in range(3):
            gamma[j] = (1.0 + saturation * i[j] * i[j]) / L[j]
            x[j] = rail[j] - K[j] * w - (R[j] + drop[j]) * i[j]
        if diode == 0:
            star = (gamma[plus] * x[plus] + gamma[minus] * x[minus]) / (gamma[plus] + gamma[minus])
            floating = star + K[off] * w
            if floating < -p.diode_voltage - 1e-9:
                diode = 1
            elif floating > V + p.diode_voltage + 1e-9:
                diode = -1
        if diode == 0:
            gamma[off] = 0.0
            x[off] = 0.0
        else:
            rail[off] = -p.diode_voltage if diode > 0 else V + p.diode_voltage
            x[off] = rail[off] - K[off] * w - R[off] * i[off]
        total = 1.0 / (gamma[0] + gamma[1] + gamma[2])
        star = (gamma[0] * x[0] + gamma[1] * x[1] + gamma[2] * x[2]) * total
        for j in range(3):
            y1[j] = gamma[j] * (x[j] - star)
        # ---- mechanics: driving torque, acceleration ---------------------------------------------------------------------------
        drive = K[0] * i[0] + K[1] * i[1] + K[2] * i[2]
        drive_1 = K[0] * y1[0] + K[1] * y1[1] + K[2] * y1[2] + w * (dK[0] * i[0] + dK[1] * i[1] + dK[2] * i[2])
        if p.cogging_a != 0.0:
            drive -= p.cogging_a * np.sin(COGGING_ORDER * theta)
            drive_1 -= p.cogging_a * COGGING_ORDER * w * np.cos(COGGING_ORDER * theta)
        load = p.load_constant_T + p.load_spring_c * shaft
        twist = twist_1 = shaft_torque = 0.0
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
        # ---- higher terms of the series -------------------------------------------------------------------------------------------
        if saturation == 0.0:
            for j in range(3):
                x[j] = -dK[j] * w * w - K[j] * a - (R[j] + drop[j]) * y1[j]
            star = (gamma[0] * x[0] + gamma[1] * x[1] + gamma[2] * x[2]) * total
            for j in range(3):
                y2[j] = gamma[j] * (x[j] - star)
        else:
            star_0 = star
            u0, u1, u2 = x[0] - star_0, x[1] - star_0, x[2] - star_0
            g0 = 2.0 * saturation * i[0] * y1[0] / L[0] * u0 if gamma[0] > 0.0 else 0.0
            g1 = 2.0 * saturation * i[1] * y1[1] / L[1] * u1 if gamma[1] > 0.0 else 0.0
            g2 = 2.0 * saturation * i[2] * y1[2] / L[2] * u2 if gamma[2] > 0.0 else 0.0
            for j in range(3):
                x[j] = -dK[j] * w * w - K[j] * a - (R[j] + drop[j]) * y1[j]
            star = (gamma[0] * x[0] + gamma[1] * x[1] + gamma[2] * x[2] + g0 + g1 + g2) * total
            y2[0] = gamma[0] * (x[0] - star) + g0
            y2[1] = gamma[1] * (x[1] - star) + g1
            y2[2] = gamma[2] * (x[2] - star) + g2
        if moving != 0:
            drive_2 = K[0] * y2[0] + K[1] * y2[1] + K[2] * y2[2]
            drive_2 += 2.0 * w * (dK[0] * y1[0] + dK[1] * y1[1] + dK[2] * y1[2])
            drive_2 += a * (dK[0] * i[0] + dK[1] * i[1] + dK[2] * i[2])
            c = (drive_2 - viscous * b) * inverse_inertia
        for j in range(3):
            x[j] = -3.0 * dK[j] * w * a - K[j] * b - (R[j] + drop[j]) * y2[j]
        star = (gamma[0] * x[0] + gamma[1] * x[1] + gamma[2] * x[2]) * total
        for j in range(3):
            y3[j] = gamma[j] * (x[j] - star)
            x[j] = -(R[j] + drop[j]) * y3[j]
        star = (gamma[0] * x[0] + gamma[1] * x[1] + gamma[2] * x[2]) * total
        for j in range(3):
            y4[j] = gamma[j] * (x[j] - star) * (1.0 / 24.0)
            y3[j] *= 1.0 / 6.0
            y2[j] *= 0.5
        if saturation != 0.0:
            # one correction by the exact flux balance keeps the saturating phase accurate to third order
            saturating_third_order(saturation, L, gamma, total, i, y1, y2, y3)
        # ---- earliest event -----------------------------------------------------------------------------------------------------------
        event = 0
        gp, gm = 0.5 * gain_i[plus], 0.5 * gain_i[minus]
        target = I_ref + p.hysteresis if high else I_ref - p.hysteresis
        te = crossing(
            measured_pair - target,
            gp * y1[plus] - gm * y1[minus],
            gp * y2[plus] - gm * y2[minus],
            gp * y3[plus] - gm * y3[minus],
            gp * y4[plus] - gm * y4[minus],
            h,
        )
        if te < h:
            h, event = te, 1
        if diode != 0:
            te = crossing(i[off], y1[off], y2[off], y3[off], y4[off], h)
            if te <= h:
                h, event = te, 2
            elif i[off] == 0.0 and y1[off] * diode <= 0.0:
                diode = 0  # pushed back at once: keep floating
                continue
        if moving != 0:
            if moving > 0:
                ahead = (edge[cell + 1] if cell + 1 < cells else edge[0] + TWO_PI) - edge[cell]
            else:
                ahead = 0.0
            te = crossing(into - ahead, poles * w, 0.5 * poles * a, poles * b / 6.0, 0.0, h)
            if into == ahead and moving * w > 0.0:
                te = 0.0
            if te < h:
                h, event = te, 3
            te = crossing(w, a, 0.5 * b, c / 6.0, 0.0, h)
            if te < h:
                h, event = te, 4
            if not compliant:
                reach = (theta - p.theta_0) / ratio - moving * half_play
                if abs(reach) > 0.9 * p.end_stop and reach * moving > 0.0:
                    te = crossing(reach - moving * p.end_stop, w / ratio, 0.5 * a / ratio, b / ratio / 6.0, 0.0, h)
                    if te < h:
                        h, event = te, 5
        else:
            held = limit_forward if drive > 0.0 else -limit_backward
            if at_stop == 0 or at_stop * drive < 0.0:
                te = crossing(
                    drive - held,
                    drive_1,
                    K[0] * y2[0] + K[1] * y2[1] + K[2] * y2[2],
                    K[0] * y3[0] + K[1] * y3[1] + K[2] * y3[2],
                    0.0,
                    h,
                )
                if te < h:
                    h, event = te, 6
        if compliant:
            if contact != 0:
                te = crossing(twist - contact * half_play, twist_1, 0.5 * twist_2, 0.0, 0.0, h)
                if te < h:
                    h, event = te, 7
            else:
                te = crossing(twist - half_play, twist_1, 0.5 * twist_2, 0.0, 0.0, h)
                if te < h:
                    h, event = te, 8
                te = crossing(twist + half_play, twist_1, 0.5 * twist_2, 0.0, 0.0, h)
                if te < h:
                    h, event = te, 9
        if diode == 0 and abs(w) * (abs(k[0]) + abs(k[1]) + abs(k[2])) > 0.4 * V:
            # a floating terminal may reach a rail inside the segment: its drift is slow, one secant is exact enough
            end_w = w + a * h
            end_star = 0.5 * V - 0.5 * (K[plus] + K[minus] + (dK[plus] + dK[minus]) * w * h) * end_w
            end_floating = end_star + (K[off] + dK[off] * w * h) * end_w
            now = 0.5 * V - 0.5 * (K[plus] + K[minus]) * w + K[off] * w
            over = end_floating - (V + p.diode_voltage) if end_floating > 0.5 * V else -p.diode_voltage - end_floating
            was = now - (V + p.diode_voltage) if end_floating > 0.5 * V else -p.diode_voltage - now
            if over > 0.0 and was < 0.0:
                te = max(h * was / (was - over) * (1.0 + 1e-9), 1e-9)
                if te < h:
                    h, event = te, 10
        if event != 0:
            timed = False
        # ---- advance ----------------------------------------------------------------------------------------------------------------------
        d_theta = h * (w + h * (0.5 * a + h * (b / 6.0 + h * c / 24.0)))
        if modulated:
            middle = theta + 0.5 * d_theta
            for j in range(3):
                angle_j = poles * middle - AXIS[j]
                f = value[cell, j] + slope[cell, j] * (into + 0.5 * poles * d_theta)
                f += p.back_emf_shape_h5 * np.sin(5.0 * angle_j) + p.back_emf_shape_h7 * np.sin(7.0 * angle_j)
                g, dg = angle_modulation(p, middle, j)
                sum_e[j] += k[j] * f * g * d_theta
        else:
            for j in range(3):
                sum_e[j] += (K[j] + 0.5 * dK[j] * d_theta) * d_theta
        loss, into_bus = 0.0, 0.0
        for j in range(3):
            area = h * (i[j] + h * (y1[j] / 2.0 + h * (y2[j] / 3.0 + h * (y3[j] / 4.0 + h * y4[j] / 5.0))))
            sum_i[j] += area
            sum_Ri[j] += R[j] * area
            if heated:
                mid = 0.5 * h
                mid_i = i[j] + mid * (y1[j] + mid * (y2[j] + mid * y3[j]))
                end_i = i[j] + h * (y1[j] + h * (y2[j] + h * y3[j]))
                loss += (R[j] - R_outside[j]) * (i[j] * i[j] + 4.0 * mid_i * mid_i + end_i * end_i) * h / 6.0
            if sagging and (j == (plus if high else minus) or (j == off and diode < 0)):
                into_bus += area
            i[j] += h * (y1[j] + h * (y2[j] + h * (y3[j] + h * y4[j])))
        if heated:
            rate = p.self_heating_heating_rate
            heat += rate * (loss - heat * h / p.self_heating_Rth)
        if sagging:
            sum_bus += V * h
            if h > 0.0:
                bus_current += (into_bus / h - bus_current) * (1.0 - np.exp(-h / BUS_FILTER))
        w_before = w
        w += h * (a + h * (0.5 * b + h * c / 6.0))
        theta += d_theta
        if tau > 0.0 and h > 0.0:
            u0, u1 = p.speed_scale_scale * w_before, p.speed_scale_scale * w
            rise = (u1 - u0) / h
            filtered = u1 - rise * tau + (filtered - u0 + rise * tau) * np.exp(-h / tau)
        if compliant:
            shaft += h * (w_shaft + 0.5 * h * shaft_acceleration)
            w_shaft += h * shaft_acceleration
            if abs(shaft) >= p.end_stop and shaft * w_shaft >= 0.0:
                shaft = p.end_stop if shaft > 0.0 else -p.end_stop
                w_shaft = 0.0
        # ---- what the event changes --------------------------------------------------------------------------------------------------------
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
            contact = 1
        elif event == 9:
            contact = -1
        if moving * w < 0.0:
            w, moving = 0.0, 0
        if not compliant:
            reach = (theta - p.theta_0) / ratio
            shaft = min(max(shaft, reach - half_play), reach + half_play)
            shaft = min(max(shaft, -p.end_stop), p.end_stop)
        t = ends_at if timed else t + h
        segments += 1
        # ---- recording instant -----------------------------------------------------------------------------------------------------------------
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
    return segments


@compiled
def saturating_third_order(s, L, gamma, total, i, y1, y2, y3):
    """Add to y3 what the changing inductance contributes at third order (gamma'' and gamma' terms), star point included."""
    add = np.zeros(3)
    for j in range(3):
        if gamma[j] > 0.0:
            second = 2.0 * y2[j]  # d2i/dt2
            u = y1[j] / gamma[j]
            g1 = 2.0 * s * i[j] * y1[j] / L[j]
            g2 = 2.0 * s * (y1[j] * y1[j] + i[j] * second) / L[j]
            u1 = (second - g1 * u) / gamma[j]
            add[j] = g2 * u + 2.0 * g1 * u1
    star = (add[0] + add[1] + add[2]) * total
    for j in range(3):
        y3[j] += (add[j] - gamma[j] * star) / 6.0


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

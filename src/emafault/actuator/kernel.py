"""The compiled, event-driven run of the actuator.

Between two events the three-phase circuit is linear (or smoothly saturating) and the currents follow a four-term Taylor
series; speed and angle follow the cubic and quartic that this torque gives. A segment ends at the earliest of: control
tick, recording instant, comparator trip, edge of a cell (commutation or corner of the trapezoid), free-wheel current
zero, a floating terminal reaching a rail, stop, break-away, end stop, contact of the play. Recorded means are exact
integrals of the series. It also runs uncompiled (NUMBA_DISABLE_JIT=1), to be stepped in a debugger.
"""

import numpy as np

from ..compiled import compiled, compiled_inline
from .conduction import (
    BUS_FILTER,
    CURRENT_TOLERANCE,
    LANES,
    LARGEST_CHANGE,
    MAX_SEGMENT,
    ROWS,
    conduct,
    crossing,
    passing,
)
from .friction import sliding_torque
from .instants import SAME, control_tick, lagging, next_instant, record_interval
from .lane import hand_over, take_back
from .motor import TWO_PI, modulate
from .state import COGGING_ORDER, FLOATING, begin, hold_terms

STALLED = 1000  # segments without progress in time, after which a run is given up
SHAFT_DAMPING = 2.0  # N m s/rad to ground, at the user shaft of the compliant transmission


@compiled
def mean_square(start, end, mean):
    """Mean square of a current over a segment from its ends and mean (exact for a parabola up to its bow squared)."""
    middle = 1.5 * mean - 0.25 * (start + end)
    return (start * start + 4.0 * middle * middle + end * end) / 6.0


@compiled_inline
def segment(p, s, ends_at):
    """Take a run on to its next event, or where only events will do on to ``ends_at`` (s).

    p, s : records of RUN_DTYPE and RUN_STATE
    """
    L, k, gain_i, offset_i, edge, value, slope = s.L, s.k, s.gain_i, s.offset_i, s.edge, s.value, s.slope
    i, R, sum_i, sum_Ri, sum_e, R_outside, pair = s.i, s.R, s.sum_i, s.sum_Ri, s.sum_e, s.R_outside, s.pair
    cells, modulated, inverse_inertia, viscous, I_ref = s.cells, s.modulated, s.inverse_inertia, s.viscous, s.I_ref
    heated, compliant, sagging = s.heated, s.compliant, s.sagging
    saturation, tau, poles, ratio = p.inductance_saturation_s, p.speed_latency_tau, p.pole_pairs, p.gear_ratio
    half_play = 0.5 * p.backlash_blk
    band, drop, supply = p.hysteresis, p.switch_resistance, p.bus_voltage_Vdc
    largest_k = s.largest_k
    high, diode, keep_floating = s.high, s.diode, s.keep_floating
    theta, w, moving, at_stop, turns, cell = s.theta, s.w, s.moving, s.at_stop, s.turns, s.cell
    cogging_sine, cogging_cosine = s.cogging_sine, s.cogging_cosine
    shaft, w_shaft, contact, filtered = s.shaft, s.w_shaft, s.contact, s.filtered
    heat, bus_current, sum_bus = s.heat, s.bus_current, s.sum_bus
    t, stalled, unlisted = s.t, s.stalled, s.added_torque
    while True:
        h, timed = ends_at - t, True
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
        inverse_L = s.inverse_L_pair[off]
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
        drive = Kp * ip + Km * im + Ko * io + unlisted
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
            held = s.limit_forward if drive > 0.0 else s.limit_backward
            if (at_stop == 0 or at_stop * drive < 0.0) and abs(drive) > held * (1.0 + 1e-12):
                moving = 1 if drive > 0.0 else -1
                at_stop = 0
        a = b = c = 0.0
        friction_slope = 0.0
        if moving != 0:
            friction, friction_slope = sliding_torque(
                p, s.coulomb_forward if moving > 0 else s.coulomb_backward, abs(w)
            )
            a = (drive - viscous * w - friction * moving) * inverse_inertia
        shaft_acceleration = twist_2 = 0.0
        if compliant:
            shaft_acceleration = (shaft_torque - SHAFT_DAMPING * w_shaft - load) / s.shaft_inertia
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
            held = s.limit_forward if drive > 0.0 else -s.limit_backward
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
        stalled = stalled + 1 if h < 1e-13 and not timed else 0
        if timed or not compliant or stalled > STALLED:
            break
    s.t, s.stalled = t, stalled
    s.high, s.diode, s.keep_floating = high, diode, keep_floating
    s.theta, s.w, s.moving, s.at_stop, s.turns, s.cell = theta, w, moving, at_stop, turns, cell
    s.cogging_sine, s.cogging_cosine = cogging_sine, cogging_cosine
    s.shaft, s.w_shaft, s.contact, s.filtered = shaft, w_shaft, contact, filtered
    s.heat, s.bus_current, s.sum_bus = heat, bus_current, sum_bus


@compiled
def run_batch(
    state, runs, rows, command, interval, records, terms, table, voltage, current, current_end, speed, angle, position,
    bus,
):  # fmt: skip
    """Simulate runs and fill their recorded signals.

    Parameters
    ----------
    state : (lane,) records of RUN_STATE to work in, ``LANES`` at most
    runs : (run,) records of RUN_DTYPE
    rows : (n,) which of them; best those with extras (see ``has_extras``) apart from those without
    command : (run or 1, tick+1) commanded user-shaft angle at the control ticks (rad)
    interval, records : (run,) recording interval (s) and how many of them each run lasts
    terms : (run or 1, term, number) causes that no catalogue lists, ``MOST_TERMS`` of a run at most
    table : (entry,) what a term of shape ``table`` follows
    voltage, current, current_end : (run, time, phase) outputs (V, A, A)
    speed, angle, position, bus : (run, time) outputs (rad/s, rad, rad, V)
    """
    lanes, x, unlisted = len(state), np.zeros(ROWS * LANES), terms.shape[1] > 0
    begun = going = min(lanes, len(rows))
    for lane in range(lanes):
        state[lane].row = -1
        if lane < begun:
            begin(runs[rows[lane]], state[lane], rows[lane])
    while going > 0:
        extras = False
        for lane in range(lanes):
            s = state[lane]
            row = s.row
            if row < 0:
                continue
            p, wanted = runs[row], records[row]
            if s.conducting:
                take_back(p, s, x, lane)
            while True:
                if s.t >= (s.record + 1) * interval[row] - SAME:
                    record_interval(p, s, interval[row], voltage, current, current_end, speed, angle, position, bus)
                    if s.record == wanted:
                        break
                if s.t >= s.tick * p.control_period - SAME:
                    control_tick(p, s, command[min(row, command.shape[0] - 1), min(s.tick, command.shape[1] - 1)])
                ends_at = next_instant(p, s, interval[row])
                if unlisted:
                    if s.t >= s.held_until - SAME or s.moving != s.held_moving:
                        hold_terms(p, s, terms[min(row, terms.shape[0] - 1)], table, ends_at)
                    ends_at = min(ends_at, s.held_until)
                if hand_over(p, s, x, lane, ends_at):
                    break
                segment(p, s, ends_at)
                if s.stalled > STALLED:
                    break
            if s.conducting:
                extras = extras or s.extras
                continue
            for n in range(s.record, wanted):  # none, unless the parameters admit no motion that goes on
                voltage[row, n], current[row, n], current_end[row, n] = np.nan, np.nan, np.nan
                speed[row, n] = angle[row, n] = position[row, n] = bus[row, n] = np.nan
            s.row = -1
            if begun < len(rows):
                begin(runs[rows[begun]], s, rows[begun])
                begun += 1
            else:
                going -= 1
        conduct(x, lanes, extras)

"""What a run does at given instants: the control tick, and the end of a recording interval."""

import numpy as np

from ..compiled import compiled, compiled_inline
from .conduction import NEVER
from .state import PENDING

SAME = 1.0e-12  # s, by which rounding may put an instant off


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


@compiled_inline
def record_interval(p, s, interval, voltage, current, current_end, speed, angle, position, bus):
    """Record the interval (s) that ends; outputs as in ``run_batch``."""
    row, record = s.row, s.record
    i, sum_i, sum_Ri, sum_e, start_flux = s.i, s.sum_i, s.sum_Ri, s.sum_e, s.start_flux
    gain_i, offset_i, gain_v, L = s.gain_i, s.offset_i, s.gain_v, s.L
    per = 1.0 / interval
    mean_v = 0.0
    for j in range(3):
        flux = linkage(L[j], p.inductance_saturation_s, i[j])
        v = gain_v[j] * (sum_Ri[j] + flux - start_flux[j] + sum_e[j]) * per
        mean_v += v / 3.0
        voltage[row, record, j] = v
        current[row, record, j] = gain_i[j] * sum_i[j] * per + offset_i[j]
        current_end[row, record, j] = gain_i[j] * i[j] + offset_i[j]
        start_flux[j] = flux
        sum_i[j] = sum_Ri[j] = sum_e[j] = 0.0
    if p.virtual_neutral_on != 0.0:
        for j in range(3):
            voltage[row, record, j] -= mean_v
    late = p.speed_latency_tau * (s.filtered - s.start_filtered)
    speed[row, record] = (p.speed_scale_scale * (s.theta - s.start_theta) - late) * per
    angle[row, record] = s.theta + s.angle_offset
    position[row, record] = s.shaft
    bus[row, record] = s.sum_bus * per if p.bus_resistance_R != 0.0 else p.bus_voltage_Vdc
    s.start_theta, s.start_filtered, s.sum_bus = s.theta, s.filtered, 0.0
    s.record = record + 1


@compiled_inline
def control_tick(p, s, commanded):
    """Take the demanded current from the commanded user-shaft angle (rad), and the resistances of a heating winding."""
    measured = s.filtered if p.speed_latency_tau > 0.0 else p.speed_scale_scale * s.w
    w_ref = p.gear_ratio * p.position_gain * (commanded - s.shaft)
    w_ref = min(max(w_ref, -p.speed_limit), p.speed_limit)
    error = w_ref - measured
    advanced = s.integral + error * p.control_period
    demand = p.speed_gain * error + p.speed_integral_gain * advanced
    if abs(demand) > p.current_limit:
        demand = p.speed_gain * error + p.speed_integral_gain * s.integral
        demand = min(max(demand, -p.current_limit), p.current_limit)
    else:
        s.integral = advanced
    if p.control_delay_delay > 0.0:
        slot = s.tick % PENDING
        pending_time, pending_value = s.pending_time, s.pending_value
        pending_time[slot], pending_value[slot] = s.t + p.control_delay_delay, demand
    else:
        s.I_ref = demand
    if p.self_heating_heating_rate > 0.0:
        R, R_winding, R_outside = s.R, s.R_winding, s.R_outside
        for j in range(3):
            R[j] = R_winding[j] * (1.0 + p.copper_coefficient * (p.dT + s.heat)) + R_outside[j]
    s.tick += 1


@compiled_inline
def next_instant(p, s, interval):
    """The next control tick, recording instant or arrival of a delayed demand (s); takes a demand that is due."""
    ends_at = min(s.tick * p.control_period, (s.record + 1) * interval)
    if p.control_delay_delay > 0.0:
        pending_time, pending_value = s.pending_time, s.pending_value
        for slot in range(PENDING):
            if pending_time[slot] <= s.t + SAME:
                s.I_ref = pending_value[slot]
                pending_time[slot] = NEVER
            elif pending_time[slot] < ends_at:
                ends_at = pending_time[slot]
    return ends_at

"""The same actuator written a second time, on a fixed step: oracle of the tests, other integrator of blind cases.

Nothing here is shared with the event-driven simulation but the run record. Inside a step only commutations, the
free-wheel current's zero and the comparator's trips are hit exactly; everything else is rounded to the step.
Every effect also has an alternative *form* (LuGre friction for Stribeck, a two-node thermal network, a rounded
back-EMF table, ...), for cases in which the library's formula is not the truth.
"""

from collections.abc import Collection
from typing import NamedTuple

import numpy as np

from ..compiled import compiled, compiled_inline
from ..errors import InputError
from .fixed_circuit import (
    TABLE,
    advance,
    back_emf_table,
    connect,
    constants,
    driven,
    inductance,
    sense,
    sensors,
    set_coefficients,
    switching,
)
from .fixed_mechanics import Motion, load_torque, mechanics_of, moved
from .forms import (
    F_ANGLE,
    F_BUS_R,
    F_BUS_V,
    F_COMPLIANCE,
    F_DELAY,
    F_GAIN,
    F_HEAT,
    F_LATENCY,
    F_NEUTRAL,
    F_OFFSET,
    F_PLAY,
    F_SATURATION,
    F_SHAPE,
    F_SPEED,
    F_VOLTAGE,
    FORMS,
    INDEX,
)
from .unlisted import PLACES, add_up, no_terms, remembered

SIGNALS = ("phase_voltage", "phase_current", "phase_current_end")
SCALARS = ("rotor_speed", "rotor_angle", "output_position", "commanded_position", "bus_voltage")
QUEUE = 64  # demands that a controller's delay may hold back


def simulate_fixed_step(
    runs: np.ndarray,
    command: np.ndarray,
    duration: float,
    interval: float,
    step: float = 1e-6,
    forms: Collection[str] = (),
    sampled: bool = False,
    terms: np.ndarray | None = None,
    table: np.ndarray | None = None,
    filter_time: float = 0.0,
) -> dict[str, np.ndarray]:
    """Simulate runs on a fixed step and return the clean recorded signals.

    Parameters
    ----------
    runs : (run,) records of ``RUN_DTYPE``
    command : (tick+1,) or (run, tick+1) user-shaft command at the control ticks (rad)
    duration, interval, step : s
    forms : ids of effects that take their alternative form. ``speed_quantisation`` has none here, because rounding
        belongs to the sensors (see ``quantise_by_truncation``).
    sampled : comparator and commutation act at the end of the step in which they are due, as in a plain simulator,
        and not within it
    terms : (term, number) causes that no catalogue lists, see ``unlisted.term``
    table : (entry,) what a term of shape ``table`` follows, an entry every ``unlisted.TABLE_STEP``
    filter_time : time constant (s) of a first-order filter on the current reference, at the control ticks

    Returns
    -------
    phase_voltage, phase_current, phase_current_end (run, time, phase); rotor_speed, rotor_angle, output_position,
    commanded_position, bus_voltage (run, time)

    Raises
    ------
    InputError : an unknown form, a command that is too short or a step that is not positive
    """
    flags = np.zeros(len(FORMS), np.bool_)
    for form in forms:
        if form not in INDEX:
            raise InputError(f"forms: '{form}' is not known, accepted are {', '.join(FORMS)}")
        flags[INDEX[form]] = True
    if not 0 < step <= interval:
        raise InputError(f"step: got {step} s, accepted is above 0 and up to the interval {interval} s")
    samples = round(duration / interval)
    command = np.asarray(command, float)
    extra = no_terms() if terms is None else np.ascontiguousarray(terms, float)
    wander = np.zeros(2) if table is None else np.ascontiguousarray(table, float)
    phased = {name: np.zeros((len(runs), samples, 3)) for name in SIGNALS}
    scalar = {name: np.zeros((len(runs), samples)) for name in SCALARS}
    for r, record in enumerate(runs):
        ticks = command if command.ndim == 1 else command[r]
        if (len(ticks) - 1) * record["control_period"] < samples * interval - 1e-9:
            raise InputError(f"command: covers {len(ticks) - 1} control periods, shorter than {duration} s")
        emf = back_emf_table(record) if flags[F_SHAPE] else np.zeros(TABLE)
        out_phased = np.zeros((3, samples, 3))
        out_scalar = np.zeros((5, samples))
        how = interval, step, flags, sampled, emf, extra, wander, filter_time
        _run(record, ticks, samples, *how, out_phased, out_scalar)
        for j, name in enumerate(SIGNALS):
            phased[name][r] = out_phased[j]
        for j, name in enumerate(SCALARS):
            scalar[name][r] = out_scalar[j]
    return phased | scalar


def quantise_by_truncation(speed: np.ndarray, step: float) -> np.ndarray:
    """Alternative form of ``speed_quantisation``: round towards minus infinity, (..., time) rad/s."""
    return step * np.floor(speed / step)


class Control(NamedTuple):
    """State of the controller: its integral and filtered demand (A), and how many demands were queued."""

    integral: float
    filtered: float
    queued: int


class Slow(NamedTuple):
    """State of what lags: the speed as seen and half-way to it (rad/s), winding and iron (K), the bus current (A)."""

    w_seen: float
    w_lag: float
    heat: float
    heat_iron: float
    i_bus: float
    i_bus_2: float


@compiled_inline
def _demanded(record, forms, control, commanded, theta_u, w_seen, tick, Tc, share, queue_time, queue_value):
    """Queue the current that a control tick demands, with the time (s) from which on it holds.

    Parameters
    ----------
    tick, Tc : number of the tick, time from each to the next (s)
    commanded, theta_u, w_seen : commanded and true user-shaft angle (rad), speed of the rotor as seen (rad/s)
    share : of a new demand, behind the filter; one without
    """
    integral, filtered, queued = control
    w_ref = record.gear_ratio * record.position_gain * (commanded - theta_u)
    w_ref = min(max(w_ref, -record.speed_limit), record.speed_limit)
    error = w_ref - w_seen
    trial = integral + error * Tc
    if abs(record.speed_gain * error + record.speed_integral_gain * trial) <= record.current_limit:
        integral = trial
    value = record.speed_gain * error + record.speed_integral_gain * integral
    if share < 1.0:
        filtered += share * (value - filtered)
        value = filtered
    delay = record.control_delay_delay
    if forms[F_DELAY]:
        u = np.sin(12.9898 * (tick + 1)) * 43758.5453
        delay *= 0.7 + 0.6 * (u - np.floor(u))
    queue_time[queued % QUEUE] = tick * Tc + delay
    queue_value[queued % QUEUE] = min(max(value, -record.current_limit), record.current_limit)
    return Control(integral, filtered, queued + 1)


@compiled_inline
def _lagged(record, forms, slow, w_mean, loss, charge, dt, speed_share, bus_share):
    """Take speed sensor, temperature and bus over a step.

    Parameters
    ----------
    w_mean, loss, charge : mean speed (rad/s), heat in the windings (J), charge from the bus (C)
    speed_share, bus_share : of what is new, behind the lags

    Returns
    -------
    the state after it, and the mean of the speed as seen (rad/s)
    """
    w_seen, w_lag, heat, heat_iron, i_bus, i_bus_2 = slow
    ideal = record.speed_scale_scale * w_mean
    if forms[F_SPEED]:
        ideal = w_mean
        ideal += (record.speed_scale_scale - 1.0) * ideal * (1.0 + 0.3 * np.tanh(abs(ideal) / 100.0))
    old = w_seen
    if forms[F_LATENCY]:
        w_lag += speed_share * (ideal - w_lag)
        w_seen += speed_share * (w_lag - w_seen)
    else:
        w_seen += speed_share * (ideal - w_seen)
    rate = record.self_heating_heating_rate
    if forms[F_HEAT]:
        flow = (heat - heat_iron) / 0.5
        heat += rate / 0.8 * (loss - dt * flow)
        heat_iron += dt * rate / 3.0 * (flow - heat_iron / record.self_heating_Rth)
    else:
        heat += rate * (loss - dt * heat / record.self_heating_Rth)
    if forms[F_BUS_R]:
        i_bus_2 += bus_share * (i_bus - i_bus_2)
    i_bus += bus_share * (charge / dt - i_bus)
    seen = ideal if speed_share == 1.0 else 0.5 * (old + w_seen)
    return Slow(w_seen, w_lag, heat, heat_iron, i_bus, i_bus_2), seen


@compiled_inline
def _record(record, forms, gain, offset, gain_v, i, sum_i, sum_v, interval, t, rec, phased):
    """Record the phases' signals of the interval (s) that ends, and begin its sums again."""
    mean_v = 0.0
    for j in range(3):
        v = sum_v[j] / interval
        excess = gain_v[j] - 1.0
        if forms[F_VOLTAGE]:
            excess *= 1.0 + 0.3 * np.tanh(abs(v) / 3.0)
        phased[0, rec, j] = v * (1.0 + excess)
        weight = 1.0 + (0.01 * (1 - j) if forms[F_NEUTRAL] else 0.0)
        mean_v += weight * phased[0, rec, j] / 3.0
        phased[1, rec, j] = sum_i[j] / interval
        drift = 1.0 + (0.3 * (t - 0.5) if forms[F_OFFSET] else 0.0)
        phased[2, rec, j] = sense(i[j], gain[j], offset[j] * drift, forms[F_GAIN])
        sum_v[j] = sum_i[j] = 0.0
    if record.virtual_neutral_on != 0.0:
        for j in range(3):
            phased[0, rec, j] -= mean_v


@compiled
def _run(record, command, samples, interval, step, forms, sampled, table, terms, wander, lag, phased, scalar):
    p, ratio, Tc = record.pole_pairs, record.gear_ratio, record.control_period
    offset = record.angle_offset_offset * (np.pi / 180.0)
    R20, Rx, L, k0 = constants(record, forms)
    gain, offset_i, gain_v = sensors(record)
    edges, mechanics = switching(record, forms), mechanics_of(record, forms)
    s, smooth, curved, h = record.inductance_saturation_s, forms[F_SATURATION], forms[F_GAIN], record.hysteresis
    i, new, k1, k2, middle = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    base, Rds, R, e, k = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    diode, conducts = np.zeros(3), np.zeros(3, np.bool_)
    sum_v, sum_i = np.zeros(3), np.zeros(3)  # over the recording interval
    motion = Motion(record.theta_0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    control, slow = Control(0.0, 0.0, 0), Slow(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    I_ref, forward, served = 0.0, True, 0
    queue_time, queue_value = np.zeros(QUEUE), np.zeros(QUEUE)
    memory, added = np.zeros(len(terms)), np.zeros(len(PLACES))
    temperature = record.reference_temperature + record.dT
    reference_share = 1.0
    if lag > 0.0:
        reference_share -= np.exp(-Tc / lag)
    sum_w = sum_bus = 0.0
    t, tick, rec = 0.0, 0, 0
    while rec < samples:
        if t >= tick * Tc - 1e-12:
            control = _demanded(
                record, forms, control, command[tick], motion.theta_u, slow.w_seen, tick, Tc, reference_share,
                queue_time, queue_value,
            )  # fmt: skip
            tick += 1
        while served < control.queued and queue_time[served % QUEUE] <= t + 1e-12:
            I_ref = queue_value[served % QUEUE]
            served += 1
        until = min(tick * Tc, (rec + 1) * interval)
        if served < control.queued:
            until = min(until, queue_time[served % QUEUE])
        count = max(1, int(np.ceil((until - t) / step - 1e-6)))
        dt = (until - t) / count
        bus_share = 1.0 - np.exp(-dt / (0.5e-3 if forms[F_BUS_R] else 1e-3))
        speed_share = 1.0
        if record.speed_latency_tau > 0.0:
            speed_share -= np.exp(-dt / (record.speed_latency_tau * (0.5 if forms[F_LATENCY] else 1.0)))
        for n in range(count):
            now = t + (n + 0.5) * dt
            theta, w = motion.theta, motion.w
            w_mid = w + 0.5 * dt * motion.acceleration
            if w == 0.0:
                w_mid = 0.0
            middle_angle = theta + 0.5 * dt * w_mid
            if len(terms) > 0:
                current = 0.5 * (abs(i[0]) + abs(i[1]) + abs(i[2]))
                turned = (middle_angle - record.theta_0) / ratio
                add_up(terms, now, middle_angle, w_mid, current, turned, temperature, memory, wander, added)
                for m in range(len(terms)):
                    memory[m] = remembered(terms[m], w_mid, current, memory[m], dt)
            set_coefficients(record, forms, k0, R20, Rx, k, e, R, table, theta, middle_angle, w_mid, slow.heat, added)
            bus = record.bus_voltage_Vdc - record.bus_resistance_R * (slow.i_bus_2 if forms[F_BUS_R] else slow.i_bus)
            if forms[F_BUS_V]:
                bus += 0.3 * np.sin(2.0 * np.pi * 300.0 * now)
            plus, minus, next_plus, next_minus, until_edge = driven(forms, edges, theta, offset, p, dt, w_mid, sampled)
            drift = 1.0 + (0.3 * (now - 0.5) if forms[F_OFFSET] else 0.0)
            # currents through the step, cut at commutations, comparator trips and free-wheel zeros
            torque = loss = charge = 0.0
            left, cuts = dt, 0
            while left > 1e-15 and cuts < 60:
                cuts += 1
                pair = 0.5 * (
                    sense(i[plus], gain[plus], offset_i[plus] * drift, curved)
                    - sense(i[minus], gain[minus], offset_i[minus] * drift, curved)
                )
                if forward and pair >= I_ref + h - 1e-12:
                    forward = False
                elif not forward and pair <= I_ref - h + 1e-12:
                    forward = True
                off = 3 - plus - minus
                connect(record, i, R, L, s, smooth, e, plus, minus, bus, forward, diode, base, Rds, conducts, k1)
                tau = min(left, until_edge)
                advance(i, tau, base, Rds, R, L, s, smooth, e, conducts, k1, middle, k2, new)
                # each event shortens the step to its own crossing, so that the earlier of two is what remains
                ended = False
                if diode[off] != 0.0 and diode[off] * new[off] < 0.0:
                    ended = True
                    low, high = 0.0, tau
                    g_low, g_high = diode[off] * i[off], diode[off] * new[off]
                    for _ in range(30):
                        tau = low + (high - low) * g_low / (g_low - g_high)
                        advance(i, tau, base, Rds, R, L, s, smooth, e, conducts, k1, middle, k2, new)
                        value = diode[off] * new[off]
                        if abs(value) < 1e-12:
                            break
                        if value > 0.0:
                            low, g_low = tau, value
                        else:
                            high, g_high = tau, value
                limit = I_ref + h if forward else I_ref - h
                side = 1.0 if forward else -1.0
                beyond = side * (
                    0.5
                    * (
                        sense(new[plus], gain[plus], offset_i[plus] * drift, curved)
                        - sense(new[minus], gain[minus], offset_i[minus] * drift, curved)
                    )
                    - limit
                )
                before = side * (pair - limit)
                if beyond > 0.0 and before < 0.0 and not sampled:
                    low, high, g_low, g_high = 0.0, tau, before, beyond
                    for _ in range(30):
                        tau = low + (high - low) * g_low / (g_low - g_high)
                        advance(i, tau, base, Rds, R, L, s, smooth, e, conducts, k1, middle, k2, new)
                        value = side * (
                            0.5
                            * (
                                sense(new[plus], gain[plus], offset_i[plus] * drift, curved)
                                - sense(new[minus], gain[minus], offset_i[minus] * drift, curved)
                            )
                            - limit
                        )
                        if abs(value) < 1e-12:
                            break
                        if value < 0.0:
                            low, g_low = tau, value
                        else:
                            high, g_high = tau, value
                    if ended and diode[off] * new[off] > 1e-12:
                        ended = False
                for j in range(3):
                    mean = i[j] + tau * (k1[j] / 6.0 + k2[j] / 3.0)
                    torque += tau * k[j] * mean
                    loss += tau * (R[j] - Rx[j]) * mean * mean
                    sum_i[j] += tau * sense(mean, gain[j], offset_i[j] * drift, curved)
                    voltage = e[j]
                    if conducts[j]:
                        voltage += R[j] * mean + inductance(L[j], s, middle[j], smooth) * k2[j]
                    sum_v[j] += tau * voltage
                    if (j == off and diode[j] < 0.0) or (j != off and (j == plus) == forward):
                        charge += tau * mean
                for j in range(3):
                    i[j] = new[j]
                if ended:
                    i[off], diode[off] = 0.0, 0.0
                    i[plus] = 0.5 * (i[plus] - i[minus])
                    i[minus] = -i[plus]
                left -= tau
                until_edge -= tau
                if until_edge <= 1e-15:
                    plus, minus, until_edge = next_plus, next_minus, 2.0 * dt
            torque /= dt
            # the transmission stands here, since in a function of its own the compiler rounds it otherwise
            theta_u, w_u = motion.theta_u, motion.w_u
            T_load = load_torque(record, forms, now, theta_u)
            play = record.backlash_blk
            if forms[F_PLAY]:
                play *= 1.0 + 0.3 * np.sin(40.0 * theta_u)
            T_shaft = T_load
            if mechanics.compliant:
                twist = (theta - record.theta_0) / ratio - theta_u
                T_shaft = 0.0
                if abs(twist) > 0.5 * play:
                    wound = twist - np.sign(twist) * 0.5 * play
                    K = record.compliance_K
                    if forms[F_COMPLIANCE]:
                        K *= 1.0 + (wound / 1e-3) ** 2
                    T_shaft = K * wound + record.compliance_C * (w / ratio - w_u)
            motion, w_mean = moved(record, forms, mechanics, motion, torque, T_load, T_shaft, play, added, dt)
            slow, seen = _lagged(record, forms, slow, w_mean, loss, charge, dt, speed_share, bus_share)
            sum_w += dt * seen
            sum_bus += dt * bus
        t = until
        if t >= (rec + 1) * interval - 1e-12:
            _record(record, forms, gain, offset_i, gain_v, i, sum_i, sum_v, interval, t, rec, phased)
            theta = motion.theta
            scalar[0, rec] = sum_w / interval
            scalar[1, rec] = theta + offset / p
            if forms[F_ANGLE]:
                scalar[1, rec] += 0.2 * offset / p * np.cos(theta)
            scalar[2, rec] = motion.theta_u
            where = t / Tc
            low_tick = min(int(where + 1e-9), len(command) - 2)
            scalar[3, rec] = command[low_tick] + (where - low_tick) * (command[low_tick + 1] - command[low_tick])
            scalar[4, rec] = sum_bus / interval
            sum_w = sum_bus = 0.0
            rec += 1

"""The same actuator written a second time, on a fixed step: oracle of the tests, other integrator of blind cases.

Nothing here is shared with the event-driven simulation but the run record. Inside a step only commutations, the
free-wheel current's zero and the comparator's trips are hit exactly; everything else is rounded to the step.
Every effect also has an alternative *form* (LuGre friction for Stribeck, a two-node thermal network, a rounded
back-EMF table, ...), for cases in which the library's formula is not the truth.
"""

from collections.abc import Collection

import numpy as np

from ..compiled import compiled
from ..effects import EFFECTS
from ..errors import InputError
from .unlisted import (
    AT_EMF,
    AT_INERTIA,
    AT_RESISTANCE,
    AT_TORQUE,
    AT_TORQUE_CONSTANT,
    PLACES,
    add_up,
    no_terms,
    remembered,
)

#: effects that have an alternative form; the position in this tuple is the flag's index in the kernel
FORMS = tuple(sorted(EFFECTS))
_F = {effect: index for index, effect in enumerate(FORMS)}
F_ANGLE, F_SHAPE, F_PLAY = _F["angle_offset"], _F["back_emf_shape"], _F["backlash"]
F_BUS_R, F_BUS_V, F_COGGING = _F["bus_resistance"], _F["bus_voltage"], _F["cogging"]
F_COMPLIANCE, F_CONTACT, F_DELAY = _F["compliance"], _F["contact_resistance"], _F["control_delay"]
F_GAIN, F_OFFSET, F_DYNAMIC = _F["current_gain"], _F["current_offset"], _F["dynamic_eccentricity"]
F_ASYMMETRY, F_LEVEL, F_COLD = _F["friction_asymmetry"], _F["friction_level"], _F["friction_temperature"]
F_HALL, F_SATURATION, F_L = _F["hall_displacement"], _F["inductance_saturation"], _F["inductance_tolerance"]
F_INERTIA, F_LOAD, F_SPRING = _F["inertia"], _F["load_constant"], _F["load_spring"]
F_MAGNET, F_HEAT, F_LATENCY = _F["magnet_temperature"], _F["self_heating"], _F["speed_latency"]
F_SPEED, F_STRIBECK, F_UNIT = _F["speed_scale"], _F["stribeck"], _F["unit_calibration"]
F_NEUTRAL, F_VISCOUS, F_VOLTAGE = _F["virtual_neutral"], _F["viscous_friction"], _F["voltage_gain"]

TABLE = 720  # entries of the back-EMF table per electrical turn
ALPHA = np.array([0.0, 2.0 * np.pi / 3.0, 4.0 * np.pi / 3.0])
SIGNALS = ("phase_voltage", "phase_current", "phase_current_end")
SCALARS = ("rotor_speed", "rotor_angle", "output_position", "commanded_position", "bus_voltage")


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
        if form not in _F:
            raise InputError(f"forms: '{form}' is not known, accepted are {', '.join(FORMS)}")
        flags[_F[form]] = True
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
        emf = _back_emf_table(record) if flags[F_SHAPE] else np.zeros(TABLE)
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


def _back_emf_table(record: np.void) -> np.ndarray:
    """Trapezoid with corners rounded over 12 electrical degrees, with h5, h7 and an eleventh harmonic, (TABLE,)."""
    x = 2.0 * np.pi * np.arange(TABLE) / TABLE
    ramp = np.deg2rad(180.0 - record["back_emf_shape_width"]) / 2.0
    folded = np.where(x < np.pi, x, x - np.pi)
    shape = np.where(x < np.pi, 1.0, -1.0) * np.minimum(1.0, np.minimum(folded, np.pi - folded) / ramp)
    half = round(6 * TABLE / 360)
    shape = np.mean([np.roll(shape, s) for s in range(-half, half + 1)], axis=0)
    h5, h7 = record["back_emf_shape_h5"], record["back_emf_shape_h7"]
    return shape + h5 * np.sin(5 * x) + h7 * np.sin(7 * x) + 0.3 * h5 * np.sin(11 * x)


@compiled
def _shape(x, record, table, tabulated):
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
    return f


@compiled
def _edges(d, unequal):
    """Electrical angles (rad) at which a+, c-, b+, a-, c+, b- are switched on, each d (rad) of its phase early."""
    back = 0.8 if unequal else 1.0
    edges = np.empty(6)
    for n in range(6):
        phase = (0, 2, 1)[n % 3]
        edges[n] = (30.0 + 60.0 * n) * np.pi / 180.0 - (d[phase] if n % 2 == 0 else back * d[phase])
    return edges


@compiled
def _active_pair(electrical, edges):
    """Phases driven + and - at an electrical angle (rad)."""
    x = electrical - 2.0 * np.pi * np.floor(electrical / (2.0 * np.pi))
    n = 0
    while n < 6 and x >= edges[n]:
        n += 1
    if n == 0:
        return 2, 1
    return (0, 0, 1, 1, 2, 2)[n - 1], (1, 2, 2, 0, 0, 1)[n - 1]


@compiled
def _inductance(L, s, current, smooth):
    """Incremental inductance (H)."""
    if s == 0.0:
        return L
    if smooth:
        return L * (1.0 - 0.6 * np.tanh(current * np.sqrt(s / 0.6)) ** 2)
    return L / (1.0 + s * current * current)


@compiled
def _slopes(i, base, Rds, R, L, s, smooth, e, conducts, out):
    """di/dt of the star network (A/s) into ``out``; returns the star point's voltage (V)."""
    above = below = 0.0
    for j in range(3):
        if conducts[j]:
            inverse = 1.0 / _inductance(L[j], s, i[j], smooth)
            above += (base[j] - (R[j] + Rds[j]) * i[j] - e[j]) * inverse
            below += inverse
    star = above / below
    for j in range(3):
        out[j] = 0.0
        if conducts[j]:
            out[j] = (base[j] - (R[j] + Rds[j]) * i[j] - e[j] - star) / _inductance(L[j], s, i[j], smooth)
    return star


@compiled
def _advance(i, tau, base, Rds, R, L, s, smooth, e, conducts, k1, middle, k2, new):
    """One midpoint step of the currents over tau (s), from ``i`` to ``new``."""
    _slopes(i, base, Rds, R, L, s, smooth, e, conducts, k1)
    for j in range(3):
        middle[j] = i[j] + 0.5 * tau * k1[j]
    _slopes(middle, base, Rds, R, L, s, smooth, e, conducts, k2)
    for j in range(3):
        new[j] = i[j] + tau * k2[j]


@compiled
def _sense(i, gain, offset, curved):
    """Measured phase current (A)."""
    if curved:
        return i + (gain - 1.0) * i * (1.0 + 0.3 * np.tanh(abs(i))) + offset
    return gain * i + offset


@compiled
def _run(record, command, samples, interval, step, forms, sampled, table, terms, wander, filter_time, phased, scalar):
    p, J0, ratio = record.pole_pairs, record.inertia, record.gear_ratio
    Tc, Vf, h = record.control_period, record.diode_voltage, record.hysteresis
    ambient = record.dT
    degrees = np.pi / 180.0

    # constants of the run
    N = record.shorted_turns
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
        if forms[F_L]:
            L[j] *= 1.0 + 0.02 * np.cos(ALPHA[j])
        if forms[F_CONTACT]:
            Rx[j] *= 1.0 + 3e-3 * ambient
        if forms[F_UNIT]:  # the excess is a lead common in kind: neither shorted nor heated
            Rx[j] += record.resistance * (record.unit_calibration_R_scale - 1.0)
        k0[j] = record.back_emf * record.unit_calibration_k_scale * (1.0 - N[j]) * (1.0 + magnet)
        if record.eccentricity_law == 0:
            k0[j] *= 1.0 + record.eccentricity[0] * np.cos(ALPHA[j]) + record.eccentricity[1] * np.sin(ALPHA[j])
    d, g, o, gv = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    d[0], d[1], d[2] = record.hall_displacement_d_a, record.hall_displacement_d_b, record.hall_displacement_d_c
    edges = _edges(d * degrees, forms[F_HALL])
    g[0], g[1], g[2] = record.current_gain_g_a, record.current_gain_g_b, record.current_gain_g_c
    o[0], o[1], o[2] = record.current_offset_o_a, record.current_offset_o_b, record.current_offset_o_c
    gv[0], gv[1], gv[2] = record.voltage_gain_g_a, record.voltage_gain_g_b, record.voltage_gain_g_c
    Tcoulomb = record.coulomb_friction * record.friction_level_scale
    beta = record.friction_temperature_beta
    Tcoulomb *= np.exp(beta * ambient) if forms[F_COLD] else max(0.0, 1.0 + beta * ambient)
    inertia_scale = record.inertia_scale
    J = J0 if forms[F_INERTIA] else J0 * inertia_scale
    compliant = record.compliance_K > 0.0
    J_motor = 0.7 * J if compliant else J
    J_shaft = 0.3 * J * ratio * ratio
    slots = 72.0
    s, smooth = record.inductance_saturation_s, forms[F_SATURATION]
    offset = record.angle_offset_offset * degrees

    # state
    i, new, k1, k2, middle = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    base, Rds, R, e, k = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    diode = np.zeros(3)  # +1 lower diode conducts, -1 upper, 0 floats
    conducts = np.zeros(3, np.bool_)
    theta, w, acceleration = record.theta_0, 0.0, 0.0
    theta_u, w_u = 0.0, 0.0
    heat, heat_iron = 0.0, 0.0
    w_seen, w_lag = 0.0, 0.0
    i_bus, i_bus_2 = 0.0, 0.0
    bristle, w_disc = 0.0, 0.0
    integral, I_ref = 0.0, 0.0
    forward = True
    queue_time, queue_value = np.zeros(64), np.zeros(64)
    queued = served = 0
    memory, added = np.zeros(len(terms)), np.zeros(len(PLACES))
    temperature = record.reference_temperature + ambient
    filtered, reference_share = 0.0, 1.0
    if filter_time > 0.0:
        reference_share -= np.exp(-Tc / filter_time)

    # sums over the recording interval
    sum_v, sum_i = np.zeros(3), np.zeros(3)
    sum_w = sum_bus = 0.0

    t, tick, rec = 0.0, 0, 0
    while rec < samples:
        if t >= tick * Tc - 1e-12:
            w_ref = ratio * record.position_gain * (command[tick] - theta_u)
            w_ref = min(max(w_ref, -record.speed_limit), record.speed_limit)
            error = w_ref - w_seen
            trial = integral + error * Tc
            if abs(record.speed_gain * error + record.speed_integral_gain * trial) <= record.current_limit:
                integral = trial
            value = record.speed_gain * error + record.speed_integral_gain * integral
            if reference_share < 1.0:
                filtered += reference_share * (value - filtered)
                value = filtered
            delay = record.control_delay_delay
            if forms[F_DELAY]:
                u = np.sin(12.9898 * (tick + 1)) * 43758.5453
                delay *= 0.7 + 0.6 * (u - np.floor(u))
            queue_time[queued % 64] = tick * Tc + delay
            queue_value[queued % 64] = min(max(value, -record.current_limit), record.current_limit)
            queued += 1
            tick += 1
        while served < queued and queue_time[served % 64] <= t + 1e-12:
            I_ref = queue_value[served % 64]
            served += 1
        until = min(tick * Tc, (rec + 1) * interval)
        if served < queued:
            until = min(until, queue_time[served % 64])
        count = max(1, int(np.ceil((until - t) / step - 1e-6)))
        dt = (until - t) / count
        bus_share = 1.0 - np.exp(-dt / (0.5e-3 if forms[F_BUS_R] else 1e-3))
        speed_share = 1.0
        if record.speed_latency_tau > 0.0:
            speed_share -= np.exp(-dt / (record.speed_latency_tau * (0.5 if forms[F_LATENCY] else 1.0)))

        for n in range(count):
            now = t + (n + 0.5) * dt
            w_mid = w + 0.5 * dt * acceleration
            if w == 0.0:
                w_mid = 0.0
            middle_angle = theta + 0.5 * dt * w_mid
            if len(terms) > 0:
                current = 0.5 * (abs(i[0]) + abs(i[1]) + abs(i[2]))
                turned = (middle_angle - record.theta_0) / ratio
                add_up(terms, now, middle_angle, w_mid, current, turned, temperature, memory, wander, added)
                for m in range(len(terms)):
                    memory[m] = remembered(terms[m], w_mid, current, memory[m], dt)
            factor = 1.0
            if record.eccentricity_law == 1:
                factor += record.eccentricity[0] * np.cos(theta) + record.eccentricity[1] * np.sin(theta)
            for j in range(3):
                k[j] = k0[j] * factor * _shape(p * middle_angle - ALPHA[j], record, table, forms[F_SHAPE])
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
                e[j] = k[j] * w_mid
                R[j] = R20[j] * (1.0 + record.copper_coefficient * (ambient + heat)) + Rx[j] + added[AT_RESISTANCE + j]
            lag = i_bus_2 if forms[F_BUS_R] else i_bus
            bus = record.bus_voltage_Vdc - record.bus_resistance_R * lag
            if forms[F_BUS_V]:
                bus += 0.3 * np.sin(2.0 * np.pi * 300.0 * now)
            seen = p * theta + offset
            if forms[F_ANGLE]:
                seen += 0.2 * offset * np.cos(theta)
            plus, minus = _active_pair(seen, edges)
            turn = p * dt * w_mid
            next_plus, next_minus = _active_pair(seen + turn, edges)
            until_edge = 2.0 * dt
            if not sampled and (next_plus != plus or next_minus != minus):
                low, high = 0.0, 1.0
                for _ in range(30):
                    half = 0.5 * (low + high)
                    now_plus, now_minus = _active_pair(seen + half * turn, edges)
                    if now_plus == plus and now_minus == minus:
                        low = half
                    else:
                        high = half
                until_edge = high * dt
            drift = 1.0 + (0.3 * (now - 0.5) if forms[F_OFFSET] else 0.0)

            # currents through the step, cut at commutations, comparator trips and free-wheel zeros
            torque = loss = charge = 0.0
            left, cuts = dt, 0
            while left > 1e-15 and cuts < 60:
                cuts += 1
                pair = 0.5 * (
                    _sense(i[plus], g[plus], o[plus] * drift, forms[F_GAIN])
                    - _sense(i[minus], g[minus], o[minus] * drift, forms[F_GAIN])
                )
                if forward and pair >= I_ref + h - 1e-12:
                    forward = False
                elif not forward and pair <= I_ref - h + 1e-12:
                    forward = True
                off = 3 - plus - minus
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
                    terminal = _slopes(i, base, Rds, R, L, s, smooth, e, conducts, k1) + e[off]
                    if terminal < -Vf - 1e-9:
                        diode[off] = 1.0
                    elif terminal > bus + Vf + 1e-9:
                        diode[off] = -1.0
                if diode[off] != 0.0:
                    conducts[off] = True
                    base[off] = -Vf if diode[off] > 0.0 else bus + Vf
                tau = min(left, until_edge)
                _advance(i, tau, base, Rds, R, L, s, smooth, e, conducts, k1, middle, k2, new)
                # each event shortens the step to its own crossing, so that the earlier of two is what remains
                ended = False
                if diode[off] != 0.0 and diode[off] * new[off] < 0.0:
                    ended = True
                    low, high = 0.0, tau
                    g_low, g_high = diode[off] * i[off], diode[off] * new[off]
                    for _ in range(30):
                        tau = low + (high - low) * g_low / (g_low - g_high)
                        _advance(i, tau, base, Rds, R, L, s, smooth, e, conducts, k1, middle, k2, new)
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
                        _sense(new[plus], g[plus], o[plus] * drift, forms[F_GAIN])
                        - _sense(new[minus], g[minus], o[minus] * drift, forms[F_GAIN])
                    )
                    - limit
                )
                before = side * (pair - limit)
                if beyond > 0.0 and before < 0.0 and not sampled:
                    low, high, g_low, g_high = 0.0, tau, before, beyond
                    for _ in range(30):
                        tau = low + (high - low) * g_low / (g_low - g_high)
                        _advance(i, tau, base, Rds, R, L, s, smooth, e, conducts, k1, middle, k2, new)
                        value = side * (
                            0.5
                            * (
                                _sense(new[plus], g[plus], o[plus] * drift, forms[F_GAIN])
                                - _sense(new[minus], g[minus], o[minus] * drift, forms[F_GAIN])
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
                    sum_i[j] += tau * _sense(mean, g[j], o[j] * drift, forms[F_GAIN])
                    voltage = e[j]
                    if conducts[j]:
                        voltage += R[j] * mean + _inductance(L[j], s, middle[j], smooth) * k2[j]
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

            # mechanics over the step
            T_load = record.load_constant_T
            if forms[F_LOAD]:
                T_load *= 1.0 - 0.2 * np.exp(-now / 0.1)
            stiffness = record.load_spring_c
            if forms[F_SPRING]:
                stiffness *= 1.0 + 0.3 * (theta_u / 0.15) ** 2
            T_load += stiffness * theta_u
            B = record.viscous_friction
            drag = B * record.viscous_friction_scale * w
            if forms[F_VISCOUS]:
                drag = B * w + (record.viscous_friction_scale - 1.0) * B * np.sign(w) * abs(w) ** 0.8 * 100.0**0.2
            active = torque * (1.0 + added[AT_TORQUE_CONSTANT]) - drag + added[AT_TORQUE]
            if record.cogging_a != 0.0:
                active -= record.cogging_a * np.sin(slots * theta)
            if forms[F_COGGING]:
                active -= 0.25 * record.cogging_a * np.sin(2.0 * slots * theta + 0.5)
            play = record.backlash_blk
            if forms[F_PLAY]:
                play *= 1.0 + 0.3 * np.sin(40.0 * theta_u)
            T_shaft = T_load
            if compliant:
                twist = (theta - record.theta_0) / ratio - theta_u
                T_shaft = 0.0
                if abs(twist) > 0.5 * play:
                    wound = twist - np.sign(twist) * 0.5 * play
                    K = record.compliance_K
                    if forms[F_COMPLIANCE]:
                        K *= 1.0 + (wound / 1e-3) ** 2
                    T_shaft = K * wound + record.compliance_C * (w / ratio - w_u)
            active -= T_shaft / ratio
            if forms[F_INERTIA]:
                coupling = (inertia_scale - 1.0) * J0 / 2e-3
                active -= coupling * (w - w_disc)
                w_disc += dt * (w - w_disc) / 2e-3

            direction = np.sign(w) if w != 0.0 else np.sign(active)
            level = Tcoulomb
            if forms[F_LEVEL]:
                level *= 1.0 + 0.1 * np.cos(theta)
            asymmetry = record.friction_asymmetry_a * direction
            if forms[F_ASYMMETRY]:
                asymmetry = record.friction_asymmetry_a * np.tanh(w / 3.0)
            level *= 1.0 + asymmetry
            bump = record.stribeck_a
            static = max(record.static_over_coulomb * level, level + bump)
            if bump != 0.0:
                sliding = level + bump * np.exp(-abs(w) / record.stribeck_w_s)
            else:
                sliding = level
            if forms[F_STRIBECK]:
                peak = sliding + max(0.0, static - level - bump) * np.exp(-((w / 0.2) ** 2))
                before = bristle
                bristle = (bristle + w * dt) / (1.0 + 60.0 * abs(w) / peak * dt)
                T_F = 60.0 * bristle + 0.02 * (bristle - before) / dt
            elif w == 0.0:
                T_F = min(max(active, -static), static)
            else:
                T_F = sliding * direction
            w_new = w + dt * (active - T_F) / (J_motor * (1.0 + added[AT_INERTIA]))
            if not forms[F_STRIBECK] and w * w_new < 0.0:
                w_new = 0.0
            acceleration = (w_new - w) / dt
            theta += 0.5 * dt * (w + w_new)
            position = (theta - record.theta_0) / ratio
            if compliant:
                w_u += dt * (T_shaft - T_load - 2.0 * w_u) / J_shaft
                theta_u += dt * w_u
                if abs(theta_u) >= record.end_stop:
                    theta_u, w_u = np.sign(theta_u) * record.end_stop, 0.0
            else:
                theta_u = min(max(theta_u, position - 0.5 * play), position + 0.5 * play)
                if abs(theta_u) >= record.end_stop and theta_u * w_new > 0.0:
                    side = np.sign(theta_u)
                    theta_u, w_new = side * record.end_stop, 0.0
                    theta = record.theta_0 + ratio * (theta_u + side * 0.5 * play)

            # speed sensor: scale, then lag
            ideal = record.speed_scale_scale * 0.5 * (w + w_new)
            if forms[F_SPEED]:
                ideal = 0.5 * (w + w_new)
                ideal += (record.speed_scale_scale - 1.0) * ideal * (1.0 + 0.3 * np.tanh(abs(ideal) / 100.0))
            w = w_new
            old = w_seen
            if forms[F_LATENCY]:
                w_lag += speed_share * (ideal - w_lag)
                w_seen += speed_share * (w_lag - w_seen)
            else:
                w_seen += speed_share * (ideal - w_seen)
            sum_w += dt * (ideal if speed_share == 1.0 else 0.5 * (old + w_seen))

            # winding temperature and bus
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
            sum_bus += dt * bus

        t = until
        if t >= (rec + 1) * interval - 1e-12:
            mean_v = 0.0
            for j in range(3):
                v = sum_v[j] / interval
                excess = gv[j] - 1.0
                if forms[F_VOLTAGE]:
                    excess *= 1.0 + 0.3 * np.tanh(abs(v) / 3.0)
                phased[0, rec, j] = v * (1.0 + excess)
                weight = 1.0 + (0.01 * (1 - j) if forms[F_NEUTRAL] else 0.0)
                mean_v += weight * phased[0, rec, j] / 3.0
                phased[1, rec, j] = sum_i[j] / interval
                drift = 1.0 + (0.3 * (t - 0.5) if forms[F_OFFSET] else 0.0)
                phased[2, rec, j] = _sense(i[j], g[j], o[j] * drift, forms[F_GAIN])
                sum_v[j] = sum_i[j] = 0.0
            if record.virtual_neutral_on != 0.0:
                for j in range(3):
                    phased[0, rec, j] -= mean_v
            scalar[0, rec] = sum_w / interval
            scalar[1, rec] = theta + offset / p
            if forms[F_ANGLE]:
                scalar[1, rec] += 0.2 * offset / p * np.cos(theta)
            scalar[2, rec] = theta_u
            where = t / Tc
            low_tick = min(int(where + 1e-9), len(command) - 2)
            scalar[3, rec] = command[low_tick] + (where - low_tick) * (command[low_tick + 1] - command[low_tick])
            scalar[4, rec] = sum_bus / interval
            sum_w = sum_bus = 0.0
            rec += 1

"""Statistics of a recording of the actuator: its signals put into the nominal model's equations.

Every statistic is a matched filter ``sum phi r / sqrt(sum phi^2)`` of one equation's residual r with one regressor
phi, so that a term the model lacks shows in the statistics whose regressor looks like it, whatever the trajectory. The
same code runs on measured and on simulated recordings. Residuals use the nominal parameters at the measured ambient
temperature.

A residual holds the noise of its own phase's di/dt, so what is regressed on di/dt takes the other two phases' instead
(their sum is -di/dt) as an instrument z: ``sum z r / sqrt(sum z di/dt)``.
"""

from dataclasses import dataclass

import numpy as np

from ..actuator.compiled import compiled
from ..actuator.motor import AXIS, TWO_PI, trapezoid
from ..actuator.parameters import ActuatorParameters
from ..recording import Recording
from .actuator_layout import (
    ANGLE_BINS,
    BUS_AT,
    COMMUTATION_AT,
    CONTROL_AT,
    EQUATIONS,
    LATTICE,
    ORDERS,
    ORDERS_AT,
    OSCILLATION,
    PER_DIRECTION,
    PER_PHASE,
    POSITION_AT,
    RIPPLE,
    SIZE,
    SPEED_AT,
    SPEED_BINS,
    SPEED_EDGES,
    SUM_I_AT,
    SUM_V_AT,
    TORQUE_AT,
    TORQUE_REST_AT,
)

_MADE_FROM = np.array([(-1, -1), (0, 0), (1, 1), (2, 2), (3, 2), (4, 4), (5, 4), (6, 6)])
MARGIN = np.deg2rad(3.5)  # electrical, kept from the corners of the trapezoid
WINDOW = np.deg2rad(12.0)  # electrical, before and after a commutation
REST_SPEED = 2.0  # rad/s; below it dry friction has no known sign
JUMP_SPEED = 100.0  # rad/s by which the speed reference jumps in one interval when the command steps
REGULATOR_SMOOTHING = 5.0e-4  # s, half span over which the current's reference is averaged before its slope is taken
ORDER_HALF = 3.0e-4  # s, half span over which speed is differenced from angle
LOOK = 300  # values that are looked at first for whether the speed is rounded at all
WEAKEST_INSTRUMENT = 0.05  # of an instrument's power that must be the current's own and not noise
_SPEEDS = np.array(SPEED_EDGES)
_ORDER_LIST = np.array(ORDERS, float)
_COS_AXIS, _SIN_AXIS = np.cos(AXIS), np.sin(AXIS)


@dataclass(frozen=True)
class Nominal:
    """What the equations need of the nominal actuator and of one recording."""

    constants: np.ndarray
    interval: float
    has_end: bool
    has_bus: bool

    @classmethod
    def of(cls, actuator: ActuatorParameters, recording: Recording, theta_0: float) -> "Nominal":
        heat = 1.0 + actuator.copper_coefficient * (recording.ambient_temperature - actuator.reference_temperature)
        a = actuator
        constants = np.array(
            [
                *(a.resistance * heat, a.inductance, a.back_emf, a.pole_pairs, a.inertia, a.viscous_friction),
                *(a.coulomb_friction, a.gear_ratio, theta_0, a.bus_voltage, a.position_gain, a.speed_gain),
                *(a.speed_integral_gain, a.current_limit, a.speed_limit),
            ]
        )
        has_end, has_bus = recording.phase_current_end is not None, recording.bus_voltage is not None
        return cls(constants, recording.interval, has_end, has_bus)


@compiled
def _wrap(x, period):
    """x modulo a period; several times faster than the remainder operator."""
    return x - period * np.floor(x / period)


@compiled
def _put(m, n, phi, r, sums, count, store):
    sums[m, 0] += phi * r
    sums[m, 1] += phi * phi
    if store is not None:  # decided when it is compiled
        count[m] += 1
        store[m, n] = phi


@compiled
def _put_instrument(m, n, z, phi, r, sums, power, count, store):
    """As ``_put`` with an instrument z whose noise is independent of that of r and phi."""
    sums[m, 0] += z * r
    sums[m, 1] += z * phi
    power[m] += z * z
    if store is not None:
        count[m] += 1
        store[m, n] = z


@compiled
def speed_and_acceleration(theta, dt, w, acceleration, slow):
    """Fill speed (rad/s), acceleration and slow acceleration (rad/s2) from centred differences of the angle.

    They span about 0.6, 1 and 8 ms; the slow one is the regressor, so that its noise is not the residual's.
    """
    n = theta.shape[0]
    half = int(max(0.0, round((2.0 * ORDER_HALF / dt - 1.0) / 2.0)))
    reach = int(max(1.0, round(5.0e-4 / dt)))
    for k in range(n):
        high, low = min(n - 1, k + half), max(0, k - 1 - half)
        w[k] = (theta[high] - theta[low]) / ((high - low) * dt) if high > low else 0.0
    for k in range(n):
        high, low = min(n - 1, k + reach), max(0, k - reach)
        acceleration[k] = (w[high] - w[low]) / ((high - low) * dt)
        high, low = min(n - 1, k + 8 * reach), max(0, k - 8 * reach)
        slow[k] = (w[high] - w[low]) / ((high - low) * dt)


@compiled
def electromagnetic_torque(c, dt, i, theta, out):
    """Fill k f i summed over the phases (N m), averaged over the very span of ``speed_and_acceleration``.

    A torque and an acceleration that are averaged alike still balance where both change fast.
    """
    n_time = theta.shape[0]
    k, poles = c[2], c[3]
    half = int(max(0.0, round((2.0 * ORDER_HALF / dt - 1.0) / 2.0)))
    reach = int(max(1.0, round(5.0e-4 / dt)))
    total = np.zeros(n_time + 1)
    for n in range(n_time):
        angle = poles * (0.5 * (theta[n] + theta[max(n - 1, 0)]))
        drive = 0.0
        for j in range(3):
            drive += k * i[n, j] * trapezoid(angle - AXIS[j], np.pi / 6.0)[0]
        total[n + 1] = total[n] + drive
    smooth = np.empty(n_time)
    for n in range(n_time):
        low, high = max(0, n - half), min(n_time - 1, n + half)
        smooth[n] = (total[high + 1] - total[low]) / (high + 1 - low)
    total[0] = 0.0
    for n in range(n_time):
        total[n + 1] = total[n] + smooth[n]
    for n in range(n_time):
        low, high = max(0, n - reach), min(n_time - 1, n + reach)
        inner = total[high + 1] - total[low] - 0.5 * (smooth[low] + smooth[high])
        out[n] = inner / (high - low)


@compiled
def lattice(values):
    """Smallest spacing of rounded values where all spacings are multiples of it, else zero."""
    ordered = np.sort(values)
    spacing = 1.0e9
    for n in range(1, len(ordered)):
        gap = ordered[n] - ordered[n - 1]
        if gap > 1e-9:
            spacing = min(spacing, gap)
    odd = 0
    for n in range(1, len(ordered)):
        times = (ordered[n] - ordered[n - 1]) / spacing
        if abs(times - np.round(times)) > 1e-3:
            odd += 1
    return spacing if spacing > 1e-4 and spacing < 1.0e8 and odd < 0.01 * len(ordered) else 0.0


@compiled
def _shared(inside, span):
    """Share of the pair's mean current that a phase has where an edge at which all current changes over at once lies
    ``inside`` (rad) before the middle of an interval of half-width ``span`` (rad).

    So where the edges fall between the recording instants, which no two runs have alike, leaves no trace.
    """
    if span < 1e-9:
        return 1.0 if inside >= 0.0 else 0.0
    part = min(max(0.5 + 0.5 * inside / span, 0.0), 1.0)
    return 2.0 * part / (2.0 - part) if part < 0.5 else 2.0 * part / (1.0 + part)


@compiled
def fill_statistics(
    c, dt, has_end, has_bus, V, i, i_end, speed, theta, shaft, command, bus, y, norm, count, residual, store
):
    """Fill the statistics of one recording.

    ``c`` constants of ``Nominal``; V, i, i_end (time, phase); the rest (time,); outputs y, norm, count (statistic,),
    residual (equation, time), store (statistic, time) regressors or None to leave them and the counts out.
    """
    R, L, k, poles, J, B, T_c, ratio = c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7]
    theta_0, Vdc, K_pos, K_p, K_i, I_max, w_max = c[8], c[9], c[10], c[11], c[12], c[13], c[14]
    n_time = theta.shape[0]
    sums = np.zeros((y.shape[0], 2))
    count[:] = 0
    power, cross, cross_power, product = np.zeros(y.shape[0]), np.zeros(3), np.zeros(3), np.zeros(2)
    ramp, pairs = np.pi / 6.0, int(np.round(poles))
    w_all, acceleration, slow = np.empty(n_time), np.empty(n_time), np.empty(n_time)
    speed_and_acceleration(theta, dt, w_all, acceleration, slow)
    torque = np.empty(n_time)
    electromagnetic_torque(c, dt, i, theta, torque)
    lag = int(max(1.0, round(0.01 / dt)))  # the regulator's residual is differenced over 10 ms: its drift is only noise
    after_jump = -3 * lag
    regulator, fresh = np.zeros(n_time), np.zeros(n_time, np.int64)
    pair_mean, asked = np.zeros(n_time), np.zeros(n_time)
    integral, demand = 0.0, 0.0
    f, slope, x = np.empty(3), np.empty(3), np.empty(3)
    turn_cos, turn_sin = np.empty(len(ORDERS)), np.empty(len(ORDERS))
    plateau, floating, was_off, sign = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    smooth_play, play_power = 0.0, 0.0
    for n in range(1, n_time):
        t = (n + 0.5) * dt
        w, a, a_slow = w_all[n], acceleration[n], slow[n]
        middle = 0.5 * (theta[n] + theta[n - 1])
        span = 0.5 * poles * abs(theta[n] - theta[n - 1])
        margin = span + MARGIN
        sum_i = i[n, 0] + i[n, 1] + i[n, 2]
        in_motion = abs(w) > REST_SPEED
        # friction turns round at rest: a sample there must not count or not count by a little noise
        weight = min(max(abs(w) / REST_SPEED - 1.0, 0.0), 1.0)
        level = 0.5 * (abs(i[n, 0]) + abs(i[n, 1]) + abs(i[n, 2]))
        cos_1, sin_1 = np.cos(middle), np.sin(middle)
        cos_p, sin_p = cos_1, sin_1
        for _ in range(1, pairs):
            cos_p, sin_p = cos_p * cos_1 - sin_p * sin_1, sin_p * cos_1 + cos_p * sin_1
        turn_cos[0], turn_sin[0] = cos_1, sin_1
        for o in range(1, _ORDER_LIST.shape[0]):
            u, v = _MADE_FROM[o, 0], _MADE_FROM[o, 1]
            turn_cos[o] = turn_cos[u] * turn_cos[v] - turn_sin[u] * turn_sin[v]
            turn_sin[o] = turn_sin[u] * turn_cos[v] + turn_cos[u] * turn_sin[v]
        drive, sum_r, sum_f = torque[n], 0.0, 0.0
        for j in range(3):
            x[j] = _wrap(poles * middle - AXIS[j], TWO_PI)
            half = x[j] if x[j] < np.pi else x[j] - np.pi
            sign[j] = 1.0 if x[j] < np.pi else -1.0
            f[j], slope[j] = sign[j], 0.0
            if not ramp + span < half < np.pi - ramp - span:
                f[j], slope[j] = trapezoid(x[j], ramp)
                if span >= 1e-6:
                    f_low, f_high = trapezoid(x[j] - span, ramp)[0], trapezoid(x[j] + span, ramp)[0]
                    f[j] = (f_low + 4.0 * f[j] + f_high) / 6.0
            sum_f += f[j]
            plateau[j] = 1.0 if ramp + margin < half < np.pi - ramp - margin else 0.0
            off_now = 1.0 if half > np.pi - ramp + margin or half < ramp - margin else 0.0
            floating[j] = off_now * was_off[j]
            was_off[j] = off_now
        for j in range(3):
            others = 0.0
            if has_end:
                di = (i_end[n, j] - i_end[n - 1, j]) / dt
                for q in range(3):
                    if q != j:
                        others -= (i_end[n, q] - i_end[n - 1, q]) / dt
            else:
                di = (i[min(n + 1, n_time - 1), j] - i[n - 1, j]) / (2.0 * dt)
            r = V[n, j] - R * i[n, j] - L * di - k * f[j] * w
            residual[j, n] = r
            sum_r += V[n, j] - k * f[j] * w - L * di - R * i[n, j]
            base = j * PER_PHASE
            if not in_motion:
                # where exactly the rotor comes to rest is chance, and may be at the very edge of a commutation
                if floating[j] > 0.0:
                    _put(SUM_I_AT + 4 + j, n, 1.0, i[n, j], sums, count, store)
                continue
            if plateau[j] > 0.0:
                s = sign[j]
                _put(base, n, s * w, r, sums, count, store)
                _put(base + 1, n, i[n, j], r, sums, count, store)
                _put(base + 2, n, 1.0, r, sums, count, store)
                _put_instrument(base + 3, n, others, di, r, sums, power, count, store)
                square = i[n, j] * i[n, j]
                _put_instrument(base + 4, n, square * others, square * di, r, sums, power, count, store)
                cross[j] += square * others * di
                cross_power[j] += square * others * others
                _put(base + 5, n, s * w * cos_1, r, sums, count, store)
                _put(base + 6, n, s * w * sin_1, r, sums, count, store)
                _put(base + 7, n, i[n, j] * t, r, sums, count, store)
                _put(base + 8, n, s * w * t, r, sums, count, store)
                _put(base + 9, n, abs(i[n, j]) * i[n, j], r, sums, count, store)
                _put(base + 10, n, s, r, sums, count, store)
            elif floating[j] > 0.0:
                _put(base + 11, n, f[j] * w, r, sums, count, store)
                _put(base + 12, n, slope[j] * w, r, sums, count, store)
                _put(base + 13, n, 1.0, r, sums, count, store)
                _put(base + 14, n, f[j] * w * cos_1, r, sums, count, store)
                _put(base + 15, n, f[j] * w * sin_1, r, sums, count, store)
                _put(SUM_I_AT + 4 + j, n, 1.0, i[n, j], sums, count, store)
            else:
                _put_instrument(base + 16, n, others, di, r, sums, power, count, store)
                _put(base + 17, n, i[n, j], r, sums, count, store)
                _put(base + 18, n, f[j] * w, r, sums, count, store)
            if span < 0.35:
                # sin 5x and sin 7x as polynomials of sin x
                sx = sin_p * _COS_AXIS[j] - cos_p * _SIN_AXIS[j]
                s2 = sx * sx
                sin_5 = sx * (5.0 + s2 * (-20.0 + 16.0 * s2))
                sin_7 = sx * (7.0 + s2 * (-56.0 + s2 * (112.0 - 64.0 * s2)))
                _put(base + 19, n, w * sin_5, r, sums, count, store)
                _put(base + 20, n, w * sin_7, r, sums, count, store)
                _put(base + 21 + min(ANGLE_BINS - 1, int(x[j] / TWO_PI * ANGLE_BINS)), n, w, r, sums, count, store)
        # ---- sums over the phases
        residual[3, n] = sum_i
        _put(SUM_I_AT, n, 1.0, sum_i, sums, count, store)
        for j in range(3):
            _put(SUM_I_AT + 1 + j, n, i[n, j], sum_i, sums, count, store)
        residual[4, n] = sum_r
        if in_motion:
            _put(SUM_V_AT, n, 1.0, sum_r, sums, count, store)
            _put(SUM_V_AT + 1, n, sum_f * w, sum_r, sums, count, store)
        # ---- speed sensor against the angle
        r = speed[n] - (theta[n] - theta[n - 1]) / dt
        residual[5, n] = r
        _put(SPEED_AT, n, 1.0, r, sums, count, store)
        _put(SPEED_AT + 1, n, w, r, sums, count, store)
        _put(SPEED_AT + 2, n, a_slow, r, sums, count, store)
        _put(SPEED_AT + 3, n, 1.0 if w > 0.0 else -1.0, r, sums, count, store)
        # ---- torque balance in motion
        if in_motion:
            d = 1.0 if w > 0.0 else -1.0
            r = drive - J * a - B * w - T_c * d
            residual[6, n] = r
            base = TORQUE_AT if d > 0.0 else TORQUE_AT + PER_DIRECTION
            _put(base, n, weight * d, r, sums, count, store)
            _put(base + 1, n, weight * w, r, sums, count, store)
            _put(base + 2, n, weight * a_slow, r, sums, count, store)
            for b in range(_SPEEDS.shape[0] - 1):
                if _SPEEDS[b] <= abs(w) < _SPEEDS[b + 1]:
                    _put(base + 3 + b, n, weight * d, r, sums, count, store)
            _put(TORQUE_REST_AT, n, weight * shaft[n], r, sums, count, store)
            _put(TORQUE_REST_AT + 1, n, weight * drive, r, sums, count, store)
            _put(TORQUE_REST_AT + 2, n, weight * d * t, r, sums, count, store)
            for o in range(_ORDER_LIST.shape[0]):
                reach = _ORDER_LIST[o] * abs(w) * dt
                if reach < 2.0:
                    _put(ORDERS_AT + 2 * o, n, weight * turn_cos[o], r, sums, count, store)
                    _put(ORDERS_AT + 2 * o + 1, n, weight * turn_sin[o], r, sums, count, store)
        # ---- play between the rotor and the user shaft
        r = shaft[n] - (middle + 0.5 * (theta[n] - theta[n - 1]) - theta_0) / ratio
        residual[7, n] = r
        smooth_play += (r - smooth_play) * min(1.0, dt / 5.0e-3)
        play_power += (r - smooth_play) ** 2
        if in_motion:
            _put(POSITION_AT + (0 if w > 0.0 else 1), n, weight, r, sums, count, store)
        _put(POSITION_AT + 2, n, a_slow, r, sums, count, store)
        _put(POSITION_AT + 3, n, w, r, sums, count, store)
        _put(POSITION_AT + 4, n, drive, r, sums, count, store)
        # ---- bus
        if has_bus:
            r = bus[n] - Vdc
            residual[8, n] = r
            _put(BUS_AT, n, 1.0, r, sums, count, store)
            _put(BUS_AT + 1, n, level, r, sums, count, store)
            _put(BUS_AT + 2, n, drive * w, r, sums, count, store)
            product[0] += level
            product[1] += drive * w
        # ---- controller: measured pair current against the reference that the recorded inputs give
        w_ref = min(max(ratio * K_pos * (command[n] - shaft[n]), -w_max), w_max)
        error = w_ref - speed[n]
        before = demand
        advanced = integral + error * dt
        demand = K_p * error + K_i * advanced
        if abs(demand) > I_max:
            demand = min(max(K_p * error + K_i * integral, -I_max), I_max)
        else:
            integral = advanced
        plus = minus = 0
        for j in range(3):
            shifted = _wrap(x[j] - ramp, TWO_PI)
            if shifted < 2.0 * np.pi / 3.0:
                plus = j
            elif np.pi <= shifted < 5.0 * np.pi / 3.0:
                minus = j
        pair_mean[n] = 0.5 * (i[n, plus] - i[n, minus])
        regulator[n], asked[n] = pair_mean[n] - before, demand
        if abs(command[n] - command[n - 1]) * ratio * K_pos > JUMP_SPEED:
            after_jump = n  # when within its interval a step came is not recorded
        fresh[n] = n - after_jump
        # ---- currents around the commutations
        if in_motion and abs(pair_mean[n]) > 0.2:
            for j in range(3):
                half = x[j] if x[j] < np.pi else x[j] - np.pi
                share = min(max(sign[j] * i[n, j] / pair_mean[n], -0.5), 1.5)
                base = COMMUTATION_AT + 4 * j
                on, off = half - ramp, np.pi - ramp - half  # electrical angle inside the two edges
                if -WINDOW < on < 0.0:
                    _put(base, n, 1.0, share - _shared(on, span), sums, count, store)
                elif 0.0 <= on < WINDOW:
                    _put(base + 1, n, 1.0, share - _shared(on, span), sums, count, store)
                elif 0.0 < off < WINDOW:
                    _put(base + 2, n, 1.0, share - _shared(off, span), sums, count, store)
                elif -WINDOW < off <= 0.0:
                    _put(base + 3, n, 1.0, share - _shared(off, span), sums, count, store)
    # ---- the regulator's residual beside the slope of its reference, smooth so that noise does not drown it
    reach = int(max(1.0, round(REGULATOR_SMOOTHING / dt)))
    total = np.zeros(n_time + 1)
    for n in range(n_time):
        total[n + 1] = total[n] + asked[n]
    span_all = 6 * reach + 1
    for n in range(max(lag, span_all), n_time - span_all):
        if fresh[n] > 2 * lag and fresh[n + span_all] > 0:
            r = regulator[n] - regulator[n - lag]
            residual[9, n] = r
            for m in range(3):
                at = n + 2 * reach * (1 - m)
                later = total[at + 2 * reach + 1] - total[at + 1]
                earlier = total[at] - total[at - 2 * reach]
                _put(CONTROL_AT + m, n, (later - earlier) / (2 * reach), r, sums, count, store)
    y[:] = sums[:, 0]
    norm[:] = sums[:, 1] + 1e-12
    # i^2 counts from its mean by the instrument's weight: an inductance that is merely another leaves no trace then
    for j in range(3):
        m = j * PER_PHASE + 3
        if norm[m] > WEAKEST_INSTRUMENT * power[m]:
            mean = cross[j] / norm[m]
            y[m + 1] -= mean * y[m]
            norm[m + 1] -= mean * cross[j]
            power[m + 1] += mean * (mean * power[m] - 2.0 * cross_power[j])
            if store is not None:
                store[m + 1] -= mean * store[m]
    if has_bus:
        # current and power likewise, so that a supply that is merely another leaves its trace in the constant alone
        for m in (BUS_AT + 1, BUS_AT + 2):
            mean = product[m - BUS_AT - 1] / norm[BUS_AT]
            y[m] -= mean * y[BUS_AT]
            norm[m] = max(norm[m] - mean * product[m - BUS_AT - 1], 1e-3 * norm[m])
            if store is not None:
                store[m] -= mean * store[BUS_AT]
    for m in range(y.shape[0]):
        if norm[m] < WEAKEST_INSTRUMENT * power[m]:
            norm[m] = WEAKEST_INSTRUMENT * power[m]
            count[m] = 0
        y[m] /= np.sqrt(norm[m])
    if not has_end:
        # mean currents cannot give di/dt across a switching ripple: what is regressed on it says nothing
        count[RIPPLE] = 0
    y[LATTICE] = lattice(speed[:: n_time // LOOK + 1])
    if y[LATTICE] > 0.0:  # so few values tell that there is none, but not its spacing
        y[LATTICE] = lattice(speed)
    if y[LATTICE] > 0.0:
        count[CONTROL_AT:COMMUTATION_AT] = 0  # the slope of a reference made of rounded speeds is that of the rounding
    count[LATTICE] = n_time
    norm[LATTICE] = 1.0
    y[OSCILLATION] = np.sqrt(play_power / n_time)
    count[OSCILLATION] = n_time
    norm[OSCILLATION] = 1.0


@dataclass(frozen=True)
class Computed:
    """Statistics, norms and counts (statistic,), residuals (equation, time), regressors (statistic, time) or (0, 0).

    Counts are those of a recording whose regressors were kept.
    """

    values: np.ndarray
    norm: np.ndarray
    count: np.ndarray
    residual: np.ndarray
    regressors: np.ndarray

    def over(self, norm: np.ndarray) -> np.ndarray:
        """(statistic,) values with some as slopes times the square root of another recording's norms.

        How many samples fall into a bin of speed, and how much ripple they show, differs between two runs of the same
        physics; a mean and a slope do not.
        """
        out = self.values.copy()
        for alike, most in ((RIPPLE, 1e3), (SPEED_BINS, 4.0)):
            out[alike] *= np.sqrt(np.clip(norm[alike] / self.norm[alike], 1.0 / most, most))
        return out


_NO_BUS = np.zeros(1)


def compute(nominal: Nominal, signals: dict, keep: bool = False) -> Computed:
    """Statistics of one recording given as arrays of its signals; ``keep`` also returns regressors."""
    n = len(signals["rotor_angle"])
    y, norm, count = np.empty(SIZE), np.empty(SIZE), np.empty(SIZE, np.int64)
    residual = np.zeros((len(EQUATIONS), n))
    store = np.zeros((SIZE, n)) if keep else None
    end = signals["phase_current_end"] if nominal.has_end else signals["phase_current"]
    bus = signals["bus_voltage"] if nominal.has_bus else _NO_BUS
    fill_statistics(
        nominal.constants, nominal.interval, nominal.has_end, nominal.has_bus,
        signals["phase_voltage"], signals["phase_current"], end, signals["rotor_speed"], signals["rotor_angle"],
        signals["output_position"], signals["commanded_position"], bus, y, norm, count, residual, store,
    )  # fmt: skip
    return Computed(y, norm, count, residual, np.zeros((0, 0)) if store is None else store)

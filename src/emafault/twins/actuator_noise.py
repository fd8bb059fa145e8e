"""Noise of a recording's channels, and the covariance it gives the statistics.

A statistic is a weighted sum of residuals and a residual a weighted sum of recorded values, so the weight of every
recorded value in every statistic is known, and the covariance follows from the channels' variances.
"""

import numpy as np

from ..actuator.motor import AXIS, TWO_PI
from .actuator_layout import (
    BUS_AT,
    COMMUTATION_AT,
    CONTROL_AT,
    LATTICE,
    OSCILLATION,
    PER_PHASE,
    POSITION_AT,
    SIZE,
    SPEED_AT,
    SUM_I_AT,
    SUM_V_AT,
    TORQUE_AT,
)
from .actuator_statistics import ORDER_HALF, REST_SPEED, Computed, Nominal

#: channel -> recorded signal
CHANNELS = {
    "voltage": "phase_voltage",
    "current": "phase_current",
    "current_end": "phase_current_end",
    "speed": "rotor_speed",
    "angle": "rotor_angle",
    "position": "output_position",
    "bus_voltage": "bus_voltage",
}
LATTICE_DEVIATION = 2e-3  # rad/s


def third_difference_deviation(values: np.ndarray) -> float:
    """Noise (1 sigma) of a slowly varying signal from its third difference, robust against outliers."""
    third = np.diff(values, 3)
    return float(np.median(np.abs(third)) / 0.6745 / np.sqrt(20.0)) if len(third) else 0.0


def channel_spread(signals: dict, nominal: Nominal) -> dict[str, float]:
    """Spread of each channel at the sample scale (SI): noise and whatever the machine itself does that fast.

    Currents and voltages are taken where a phase floats and the rotor turns, for there the current is zero and the
    voltage smooth; a recording without such samples leaves these channels out.
    """
    p, theta = nominal.constants[3], signals["rotor_angle"]
    middle = 0.5 * (theta[1:] + theta[:-1])
    span = 0.5 * p * np.abs(np.diff(theta))
    out = {}
    reach = max(1, round(2e-3 / nominal.interval))
    speed = np.abs(theta[2 * reach :] - theta[: -2 * reach]) / (2 * reach * nominal.interval)
    turning = np.interp(np.arange(len(middle)), np.arange(len(speed)) + reach, speed) > REST_SPEED
    currents, ends, voltages = [], [], []
    for j in range(3):
        half = (p * middle - AXIS[j]) % np.pi
        off = np.minimum(half, np.pi - half) + span < np.pi / 6 - np.deg2rad(3.5)
        off[1:] &= off[:-1]
        off &= turning
        rows = np.flatnonzero(off) + 1
        if len(rows) < 20:
            continue
        currents.append(np.std(signals["phase_current"][rows, j]))
        if nominal.has_end:
            ends.append(np.std(signals["phase_current_end"][rows, j]))
        v = signals["phase_voltage"][:, j]
        follow = rows[:-2][(np.diff(rows, 2) == 0) & (np.diff(rows[:-1]) == 1)]
        if len(follow) > 20:
            voltages.append(np.std(v[follow + 2] - 2 * v[follow + 1] + v[follow]) / np.sqrt(6.0))
    for name, found in (("current", currents), ("current_end", ends), ("voltage", voltages)):
        if found:
            out[name] = float(np.median(found))
    out["speed"] = third_difference_deviation(signals["rotor_speed"])
    out["angle"] = third_difference_deviation(theta)
    out["position"] = third_difference_deviation(signals["output_position"])
    if nominal.has_bus:
        out["bus_voltage"] = third_difference_deviation(signals["bus_voltage"])
    return out


def _speed_transpose(weights: np.ndarray, dt: float) -> np.ndarray:
    """Weights on speed (row, time) -> weights on the angle samples: transpose of the centred difference."""
    n = weights.shape[1]
    half = int(max(0.0, round((2.0 * ORDER_HALF / dt - 1.0) / 2.0)))
    k = np.arange(n)
    high, low = np.minimum(n - 1, k + half), np.maximum(0, k - 1 - half)
    scaled = weights / (np.maximum(high - low, 1) * dt)
    return _scatter(scaled, high) - _scatter(scaled, low)


def _acceleration_transpose(weights: np.ndarray, dt: float) -> np.ndarray:
    n = weights.shape[1]
    reach = int(max(1.0, round(5.0e-4 / dt)))
    k = np.arange(n)
    high, low = np.minimum(n - 1, k + reach), np.maximum(0, k - reach)
    scaled = weights / ((high - low) * dt)
    return _speed_transpose(_scatter(scaled, high) - _scatter(scaled, low), dt)


def _scatter(weights: np.ndarray, index: np.ndarray) -> np.ndarray:
    """Sum of columns by index; the index is clipped at one end and otherwise a shift, so slices do."""
    n = weights.shape[1]
    out = np.zeros_like(weights)
    shift = int(np.median(index - np.arange(n)))
    if shift >= 0:
        out[:, shift:] += weights[:, : n - shift]
        out[:, n - 1] += weights[:, n - shift :].sum(1)
    else:
        out[:, : n + shift] += weights[:, -shift:]
        out[:, 0] += weights[:, :-shift].sum(1)
    return out


def _f(x: np.ndarray) -> np.ndarray:
    """Unit trapezoid with a 120 degree plateau; x electrical rad."""
    return np.clip(np.arcsin(np.sin(x)) / (np.pi / 6.0), -1.0, 1.0)


def noise_covariance(by_channel: dict[str, np.ndarray], noise: dict[str, float]) -> np.ndarray:
    """(statistic, statistic) covariance of one recording's statistics under independent noise of its channels."""
    cov = sum(noise[channel] ** 2 * share for channel, share in by_channel.items())
    assert isinstance(cov, np.ndarray)
    cov[LATTICE, LATTICE] = LATTICE_DEVIATION**2
    return cov


def covariance_by_channel(nominal: Nominal, signals: dict, computed: Computed) -> dict[str, np.ndarray]:
    """Channel -> (statistic, statistic) covariance of one recording's statistics under unit noise of that channel."""
    c, dt = nominal.constants, nominal.interval
    R, L, k, poles, J, B, ratio, K_pos, K_p = c[0], c[1], c[2], c[3], c[4], c[5], c[7], c[10], c[11]
    phi = computed.regressors / np.sqrt(computed.norm)[:, None]
    theta = signals["rotor_angle"]
    n = len(theta)
    middle = theta.copy()
    middle[1:] = 0.5 * (theta[1:] + theta[:-1])
    f = _f((poles * middle[:, None] - AXIS) % TWO_PI)
    by_channel = {channel: np.zeros((SIZE, SIZE)) for channel in CHANNELS}

    def add(rows: np.ndarray, weights: np.ndarray, channel: str) -> None:
        by_channel[channel][np.ix_(rows, rows)] += weights @ weights.T

    def ends(weights: np.ndarray) -> np.ndarray:
        """Weights of di/dt on the currents it is formed from."""
        out = np.zeros_like(weights)
        if nominal.has_end:
            out[:, :] += weights / dt
            out[:, :-1] -= weights[:, 1:] / dt
        else:
            out[:, 1:] += weights[:, :-1] / (2 * dt)
            out[:, :-1] -= weights[:, 1:] / (2 * dt)
        return out

    sums_i = np.arange(SUM_I_AT, SUM_V_AT)
    sums_v = np.arange(SUM_V_AT, SPEED_AT)
    speeds = np.arange(SPEED_AT, LATTICE)
    torque = np.arange(TORQUE_AT, POSITION_AT)
    shares = np.arange(COMMUTATION_AT, SIZE)
    plus = np.argmax(f, axis=1)
    minus = np.argmin(f, axis=1)
    i = signals["phase_current"]
    pair = 0.5 * (i[np.arange(n), plus] - i[np.arange(n), minus])
    per_pair = np.where(np.abs(pair) > 0.2, 1.0 / np.where(np.abs(pair) > 0.2, pair, 1.0), 0.0)
    for j in range(3):
        own = np.arange(j * PER_PHASE, (j + 1) * PER_PHASE)
        electrical = np.concatenate([own, sums_v])
        add(electrical, phi[electrical], "voltage")
        floating_only = np.array([m for m in sums_i if m < SUM_I_AT + 4 or m == SUM_I_AT + 4 + j])
        share = shares[4 * j : 4 * j + 4]
        rows = np.concatenate([electrical, floating_only, torque, share])
        weights = np.concatenate(
            [-R * phi[electrical], phi[floating_only], k * f[:, j] * phi[torque], phi[share] * per_pair]
        )
        if not nominal.has_end:
            weights[: len(electrical)] += ends(-L * phi[electrical])
        add(rows, weights, "current")
        if nominal.has_end:
            add(electrical, ends(-L * phi[electrical]), "current_end")
    control = np.arange(CONTROL_AT, COMMUTATION_AT)
    lag = int(max(1.0, round(0.01 / dt)))
    demand = np.zeros((len(control), n))
    demand[:, :-1] -= K_p * phi[control][:, 1:]
    demand[:, : n - lag - 1] += K_p * phi[control][:, lag + 1 :]
    add(np.concatenate([speeds, control]), np.concatenate([phi[speeds], -demand]), "speed")
    position = np.arange(POSITION_AT, OSCILLATION)
    add(
        np.concatenate([position, control]),
        np.concatenate([phi[position], -ratio * K_pos * demand]),
        "position",
    )
    # the angle enters through speed and acceleration
    rows = np.concatenate([np.arange(3 * PER_PHASE), sums_v, torque])
    on_speed = np.concatenate(
        [-k * f[:, j] * phi[j * PER_PHASE : (j + 1) * PER_PHASE] for j in range(3)]
        + [-k * f.sum(1) * phi[sums_v], -B * phi[torque]]
    )
    weights = _speed_transpose(on_speed, dt)
    weights[-len(torque) :] += _acceleration_transpose(-J * phi[torque], dt)
    difference = phi[speeds] / dt
    step = -difference
    step[:, :-1] += difference[:, 1:]
    rows = np.concatenate([rows, speeds, position])
    add(rows, np.concatenate([weights, step, -phi[position] / ratio]), "angle")
    if nominal.has_bus:
        buses = np.arange(BUS_AT, BUS_AT + 3)
        add(buses, phi[buses], "bus_voltage")
    by_channel["position"][OSCILLATION, OSCILLATION] = 1.0 / n
    return by_channel

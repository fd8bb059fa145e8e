"""Which samples each of the generator's statistics adds up, and with what weight. Compiled, for it is asked often.

Of every kind there are means over time; the phases' are sorted by electrical angle, direction and speed besides, and
currents and torque weighed by their orders of the rotor angle.
"""

import numpy as np

from ..compiled import compiled, compiled_inline

ALPHA = np.arange(3) * 2.0 * np.pi / 3.0
TIME_BINS, ANGLE_BINS = 12, 24
TWO_PI = 2.0 * np.pi
BACK = np.exp(-1j * ALPHA)
ORDERS = 9  # of a current: its mean, cosine and sine of orders 1, 2, 5 and 7
#: kind -> how many statistics it has, in the order in which they stand
SIZES = {"mismatch": TIME_BINS, "twist": 6, "torque": TIME_BINS + 8, "lag": 1, "bus": TIME_BINS}
SIZES |= {f"current_{j}": 2 * ORDERS for j in range(3)}
SIZES |= {f"voltage_{j}": 4 * ANGLE_BINS + TIME_BINS + 2 for j in range(3)}
KINDS = tuple(SIZES)
CELLS = sum(SIZES.values())
_AT = dict(zip(KINDS, np.cumsum([0, *SIZES.values()])[:-1].tolist(), strict=True))
PARTS = {kind: slice(_AT[kind], _AT[kind] + size) for kind, size in SIZES.items()}
MISMATCH, TWIST, TORQUE, LAG, BUS = (_AT[kind] for kind in KINDS[:5])
CURRENT, VOLTAGE = _AT["current_0"], _AT["voltage_0"]
#: kind of each entry that a sample makes
OWNER = np.array([0, 1, 3, 4, *[2] * 9, *(k for j in range(3) for k in [5 + j] * ORDERS + [8 + j] * 4)])
ENTRIES = len(OWNER)


@compiled_inline
def visit(middle, speed, some, time_bin, poles, half_speed, index, weight):
    """Fill the cells ``index`` and weights ``weight`` (entry,) of one sample.

    Parameters
    ----------
    middle : rotor angle in the middle of the interval (rad)
    speed, half_speed : rotor speed, and what is fast (rad/s)
    some : 1 where the rotor moves for good, else 0
    """
    forward = 1 if speed > 0.0 else 0
    turn = complex(np.cos(middle), np.sin(middle))
    electrical = complex(np.cos(poles * middle), np.sin(poles * middle))
    turn_2 = turn * turn
    turn_4 = turn_2 * turn_2
    turn_8 = turn_4 * turn_4
    turn_24 = turn_8 * turn_8 * turn_8
    turn_72 = turn_24 * turn_24 * turn_24
    index[0], index[1] = MISMATCH + time_bin, TWIST + time_bin * 3 // TIME_BINS + 3 * forward
    index[2], index[3], index[4] = LAG, BUS + time_bin, TORQUE + time_bin
    weight[0], weight[1], weight[2], weight[3], weight[4] = some, some, some, 1.0, some
    e = 5
    for wave in (turn_72, turn_72 * turn_72, turn_24, turn):
        index[e], weight[e] = TORQUE + TIME_BINS + e - 5, wave.real * some
        index[e + 1], weight[e + 1] = TORQUE + TIME_BINS + e - 4, wave.imag * some
        e += 2
    for j in range(3):
        first = CURRENT + 2 * ORDERS * j + ORDERS * (1 - forward)
        index[e], weight[e] = first, some
        wave = electrical * BACK[j]
        wave_2 = wave * wave
        wave_5 = wave * wave_2 * wave_2
        n = 1
        for order in (wave, wave_2, wave_5, wave_5 * wave_2):
            index[e + n], weight[e + n] = first + n, order.real * some
            index[e + n + 1], weight[e + n + 1] = first + n + 1, order.imag * some
            n += 2
        e += ORDERS
        x = (poles * middle - ALPHA[j]) % TWO_PI
        f = min(max(6.0 * abs((x / np.pi - 0.5) % 2.0 - 1.0) - 3.0, -1.0), 1.0)
        first = VOLTAGE + (4 * ANGLE_BINS + TIME_BINS + 2) * j
        cell = min(int(x / TWO_PI * ANGLE_BINS), ANGLE_BINS - 1) + ANGLE_BINS * forward
        if abs(speed) > half_speed:
            cell += 2 * ANGLE_BINS
        index[e], weight[e] = first + cell, some
        index[e + 1], weight[e + 1] = first + 4 * ANGLE_BINS + time_bin, 0.0
        if abs(f) > 0.9:
            weight[e + 1] = some * np.sign(f * speed)
        index[e + 2], weight[e + 2] = first + 4 * ANGLE_BINS + TIME_BINS, f * speed * turn.real * some
        index[e + 3], weight[e + 3] = first + 4 * ANGLE_BINS + TIME_BINS + 1, f * speed * turn.imag * some
        e += 4


@compiled
def add_up(middle, speed, some, time_bin, poles, half_speed, features, sums, power):
    """Add features (kind, time), in the order of ``KINDS``, and squared weights to ``sums`` and ``power`` (cell,).

    middle (rad), speed (rad/s), some, time_bin : (time,), see ``visit``
    """
    index, weight = np.zeros(ENTRIES, np.int64), np.zeros(ENTRIES)
    for t in range(len(middle)):
        visit(middle[t], speed[t], some[t], time_bin[t], poles, half_speed, index, weight)
        for e in range(ENTRIES):
            sums[index[e]] += weight[e] * features[OWNER[e], t]
            power[index[e]] += weight[e] * weight[e]


@compiled
def weights(middle, speed, some, time_bin, poles, half_speed):
    """(cell, time) weights; arguments as those of ``add_up``."""
    rows = np.zeros((CELLS, len(middle)))
    index, weight = np.zeros(ENTRIES, np.int64), np.zeros(ENTRIES)
    for t in range(len(middle)):
        visit(middle[t], speed[t], some[t], time_bin[t], poles, half_speed, index, weight)
        for e in range(ENTRIES):
            rows[index[e], t] = weight[e]
    return rows

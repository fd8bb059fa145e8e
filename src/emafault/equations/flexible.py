"""The user shaft driven through its play by a given motion of the gear, rigidly or behind a stiffness."""

import numpy as np

from ..compiled import compiled

LONGEST = 5e-5  # s, of a step of the integration


@compiled
def flexible_shaft(gear, interval, K, C, J, ground, play):
    """Angle of the user shaft (rad) and torque that it takes from the gear (N m, mean over each interval).

    ``gear`` (sample,) angle of the gear (rad) at the ends of the intervals, at rest before the first; ``K`` (N m/rad),
    ``C`` and ``ground`` (N m s/rad), ``J`` (kg m2), ``play`` (rad, total). The damping may pull, in contact only.
    """
    n = gear.shape[0]
    position, torque = np.empty(n), np.empty(n)
    steps = int(np.ceil(interval / LONGEST))
    h = interval / steps
    x, v, start, slope = 0.0, 0.0, gear[0], 0.0
    for m in range(n):
        # the gear's motion between samples: the cubic through both, with the slopes of their neighbours' secants
        step, end = gear[m] - start, 0.5 * (gear[min(m + 1, n - 1)] - start)
        bend, turn = 3.0 * step - 2.0 * slope - end, slope + end - 2.0 * step
        total = 0.0
        for k in range(steps):
            s = (k + 0.5) / steps
            g = start + s * (slope + s * (bend + s * turn))
            rate = (slope + s * (2.0 * bend + 3.0 * s * turn)) / interval
            gap = g - x
            at = gap - 0.5 * h * v  # in the middle of the step, as g is
            side = 1.0 if at > 0.5 * play else (-1.0 if at < -0.5 * play else 0.0)
            stiffness, damping = (K, C) if side != 0.0 else (0.0, 0.0)
            # implicit midpoint rule: second order, and stable however fast the damping is
            twist = gap - 0.5 * side * play
            half = 0.5 * h / J
            middle = (v + half * (stiffness * twist + damping * rate)) / (
                1.0 + half * (0.5 * h * stiffness + damping + ground)
            )
            push = stiffness * (twist - 0.5 * h * middle) + damping * (rate - middle)
            x += h * middle
            v = 2.0 * middle - v
            total += push
        start, slope = gear[m], end
        position[m], torque[m] = x, total / steps
    return position, torque


@compiled
def through_play(gear, half):
    """Angle of the shaft behind a play of half-width ``half`` (rad), and its derivative by ``half``."""
    out, slope = np.empty(gear.shape[0]), np.empty(gear.shape[0])
    at, by = 0.0, 0.0
    for n in range(gear.shape[0]):
        if gear[n] - half > at:
            at, by = gear[n] - half, -1.0
        elif gear[n] + half < at:
            at, by = gear[n] + half, 1.0
        out[n], slope[n] = at, by
    return out, slope

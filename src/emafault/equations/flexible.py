"""The user shaft driven through its play by a given motion of the gear, rigidly or behind a stiffness."""

import numpy as np

from ..compiled import compiled, compiled_inline

LONGEST = 5e-5  # s, of a step of the integration


@compiled
def flexible_shaft(gear, interval, K, C, J, ground, play, load=0.0, spring=0.0):
    """Angle of the user shaft (rad) and torque that it takes from the gear (N m, mean over each interval).

    ``gear`` (sample,) angle of the gear (rad) at the ends of the intervals, at rest before the first; ``K`` (N m/rad),
    ``C`` and ``ground`` (N m s/rad), ``J`` (kg m2), ``play`` (rad, total), ``load`` (N m) and ``spring`` (N m/rad) that
    act on the shaft. The damping may pull, in contact only.
    """
    n = gear.shape[0]
    position, torque = np.empty(n), np.empty(n)
    steps = int(np.ceil(interval / LONGEST))
    shaft = K, C, J, ground, play, load, spring
    x, v, start, slope, side = 0.0, 0.0, gear[0], 0.0, 0.0
    for m in range(n):
        # the gear's motion between samples: the cubic through both, with the slopes of their neighbours' secants
        step, end = gear[m] - start, 0.5 * (gear[min(m + 1, n - 1)] - start)
        motion = (start, slope, 3.0 * step - 2.0 * slope - end, slope + end - 2.0 * step)
        total = 0.0
        for k in range(steps):
            s, length = k / steps, 1.0 / steps
            before = _distance(motion, s, x, side, play)
            ahead, faster, push = _moved(motion, s, length, interval, x, v, side, shaft)
            after = _distance(motion, s + length, ahead, side, play)
            if after < 0.0:
                # what is behind a play coasts with the speed that it has where the contact ends: there, not at a step
                share = before / (before - after) if before > 0.0 else 0.0
                x, v, push = _moved(motion, s, share * length, interval, x, v, side, shaft)
                total += share * push
                s, length = s + share * length, (1.0 - share) * length
                side = 0.0 if side != 0.0 else (1.0 if _gear(motion, s) > x else -1.0)
                ahead, faster, push = _moved(motion, s, length, interval, x, v, side, shaft)
                push *= 1.0 - share
            x, v = ahead, faster
            total += push
        start, slope = gear[m], end
        position[m], torque[m] = x, total / steps
    return position, torque


@compiled_inline
def _gear(motion, s):
    """Angle of the gear at a share of the interval."""
    start, slope, bend, turn = motion
    return start + s * (slope + s * (bend + s * turn))


@compiled_inline
def _distance(motion, s, x, side, play):
    """How far (rad) the shaft is in contact on a side, or from one where it is in none (0)."""
    gap = _gear(motion, s) - x
    return side * gap - 0.5 * play if side != 0.0 else 0.5 * play - abs(gap)


@compiled_inline
def _moved(motion, s, length, interval, x, v, side, shaft):
    """Angle and speed of the shaft after a share of the interval, and the torque on it, in contact on a side or not.

    Implicit midpoint rule: second order, and stable however fast the damping is.
    """
    _, slope, bend, turn = motion
    K, C, J, ground, play, load, spring = shaft
    h, at = length * interval, s + 0.5 * length
    rate = (slope + at * (2.0 * bend + 3.0 * at * turn)) / interval
    stiffness, damping = (K, C) if side != 0.0 else (0.0, 0.0)
    twist = _gear(motion, at) - x - 0.5 * side * play
    half = 0.5 * h / J
    force = stiffness * twist + damping * rate - load - spring * x
    middle = (v + half * force) / (1.0 + half * (0.5 * h * (stiffness + spring) + damping + ground))
    push = stiffness * (twist - 0.5 * h * middle) + damping * (rate - middle)
    return x + h * middle, 2.0 * middle - v, push


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

"""Cogging torque a sin(72 theta)."""

import numpy as np

SENTENCE = "the motor cogs"
ORDER = 72


def torque(p, rec):
    """Resisting torque (N m), its mean over the angle swept in each interval."""
    a = p("a")
    if not (a.value or a.slopes):
        return a
    return a * _of_true_angle(rec, rec.middle, np.sinc(ORDER * rec.half_sweep / np.pi), 0.0)


def between(p, rec):
    """Resisting torque (N m), its mean over the triangle of two intervals about each sample of the angle.

    With the wave's phase x at the sample, and d further at an interval's end, the mean of sin under a weight that falls
    from one at the sample to zero is sin(x) (1 - cos(d)) / d^2 + cos(x) (d - sin(d)) / d^2.
    """
    a = p("a")
    if not (a.value or a.slopes):
        return a
    before = 2.0 * ORDER * rec.half_sweep
    after = np.append(before[1:], before[-1])
    even = 0.5 * (np.sinc(before / (2.0 * np.pi)) ** 2 + np.sinc(after / (2.0 * np.pi)) ** 2)
    return a * _of_true_angle(rec, rec.angle, even, _odd(after) - _odd(before))


def _of_true_angle(rec, recorded, even, odd):
    """even sin(x) + odd cos(x) of the wave's phase x, which is that of the rotor, not of its recorded angle."""
    per = ORDER / rec.actuator.pole_pairs
    x = ORDER * recorded - per * float(rec.ahead.value)
    sin, cos = np.sin(x), np.cos(x)
    return rec.ahead.through(even * sin + odd * cos, per * (odd * sin - even * cos))


def _odd(d):
    """(d - sin(d)) / d^2."""
    small = np.abs(d) < 1e-2
    far = np.where(small, 1.0, d)
    return np.where(small, d / 6.0, (far - np.sin(far)) / far**2)

"""The unit trapezoid and its integral over the electrical angle, with their derivatives by the ramp's half-width."""

import numpy as np

from ..compiled import compiled
from .motor import TWO_PI


@compiled
def trapezoid_swept(x, ramp):
    """Integral of the trapezoid f from 0 to x (electrical rad), and its derivative by ``ramp`` = (pi - width)/2."""
    value, slope = np.empty(x.shape[0]), np.empty(x.shape[0])
    for n in range(x.shape[0]):
        u = abs(x[n] - TWO_PI * np.round(x[n] / TWO_PI))
        rest = np.pi - u
        if u < ramp:
            value[n], slope[n] = u * u / (2.0 * ramp), -(u * u) / (2.0 * ramp * ramp)
        elif rest < ramp:
            value[n] = np.pi - ramp - rest * rest / (2.0 * ramp)
            slope[n] = -1.0 + rest * rest / (2.0 * ramp * ramp)
        else:
            value[n], slope[n] = u - 0.5 * ramp, -0.5
    return value, slope


@compiled
def trapezoid_at(x, ramp):
    """The trapezoid f(x), x (sample,) electrical rad, and its derivative by ``ramp``."""
    value, slope = np.empty(x.shape[0]), np.empty(x.shape[0])
    for n in range(x.shape[0]):
        u = x[n] - TWO_PI * np.round(x[n] / TWO_PI)
        size, sign = abs(u), np.sign(u)
        edge = min(size, np.pi - size)
        if edge < ramp:
            value[n], slope[n] = sign * edge / ramp, -sign * edge / (ramp * ramp)
        else:
            value[n], slope[n] = sign, 0.0
    return value, slope

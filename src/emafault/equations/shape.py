"""The unit trapezoid and its integral over the electrical angle, with their derivatives by the ramp's half-width."""

import numpy as np

from ..actuator.motor import TWO_PI


def trapezoid_swept(x: np.ndarray, ramp: float) -> tuple[np.ndarray, np.ndarray]:
    """Integral of the trapezoid f from 0 to x (electrical rad), and its derivative by ``ramp`` = (pi - width)/2."""
    u = np.abs(x - TWO_PI * np.round(x / TWO_PI))
    rest = np.pi - u
    rising, falling = u < ramp, rest < ramp
    value = np.where(
        rising, u * u / (2.0 * ramp), np.where(falling, np.pi - ramp - rest * rest / (2.0 * ramp), u - 0.5 * ramp)
    )
    slope = np.where(rising, -(u * u) / (2.0 * ramp**2), np.where(falling, -1.0 + rest * rest / (2.0 * ramp**2), -0.5))
    return value, slope


def trapezoid_at(x: np.ndarray, ramp: float) -> tuple[np.ndarray, np.ndarray]:
    """The trapezoid f(x), x electrical rad, and its derivative by ``ramp``."""
    u = x - TWO_PI * np.round(x / TWO_PI)
    size = np.abs(u)
    edge = np.minimum(size, np.pi - size)
    on_ramp = edge < ramp
    sign = np.sign(u)
    return sign * np.where(on_ramp, edge / ramp, 1.0), sign * np.where(on_ramp, -edge / ramp**2, 0.0)

"""The direction of a current, with which an inverter's switches lose a voltage."""

import numpy as np

TURN = 0.01  # of the current limit, about which the direction of a mean over an interval turns, where nothing tells


def direction(current: np.ndarray, turn: float) -> np.ndarray:
    """From -1 to 1, of currents (A); ``turn`` (A): at which it is 0.76."""
    return np.tanh(current / turn)


def turning(current: np.ndarray, turn: float) -> np.ndarray:
    """Derivative of the direction by ``turn`` (1/A)."""
    return -current / turn**2 / np.cosh(np.clip(current / turn, -20.0, 20.0)) ** 2

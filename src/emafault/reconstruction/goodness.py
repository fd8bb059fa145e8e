"""Whether a phase's voltage fits its equation: residuals that stay on one side over a stretch of rotor angle.

A misfit follows the rotor or the current and lasts for many intervals, which the noise does not: means of whitened
residuals over each stay in a stretch tell it whatever the level of the noise, which is estimated from them, too.
"""

import numpy as np

STRETCH = np.pi / 12.0  # electrical rad, of rotor angle over which residuals are averaged


def stretches(angle: np.ndarray) -> np.ndarray:
    """Number of the stretch in which each electrical angle (rad) lies."""
    return np.floor(angle / STRETCH).astype(np.int64)


def by_stretch(stretch: np.ndarray, white: np.ndarray, unknowns: int) -> tuple[np.ndarray, int]:
    """Mean square of white residuals' standardised means over each stay in a stretch, and its degrees of freedom.

    Parameters
    ----------
    stretch : (row,) as of :func:`stretches`
    white : (row, phase) or (row,) residuals of unit variance, independent of each other
    unknowns : fitted in each phase

    Returns
    -------
    (phase,) or a number, chi-squared over its degrees of freedom where the equation holds
    """
    starts = np.flatnonzero(np.diff(stretch, prepend=stretch[0] - 1))
    lengths = np.diff(starts, append=len(stretch))
    sums = np.add.reduceat(white, starts, axis=0)
    total = np.sum(sums**2 / (lengths if white.ndim == 1 else lengths[:, None]), axis=0)
    freedom = max(len(starts) - unknowns, 1)
    return total / freedom, freedom

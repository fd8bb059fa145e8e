"""A sampled signal as it was some samples before."""

import numpy as np
from scipy.interpolate import CubicSpline


def before(x: np.ndarray, late: np.ndarray) -> np.ndarray:
    """(sample,) of x, by a cubic spline, ``late`` (sample,) samples before each, or after where that is negative; at
    the ends what there is."""
    at = np.arange(len(x))
    return CubicSpline(at, x)(np.clip(at - late, 0, len(x) - 1))

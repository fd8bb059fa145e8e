"""Fits of the two curves of probability to development cases."""

from collections.abc import Sequence

import numpy as np
from scipy.optimize import minimize

from ..gap.decide import Calibration

DETECTABLE = 25.0  # squared distance from which a gap, or a member of it, could have been seen
SURE = 0.9  # probability from which the second curve is taken at the share of its cases that were right
PRIOR_WIDTH = 3.0  # of a coefficient about that of the uncalibrated curves
#: which way gain and excess of the null count for a gap; and gain, both shares left, and margin for the first set
GAP_SENSES = (0, 1, 1)
RIGHT_SENSES = (0, 1, -1, -1, 1)


def fit_gap(rows: np.ndarray, truth: np.ndarray, start: Calibration) -> tuple[float, ...]:
    """Coefficients of the first curve from (case, feature) rows and whether each case held a gap (case,)."""
    return _logistic(rows, truth, np.array(start.gap), GAP_SENSES)


def fit_right(rows: np.ndarray, truth: np.ndarray, start: Calibration) -> tuple[tuple[float, ...], float]:
    """Coefficients of the second curve from (case, feature) rows and whether each case's best set was right (case,).

    Returns
    -------
    coefficients, and the most that a set is given: the share of right ones among the cases that the curve is sure of
    """
    right = _logistic(rows, truth, np.array(start.right), RIGHT_SENSES)
    sure = 1.0 / (1.0 + np.exp(-rows @ np.array(right))) > SURE
    most = (np.sum(truth[sure]) + 1.0) / (sure.sum() + 2.0)  # rule of succession
    return right, round(float(most), 4)


def _logistic(
    rows: np.ndarray, truth: np.ndarray, centre: np.ndarray, senses: Sequence[int], width: float = PRIOR_WIDTH
) -> tuple[float, ...]:
    """Coefficients (feature,) by maximum a posteriori about ``centre``.

    ``senses`` says which way a feature may count (+1, -1, or 0 for either): more evidence must not lower a probability
    because a few cases happened to be so.
    """
    sign = np.where(truth, 1.0, -1.0)

    def loss(w: np.ndarray) -> float:
        return float(np.logaddexp(0.0, -sign * (rows @ w)).sum() + 0.5 * np.square((w - centre) / width).sum())

    bounds = [(0.0 if sense > 0 else None, 0.0 if sense < 0 else None) for sense in senses]
    return tuple(round(float(x), 4) for x in minimize(loss, centre, method="L-BFGS-B", bounds=bounds).x)

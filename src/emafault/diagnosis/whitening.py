"""Rows of a block made white: by the noise's banded covariance, then by what a full model leaves."""

import numpy as np
from scipy.linalg import cholesky_banded, solve_banded
from scipy.signal import lfilter

LEFT_OUT = 1e8  # times a row's variance where it is not used
OUTLIER = 5.5  # standard deviations of a full model's residual
ORDER = 12  # largest order of the autoregressive model of what is left


def whiten(bands: list[np.ndarray], usable: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """(row, column) divided by the lower Cholesky factor of the covariance; rows not usable become zero."""
    n = len(bands[0])
    factor = np.zeros((len(bands), n))
    for k, band in enumerate(bands):
        factor[k, : n - k] = band
    factor[0] = np.where(usable, factor[0], factor[0] * LEFT_OUT)
    lower = cholesky_banded(factor, lower=True, check_finite=False)
    out = solve_banded((len(bands) - 1, 0), lower, rows, check_finite=False)
    out[~usable] = 0.0
    return out


def autoregression(x: np.ndarray, usable: np.ndarray) -> tuple[np.ndarray, float]:
    """Coefficients of the autoregressive model of a residual (row,) by Yule-Walker, order by BIC, and innovation variance."""
    x = np.where(usable, x, 0.0)
    n = max(1, int(usable.sum()))
    top = min(ORDER, n // 20)
    r = np.array([float(x[k:] @ x[: len(x) - k]) / n for k in range(top + 1)])
    if r[0] <= 0.0:
        return np.zeros(0), 1.0
    best, chosen, variance = n * np.log(r[0]), np.zeros(0), r[0]
    a, error = np.zeros(0), r[0]
    for order in range(1, top + 1):  # Levinson-Durbin
        k = (r[order] - a @ r[order - 1 : 0 : -1][: len(a)]) / error if order > 1 else r[1] / error
        a = np.concatenate([a - k * a[::-1], [k]])
        error *= 1.0 - k * k
        score = n * np.log(error) + order * np.log(n)
        if score < best:
            best, chosen, variance = score, a.copy(), error
    return chosen, float(variance)


def innovations(coefficients: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Rows (row, column) less what the ones before them tell."""
    if not len(coefficients):
        return rows
    return lfilter(np.concatenate([[1.0], -coefficients]), [1.0], rows, axis=0)

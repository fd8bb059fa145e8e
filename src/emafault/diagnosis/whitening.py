"""Rows of a block made white: by the noise's banded covariance, then by what a full model leaves."""

import numpy as np

from ..actuator.compiled import compiled

LEFT_OUT = 1e8  # times a row's variance where it is not used
OUTLIER = 5.5  # standard deviations of a full model's residual
ORDER = 12  # largest order of the autoregressive model of what is left
LAGS = 48  # of its spectrum's estimate
GRID = 128  # frequencies at which it is looked at


@compiled
def _factor(bands, usable):
    """Lower Cholesky factor (3, row) of a covariance with up to two off-diagonals, rows not used left out."""
    n = bands.shape[1]
    out = np.zeros((3, n))
    for k in range(n):
        d = bands[0, k] * (1.0 if usable[k] else LEFT_OUT)
        l1, l2 = 0.0, 0.0
        if k >= 2:
            l2 = bands[2, k - 2] / out[0, k - 2]
        if k >= 1:
            below = bands[1, k - 1]
            if k >= 2:
                below -= l2 * out[1, k - 1]
            l1 = below / out[0, k - 1]
        rest = d - l1 * l1 - l2 * l2
        out[0, k] = np.sqrt(max(rest, 1e-12 * d))
        out[1, k], out[2, k] = l1, l2
    return out


@compiled
def _substitute(lower, usable, rows):
    """Forward substitution, row by row in place; rows not used become zero."""
    n, m = rows.shape
    one, two = np.zeros(m), np.zeros(m)
    for k in range(n):
        a, b, c = 1.0 / lower[0, k], lower[1, k], lower[2, k]
        for q in range(m):
            x = (rows[k, q] - b * one[q] - c * two[q]) * a
            two[q] = one[q]
            one[q] = x
            rows[k, q] = x if usable[k] else 0.0


@compiled
def _filter(rows, keep, coefficients, scale):
    """The autoregressive filter; rows left out count as zero before it and after it."""
    n, m = rows.shape
    out = np.zeros((n, m))
    for k in range(n):
        if not keep[k]:
            continue
        for q in range(m):
            out[k, q] = rows[k, q]
        for p in range(min(len(coefficients), k)):
            if keep[k - 1 - p]:
                f = coefficients[p]
                for q in range(m):
                    out[k, q] -= f * rows[k - 1 - p, q]
        for q in range(m):
            out[k, q] *= scale
    return out


def whiten(bands: list[np.ndarray], usable: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """(row, column) divided in place by the Cholesky factor of the banded covariance; rows not usable become zero."""
    n = len(bands[0])
    full = np.zeros((3, n))
    for k, band in enumerate(bands):
        full[k, : n - k] = band
    _substitute(_factor(full, usable), usable, rows)
    return rows


def filtered(rows: np.ndarray, keep: np.ndarray, coefficients: np.ndarray, variance: float) -> np.ndarray:
    """(row, column) through the autoregressive model of what a full model leaves; rows not kept become zero."""
    return _filter(rows, keep, np.asarray(coefficients, float), 1.0 / np.sqrt(variance))


def _without_dips(r: np.ndarray) -> np.ndarray:
    """Autocovariances (lag,) of a spectrum that is nowhere below its median.

    A model that fits, or a difference that is none, digs a hole into the spectrum of what is left; taken for noise
    that is quieter there, it would make a bias look significant.
    """
    k = np.arange(len(r))
    w = (np.arange(GRID) + 0.5) * np.pi / GRID
    cosine = np.cos(np.outer(w, k[1:]))
    spectrum = r[0] + 2.0 * cosine @ (r[1:] * (1.0 - k[1:] / len(r)))
    spectrum = np.maximum(spectrum, np.median(spectrum))
    return np.concatenate([[spectrum.mean()], spectrum @ cosine / GRID])


def autoregression(x: np.ndarray, usable: np.ndarray) -> tuple[np.ndarray, float]:
    """Autoregressive coefficients of a residual (row,) by Yule-Walker, order by BIC, and innovation variance."""
    x = np.where(usable, x, 0.0)
    n = max(1, int(usable.sum()))
    top = min(ORDER, n // 20)
    lags = min(LAGS, n // 4)
    r = np.array([float(x[k:] @ x[: len(x) - k]) / n for k in range(lags + 1)])
    if r[0] <= 0.0:
        return np.zeros(0), 1.0
    r = _without_dips(r)
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

"""Rows of a block made white: by the noise's banded covariance, then by what a full model leaves."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from ..compiled import compiled

LEFT_OUT = 1e8  # times a row's variance where it is not used
OUTLIER = 5.5  # standard deviations of a full model's residual
ORDER = 12  # largest order of the autoregressive model of what is left
LAGS = 48  # of its spectrum's estimate
TILE = 1500  # rows that are whitened together
GRID = 128  # frequencies at which it is looked at
WANDERING = (0.0, 0.003, 0.01, 0.03, 0.1, 0.3)  # shares of an innovation that a slow level may follow by
QUIETEST = 0.05  # of the mean variance, that most rows may have
LEAST = 1e-6  # variance of what is left, over the noise as stated: what is less is rounding
LOCAL = 150  # rows whose variance is estimated together


@compiled
def _factor(bands, usable):
    """Lower Cholesky factor (band, row) of a banded covariance, rows not used left out; [m, k] is row k, column k-m."""
    width, n = bands.shape
    out = np.zeros((width, n))
    for k in range(n):
        d = bands[0, k] * (1.0 if usable[k] else LEFT_OUT)
        rest = d
        for m in range(min(width - 1, k), 0, -1):
            x = bands[m, k - m]
            for q in range(m + 1, min(width - 1, k) + 1):
                x -= out[q, k] * out[q - m, k - m]
            x /= out[0, k - m]
            out[m, k] = x
            rest -= x * x
        out[0, k] = np.sqrt(max(rest, 1e-12 * d))
    return out


@compiled
def substituted(lower, usable, rows):
    """Forward substitution, row by row in place; rows not used become zero."""
    n, m = rows.shape
    width = lower.shape[0]
    before = np.zeros((width, m))
    for k in range(n):
        own = k % width
        a = 1.0 / lower[0, k]
        for q in range(m):
            before[own, q] = rows[k, q]
        for p in range(1, min(width - 1, k) + 1):
            f, other = lower[p, k], (k - p) % width
            if f != 0.0:
                for q in range(m):
                    before[own, q] -= f * before[other, q]
        for q in range(m):
            before[own, q] *= a
            rows[k, q] = before[own, q] if usable[k] else 0.0


@compiled
def _filter(rows, keep, wander, coefficients, scale):
    """The slow level that wanders taken off, then the autoregressive filter; rows left out count as zero in the latter
    before and after, and leave the level as it is."""
    n, m = rows.shape
    out = np.zeros((n, m))
    level = np.zeros(m)
    lags = len(coefficients) + 1
    memory = np.zeros((lags, m))
    for k in range(n):
        last = k % lags
        if not keep[k]:
            for q in range(m):
                memory[last, q] = 0.0
            continue
        share = max(wander, 1.0 / (k + 1.0)) if wander > 0.0 else 0.0
        for q in range(m):
            memory[last, q] = rows[k, q] - level[q]
            level[q] += share * memory[last, q]
            out[k, q] = memory[last, q]
        for p in range(min(len(coefficients), k)):
            if keep[k - 1 - p]:
                f, other = coefficients[p], (k - 1 - p) % lags
                for q in range(m):
                    out[k, q] -= f * memory[other, q]
        for q in range(m):
            out[k, q] *= scale[k]
    return out


@compiled
def _white_tile(tile, lower, usable, start, before, memory, level, keep, wander, coefficients, scale):
    """(row, column) of a part of the rows, whitened and filtered; ``tile`` (column, row) are those from ``start`` on.

    ``before`` (band, column) and ``memory`` (lag, column) are rings of what factor and filter hold of earlier
    rows, ``level`` (column,) what has wandered, carried on.
    """
    m, n = tile.shape
    width, lags = lower.shape[0], memory.shape[0]
    out = np.zeros((n, m))
    for r in range(n):
        k = start + r
        own, last = k % width, k % lags
        a = 1.0 / lower[0, k]
        for q in range(m):
            before[own, q] = tile[q, r]
        for p in range(1, min(width - 1, k) + 1):
            f, other = lower[p, k], (k - p) % width
            if f != 0.0:
                for q in range(m):
                    before[own, q] -= f * before[other, q]
        for q in range(m):
            before[own, q] *= a
        if not keep[k]:
            for q in range(m):
                memory[last, q] = 0.0
            continue
        share = max(wander, 1.0 / (k + 1.0)) if wander > 0.0 else 0.0
        for q in range(m):
            memory[last, q] = (before[own, q] if usable[k] else 0.0) - level[q]
            level[q] += share * memory[last, q]
            out[r, q] = memory[last, q]
        for p in range(min(len(coefficients), k)):
            if keep[k - 1 - p]:
                f, other = coefficients[p], (k - 1 - p) % lags
                for q in range(m):
                    out[r, q] -= f * memory[other, q]
        for q in range(m):
            out[r, q] *= scale[k]
    return out


@dataclass
class Weights:
    """What a full model's residual says of a block's noise: rows to leave out, how it wanders and is correlated, and
    its variance (row,).

    ``wander``: share of each innovation by which the noise's slow level follows it, of a local level model (Durbin and
    Koopman 2012, Time Series Analysis by State Space Methods, section 2.2); 0: none. ``wandering``: log likelihood
    ratio of each of ``WANDERING`` against none, by BIC; empty where it was not asked.
    """

    usable: np.ndarray
    coefficients: np.ndarray
    variance: np.ndarray
    wander: float = 0.0
    wandering: tuple[float, ...] = ()


def products(lower: np.ndarray, usable: np.ndarray, columns: Sequence, weights: Weights) -> np.ndarray:
    """(column, column) products of columns, each (row,) or a scalar, divided by the factor ``lower`` of a covariance
    and filtered: part after part, so that they are never all in memory."""
    n, m = lower.shape[1], len(columns)
    before, memory = np.zeros((len(lower), m)), np.zeros((len(weights.coefficients) + 1, m))
    level, out = np.zeros(m), np.zeros((m, m))
    scale = 1.0 / np.sqrt(weights.variance)
    for start in range(0, n, TILE):
        end = min(start + TILE, n)
        tile = np.empty((m, end - start))
        for k, c in enumerate(columns):
            tile[k] = c[start:end] if np.ndim(c) else c
        rows = _white_tile(
            tile, lower, usable, start, before, memory, level, weights.usable, weights.wander, weights.coefficients,
            scale,
        )  # fmt: skip
        out += rows.T @ rows
    return out


def factored(bands: list[np.ndarray], usable: np.ndarray) -> np.ndarray:
    n = len(bands[0])
    full = np.zeros((len(bands), n))
    for k, band in enumerate(bands):
        full[k, : n - k] = band
    return _factor(full, usable)


def whiten(bands: list[np.ndarray], usable: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """(row, column) divided in place by the Cholesky factor of the banded covariance; rows not usable become zero."""
    substituted(factored(bands, usable), usable, rows)
    return rows


@compiled
def _substitute_back(lower, x):
    """Back substitution with the transposed factor, in place."""
    width, n = lower.shape
    for k in range(n - 1, -1, -1):
        for p in range(1, min(width - 1, n - 1 - k) + 1):
            x[k] -= lower[p, k + p] * x[k + p]
        x[k] /= lower[0, k]


def substituted_back(lower: np.ndarray, usable: np.ndarray, white: np.ndarray) -> np.ndarray:
    """(row,) a white residual divided once more by the Cholesky factor, transposed: inverse covariance times it."""
    out = np.array(white, float)
    _substitute_back(lower, out)
    return np.where(usable, out, 0.0)


def filtered(rows: np.ndarray, weights: Weights) -> np.ndarray:
    """(row, column) through the model of what a full model leaves; rows not kept become zero."""
    return _filter(rows, weights.usable, weights.wander, weights.coefficients, 1.0 / np.sqrt(weights.variance))


def coloured(white: np.ndarray, keep: np.ndarray, changing: bool = True, least: float = 0.0) -> Weights:
    """The model of what is left of white rows: an autoregression and its variance; where it may be ``changing``, how
    its level wanders and how its variance comes and goes as well. ``least``: of its spectrum, at every frequency."""
    n = max(1, int(keep.sum()))
    best, chosen = np.inf, Weights(keep, np.zeros(0), np.ones(len(white)))
    scores = []
    for wander in WANDERING if changing else (0.0,):
        trial = Weights(keep, np.zeros(0), np.ones(len(white)), wander)
        left = filtered(white[:, None], trial)[:, 0]
        coefficients, variance = autoregression(left, keep, least)
        trial = replace(trial, coefficients=coefficients)
        # of what it leaves of these rows, not of the spectrum without dips: else a level that is none takes up what an
        # autoregression then lacks
        power = float(np.sum(filtered(white[:, None], trial)[keep, 0] ** 2))
        score = n * np.log(max(power / n, LEAST)) + len(coefficients) * np.log(n) if power > 0.0 else np.inf
        scores.append(score)
        score += (wander > 0.0) * np.log(n)
        if score < best:
            best = score
            chosen = replace(trial, variance=np.full(len(white), max(variance, LEAST)))
    if not changing or not np.isfinite(scores).all():
        return chosen
    chosen = replace(chosen, wandering=tuple(0.5 * (scores[0] - np.array(scores))))
    new = filtered(white[:, None], chosen)[:, 0]
    local = local_variance(new, keep, LOCAL)
    variance = chosen.variance * float(np.mean(new[keep] ** 2 / local[keep])) * local
    return replace(chosen, variance=np.maximum(variance, chosen.variance if least > 0.0 else LEAST))


def local_variance(white: np.ndarray, keep: np.ndarray, width: int) -> np.ndarray:
    """(row,) variance of what a full model leaves about each row, over that of most rows, and at least one.

    What comes and goes in a recording is told from what is noise throughout: it counts where it is not.
    """
    if keep.sum() < 4 * width:
        return np.ones(len(white))
    power = uniform_filter1d(np.where(keep, white**2, 0.0), width, mode="nearest")
    share = uniform_filter1d(keep.astype(float), width, mode="nearest")
    local = power / np.maximum(share, 1.0 / width)
    # where a converter's steps are coarse most rows may leave nothing at all
    most = max(float(np.median(local[keep])), QUIETEST * float(np.mean(local[keep])))
    return np.maximum(local / max(most, 1e-300), 1.0)


def _without_dips(r: np.ndarray, least: float) -> np.ndarray:
    """Autocovariances (lag,) of a spectrum that is nowhere below its median, or what it is at ``least``.

    A model that fits, or a difference that is none, digs a hole into the spectrum of what is left; taken for noise
    that is quieter there, it would make a bias look significant.
    """
    k = np.arange(len(r))
    w = (np.arange(GRID) + 0.5) * np.pi / GRID
    cosine = np.cos(np.outer(w, k[1:]))
    spectrum = r[0] + 2.0 * cosine @ (r[1:] * (1.0 - k[1:] / len(r)))
    spectrum = np.maximum(spectrum, max(np.median(spectrum), least))
    return np.concatenate([[spectrum.mean()], spectrum @ cosine / GRID])


def autoregression(x: np.ndarray, usable: np.ndarray, least: float = 0.0) -> tuple[np.ndarray, float]:
    """Autoregressive coefficients of a residual (row,) by Yule-Walker, order by BIC, and innovation variance."""
    x = np.where(usable, x, 0.0)
    n = max(1, int(usable.sum()))
    top = min(ORDER, n // 20)
    lags = min(LAGS, n // 4)
    r = np.array([float(x[k:] @ x[: len(x) - k]) / n for k in range(lags + 1)])
    if r[0] <= 0.0:
        return np.zeros(0), 1.0
    r = _without_dips(r, least)
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

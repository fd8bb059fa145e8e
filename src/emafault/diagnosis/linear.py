"""Blocks of rows made white and compressed to normal matrices, one a recording and equation."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from .evidence import Normal
from .model import Block
from .whitening import OUTLIER, autoregression, whiten

MOST_NOISE = 0.9  # of a column's power that may be taken for noise


@dataclass
class Weights:
    """What a full model's residual says of a block's noise: rows to leave out, autoregression, variance."""

    usable: np.ndarray
    coefficients: np.ndarray
    variance: float


@dataclass
class White:
    """A whitened block: ``rows`` (row, column) with the residual last, its columns' names, and what it lies along."""

    block: Block
    names: list[str]
    rows: np.ndarray
    gram: np.ndarray  # (column, column), the residual last


def key_of(block: Block) -> tuple[str, str]:
    """What a block is called."""
    return block.recording, block.equation


def remainder_columns(block: Block, size: float) -> tuple[list[str], list[np.ndarray]]:
    """Columns of an equation's undescribed remainder, ``size`` high: functions of each coordinate, and the equation's
    own drivers with coefficients that change along them."""
    drivers, phi = block.coordinates["drivers"], block.coordinates["phi"]
    names, columns = [], []
    for f, function in enumerate(phi):
        names.append(f"remainder.{block.equation}.0.{f}")
        columns.append(size * function)
    for d, driver in enumerate(drivers[1:], start=1):
        for f in block.coordinates["slow"]:
            names.append(f"remainder.{block.equation}.{d}.{f}")
            columns.append(size * driver * phi[f])
    return names, columns


def whitened(block: Block, weights: Weights | None, wanted: Sequence[str], remainders: bool) -> White:
    """A block's columns ``wanted`` that act in it, with its remainder's, and its residual, white and compressed."""
    names = [n for n in wanted if n in block.columns]
    count = len(block.residual)
    columns = [np.broadcast_to(block.columns[n], count) for n in names]
    if remainders:
        size = float(np.sqrt(np.median(block.bands[0])))
        more, extra = remainder_columns(block, size)
        names, columns = names + more, columns + extra
    raw = np.empty((count, len(names) + 1))
    for k, c in enumerate(columns):
        raw[:, k] = c
    raw[:, -1] = block.residual
    usable = block.usable if weights is None else weights.usable
    rows = _white(block, weights, usable, raw)
    return White(block, names, rows, rows.T @ rows)


def _white(block: Block, weights: Weights | None, usable: np.ndarray, raw: np.ndarray) -> np.ndarray:
    if weights is None:
        return whiten(block.bands, usable, raw)
    return whiten(block.bands, usable, raw, weights.coefficients, weights.variance)


def correct(white: White, disturbed: Block, weights: Weights | None) -> None:
    """Take out of a normal matrix what the noise in the regressors adds to it, in place.

    To the first order a second draw of the noise changes the columns and the residual as the first did; the products
    of these changes with one another are what noise adds on average (Fuller 1987, Measurement Error Models, section
    2.2).
    """
    block = white.block
    raw = np.zeros((len(block.residual), len(white.names) + 1))
    for k, n in enumerate(white.names):
        if n in block.columns:
            raw[:, k] = disturbed.columns.get(n, 0.0) - block.columns[n]
    raw[:, -1] = disturbed.residual - block.residual
    changed = [k for k in range(raw.shape[1]) if np.any(raw[:, k])]
    usable = block.usable if weights is None else weights.usable
    rows = _white(block, weights, usable, np.ascontiguousarray(raw[:, changed]))
    noise = (rows**2).sum(axis=0)
    power = np.diag(white.gram)[changed]
    most = np.where(np.array(changed) == raw.shape[1] - 1, 1.0, np.sqrt(MOST_NOISE * power / np.maximum(noise, 1e-300)))
    rows *= np.minimum(1.0, most)
    own = white.gram[-1, -1]  # the same for all hypotheses
    white.gram[np.ix_(changed, changed)] -= rows.T @ rows
    white.gram[-1, -1] = own
    white.gram = _definite(white.gram)


def _definite(gram: np.ndarray) -> np.ndarray:
    """The nearest matrix without negative eigenvalues, on the scale of a unit diagonal."""
    power = np.diag(gram)
    scale = np.where(power > 0.0, np.sqrt(np.maximum(power, 0.0)), 1.0)
    values, vectors = np.linalg.eigh(gram / np.outer(scale, scale))
    if values[0] >= 0.0:
        return gram
    vectors *= scale[:, None]
    return (vectors * np.maximum(values, 0.0)) @ vectors.T


def assemble(whites: Sequence[White], names: Sequence[str], aliases: dict[str, str]) -> Normal:
    """Sum of the normal matrices over blocks; a column that is an alias repeats its quantity's."""
    index = {n: k for k, n in enumerate(names)}
    of: dict[str, list[int]] = {}
    for n in names:
        of.setdefault(aliases.get(n, n), []).append(index[n])
    size = len(names)
    H, g, c = np.zeros((size, size)), np.zeros(size), 0.0
    for w in whites:
        source, target = [], []
        for k, n in enumerate(w.names):
            for t in of.get(n, ()):
                source.append(k)
                target.append(t)
        rows, into = np.array(source, int), np.array(target, int)
        H[np.ix_(into, into)] += w.gram[np.ix_(rows, rows)]
        g[into] += w.gram[rows, -1]
        c += w.gram[-1, -1]
    return Normal(list(names), H, g, c)


def weights_from(white: White, deviations: dict[str, float], before: Weights | None) -> Weights:
    """Weights of a block from what a full model's deviations leave of it; common to all hypotheses compared."""
    block = white.block
    usable = block.usable if before is None else before.usable
    d = np.array([deviations.get(n, 0.0) for n in white.names])
    left = white.rows[:, :-1] @ d + white.rows[:, -1]
    if before is not None:  # as the banded covariance alone leaves it
        filtered = np.concatenate([[1.0], -before.coefficients])
        left = lfilter([1.0], filtered, left * np.sqrt(before.variance))
    if usable.sum() < 30:
        return Weights(np.zeros_like(usable), np.zeros(0), 1.0)
    scale = np.median(np.abs(left[usable])) / 0.6745
    out = usable & (np.abs(left) > OUTLIER * max(scale, 1e-12))
    spread = out | np.roll(out, 1)
    keep = usable & ~spread
    if keep.sum() < 0.5 * usable.sum():
        keep = usable
    coefficients, variance = autoregression(np.where(keep, left, 0.0), keep)
    return Weights(keep, coefficients, max(variance, 1e-6))

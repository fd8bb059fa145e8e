"""Gaussian evidence of sets of parameters in closed form, from the normal matrix with the nuisances marginalised."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.special import log_ndtr


@dataclass
class Normal:
    """log likelihood -1/2 d'Hd - g'd + const of deviations d from a point; (column,) names."""

    names: list[str]
    H: np.ndarray
    g: np.ndarray
    c: float

    def __post_init__(self) -> None:
        self.index = {n: k for k, n in enumerate(self.names)}


@dataclass
class Reduced:
    """The same of what is not a nuisance: log evidence -1/2 d'Md + b'd + constant, deviations from a point.

    ``fixed`` is the deviation (column,) that a parameter takes where it is off.
    """

    names: list[str]
    M: np.ndarray
    b: np.ndarray
    constant: float
    fixed: np.ndarray

    def __post_init__(self) -> None:
        self.index = {n: k for k, n in enumerate(self.names)}


def marginalise(normal: Normal, nuisances: list[str], mean: np.ndarray, sd: np.ndarray, fixed: np.ndarray) -> Reduced:
    """Integrate nuisances with Gaussian priors (deviation ``mean``, ``sd``) out; ``fixed`` of all columns.

    The Schur complement of the nuisances in the normal matrix (van Haasteren and Vallisneri 2014, Phys. Rev. D 90
    104012, do the same for pulsar timing).
    """
    n = np.array([normal.index[x] for x in nuisances], int)
    x = np.setdiff1d(np.arange(len(normal.names)), n)
    H, g = normal.H, normal.g
    A = H[np.ix_(n, n)] * np.outer(sd, sd) + np.eye(len(n))
    factor = cho_factor(A, lower=True, check_finite=False)
    gn = (g[n] + H[np.ix_(n, n)] @ mean) * sd
    Hnx = H[np.ix_(n, x)] * sd[:, None]
    solved = cho_solve(factor, np.column_stack([Hnx, gn]), check_finite=False)
    M = H[np.ix_(x, x)] - Hnx.T @ solved[:, :-1]
    b = -(g[x] + H[np.ix_(x, n)] @ mean - Hnx.T @ solved[:, -1])
    constant = -0.5 * normal.c - g[n] @ mean - 0.5 * mean @ H[np.ix_(n, n)] @ mean
    constant += 0.5 * gn @ solved[:, -1] - np.log(np.diag(factor[0])).sum()
    return Reduced([normal.names[k] for k in x], 0.5 * (M + M.T), b, float(constant), fixed[x])


def log_evidence(
    r: Reduced, free: np.ndarray, mean: np.ndarray, sd: np.ndarray, signs: np.ndarray | None = None
) -> tuple[float, np.ndarray, np.ndarray]:
    """Log evidence of the parameters ``free`` (indices) with prior deviation (``mean``, ``sd``), all others off.

    Returns
    -------
    log evidence, posterior mean (free,) and standard deviation (free,) of the deviations
    """
    base = r.fixed.copy()
    base[free] = mean
    on = np.flatnonzero(base)
    Mb = r.M[:, on] @ base[on] if len(on) else np.zeros(len(base))
    constant = r.constant - 0.5 * base[on] @ Mb[on] + r.b[on] @ base[on]
    if not len(free):
        return constant, np.zeros(0), np.zeros(0)
    gradient = (r.b[free] - Mb[free]) * sd
    A = r.M[np.ix_(free, free)] * np.outer(sd, sd)
    A[np.diag_indices_from(A)] += 1.0
    try:
        L = np.linalg.cholesky(A)
    except np.linalg.LinAlgError:  # what is left of columns of mere noise may have no definite sign
        return -np.inf, np.asarray(mean, float), np.asarray(sd, float)
    inverse = np.linalg.inv(L)
    z = inverse @ gradient
    value = constant + 0.5 * z @ z - np.log(np.diag(L)).sum()
    step = inverse.T @ z
    deviation = np.sqrt((inverse**2).sum(axis=0)) * sd
    found = mean + sd * step
    if signs is not None:
        one = signs != 0
        if np.any(one):
            # a prior on one side of off is twice as dense there: the posterior's mass on that side counts
            where = found[one] - r.fixed[free][one]
            value += float(np.sum(np.log(2.0) + log_ndtr(signs[one] * where / deviation[one])))
    return float(value), found, deviation

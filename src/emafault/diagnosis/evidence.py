"""Gaussian evidence of sets of parameters in closed form, from the normal matrix with the nuisances marginalised."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from ..compiled import compiled

CLEAR = 3.0  # nats of predictive density that clearly speak for or against (Kass and Raftery 1995, JASA 90, 773)
SETTLED = 0.5  # nats that one more step to an optimum may still promise
SQRT_2 = math.sqrt(2.0)
ASYMPTOTIC = -20.0  # below which the normal distribution function has its asymptotic series to rounding
MANY = 32  # rows from which on a matrix is factored along its rows
RIDGES = (0.0, 1e-12, 1e-10, 1e-8)  # of a unit diagonal, the first that makes a matrix definite


class Definite:
    """Cholesky factor of a matrix that is positive definite but for rounding, on the scale of a unit diagonal."""

    def __init__(self, A: np.ndarray):
        self.scale = 1.0 / np.sqrt(np.diag(A))
        unit = A * np.outer(self.scale, self.scale)
        for ridge in RIDGES:
            try:
                self.factor = cho_factor(unit + ridge * np.eye(len(A)), lower=True, check_finite=False)
                return
            except LinAlgError:
                continue
        raise LinAlgError("a normal matrix is far from positive definite")

    def solve(self, b: np.ndarray) -> np.ndarray:
        """A^-1 b, b (row,) or (row, column)."""
        scale = self.scale if b.ndim == 1 else self.scale[:, None]
        return scale * cho_solve(self.factor, scale * b, check_finite=False)

    def half_log_determinant(self) -> float:
        """Half the logarithm of A's determinant."""
        return float(np.sum(np.log(np.diag(self.factor[0])) - np.log(self.scale)))


@dataclass
class Normal:
    """log likelihood -1/2 d'Hd - g'd - c/2 of deviations d from a point; (column,) names.

    ``own``: the noise's part of the misfit, which c has not.
    """

    names: list[str]
    H: np.ndarray
    g: np.ndarray
    c: float
    own: float = 0.0

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
    factor = Definite(A)
    gn = (g[n] + H[np.ix_(n, n)] @ mean) * sd
    Hnx = H[np.ix_(n, x)] * sd[:, None]
    solved = factor.solve(np.column_stack([Hnx, gn]))
    M = H[np.ix_(x, x)] - Hnx.T @ solved[:, :-1]
    b = -(g[x] + H[np.ix_(x, n)] @ mean - Hnx.T @ solved[:, -1])
    constant = -0.5 * normal.c - g[n] @ mean - 0.5 * mean @ H[np.ix_(n, n)] @ mean
    constant += 0.5 * gn @ solved[:, -1] - factor.half_log_determinant()
    return Reduced([normal.names[k] for k in x], 0.5 * (M + M.T), b, float(constant), fixed[x])


def log_evidence(
    r: Reduced, free: np.ndarray, mean: np.ndarray, sd: np.ndarray, signs: np.ndarray | None = None
) -> tuple[float, np.ndarray, np.ndarray]:
    """Log evidence of the parameters ``free`` (indices) with prior deviation (``mean``, ``sd``), all others off.

    Returns
    -------
    log evidence, posterior mean (free,) and standard deviation (free,) of the deviations
    """
    mean, sd = np.asarray(mean, float), np.asarray(sd, float)
    value, found, deviation, _, _ = factored_set(r.M, r.b, r.constant, r.fixed, free, mean, sd)
    if not np.isfinite(value):  # what is left of columns of mere noise may have no definite sign
        return -np.inf, mean, sd
    if signs is not None:
        value += sided(r.fixed, free, signs, found, deviation)
    return float(value), found, deviation


@compiled
def _log_normal(x):
    """Log of the standard normal distribution function; far below, its asymptotic series (Abramowitz and Stegun 1964,
    equation 26.2.12)."""
    if x > 0.0:
        return math.log1p(-0.5 * math.erfc(x / SQRT_2))
    if x > ASYMPTOTIC:
        return math.log(0.5 * math.erfc(-x / SQRT_2))
    term, series = 1.0, 1.0
    for k in range(1, 8):
        term *= -(2 * k - 1) / (x * x)
        series += term
    return -0.5 * x * x - math.log(-x) - 0.5 * math.log(2.0 * math.pi) + math.log(series)


@compiled
def sided(fixed, free, signs, found, deviation):
    """What priors on one side of off (``fixed``), or on both (``signs`` 0), add to the log evidence of a fit: they are
    twice as dense there, and the posterior's mass on that side counts."""
    out = 0.0
    for k in range(len(free)):
        if signs[k] != 0:
            out += math.log(2.0) + _log_normal(signs[k] * (found[k] - fixed[free[k]]) / deviation[k])
    return out


@compiled
def _factored_by_rows(A):
    """The same sums in another order of loops, along the rows of memory."""
    n = A.shape[0]
    for k in range(n):
        for m in range(k):
            A[m, k] = A[k, m]
    for k in range(n):
        d = A[k, k]
        if not d > 0.0:
            return False
        d = np.sqrt(d)
        for m in range(k, n):
            A[k, m] /= d
        for m in range(k + 1, n):
            f = A[k, m]
            for q in range(m, n):
                A[m, q] -= f * A[k, q]
    for k in range(n):
        for m in range(k):
            A[k, m] = A[m, k]
    return True


@compiled
def factored(A):
    """Lower Cholesky factor, in place; whether there is one."""
    n = A.shape[0]
    if n > MANY:
        return _factored_by_rows(A)
    for k in range(n):
        d = A[k, k]
        for q in range(k):
            d -= A[k, q] * A[k, q]
        if not d > 0.0:
            return False
        d = np.sqrt(d)
        A[k, k] = d
        for m in range(k + 1, n):
            x = A[m, k]
            for q in range(k):
                x -= A[m, q] * A[k, q]
            A[m, k] = x / d
    return True


@compiled
def factored_set(M, b, constant, fixed, free, mean, sd):
    """Log evidence, posterior mean and standard deviation, as ``log_evidence`` without sides; the Cholesky factor L of
    the posterior's precision in units of the priors, with its transpose above the diagonal, and L^-1 of the gradient at
    the priors' means."""
    n = len(free)
    base = fixed.copy()
    for k in range(n):
        base[free[k]] = mean[k]
    on = np.flatnonzero(base)
    for p in on:
        x = 0.0
        for o in on:
            x += M[p, o] * base[o]
        constant += (b[p] - 0.5 * x) * base[p]
    A, z = np.empty((n, n)), np.empty(n)
    for k in range(n):
        row = free[k]
        x = b[row]
        for o in on:
            x -= M[row, o] * base[o]
        z[k] = x * sd[k]
        for m in range(k + 1):
            A[k, m] = M[row, free[m]] * sd[k] * sd[m]
        A[k, k] += 1.0
    if not factored(A):
        return -np.inf, mean.copy(), sd.copy(), A, z
    for k in range(n):
        for m in range(k):
            A[m, k] = A[k, m]
    gain, step, spread, _ = optimum(A, z)
    return constant + gain, mean + sd * step, sd * spread, A, z


@compiled
def optimum(L, z):
    """What a Gaussian integral gains from the priors' means to its optimum, with the determinant; the optimum and the
    standard deviations there in units of the priors, and L^-1.

    L : lower Cholesky factor of the precision in these units; ``z`` the gradient, which becomes L^-1 of it
    """
    n = len(z)
    gain = 0.0
    for k in range(n):
        x = z[k]
        for q in range(k):
            x -= L[k, q] * z[q]
        z[k] = x / L[k, k]
        gain += 0.5 * z[k] * z[k] - np.log(L[k, k])
    inverse = np.zeros((n, n))
    for k in range(n):
        for q in range(k):
            f = L[k, q]
            for m in range(q + 1):
                inverse[k, m] -= f * inverse[q, m]
        for m in range(k):
            inverse[k, m] /= L[k, k]
        inverse[k, k] = 1.0 / L[k, k]
    step, spread = np.empty(n), np.empty(n)
    for m in range(n):
        best, power = 0.0, 0.0
        for k in range(m, n):
            best += inverse[k, m] * z[k]
            power += inverse[k, m] * inverse[k, m]
        step[m], spread[m] = best, np.sqrt(power)
    return gain, step, spread, inverse

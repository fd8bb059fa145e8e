"""Generalised least squares of one phase's voltage equation, unbiased by noise in its regressors.

The measured end currents enter two neighbouring rows with opposite sign, so the noise covariance Omega of a stretch of
rows is tridiagonal. Its factors L D L^T take one pass forwards and one backwards. The regressors i, di/dt and w are
measured too: noise in them inflates X^T Omega^-1 X by an amount that is known and taken off (corrected score; Fuller,
Measurement Error Models, 1987, section 2.2), without which R would come out low by 1e-4.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..compiled import compiled
from .noise import NoiseLevels
from .rows import Rows

CURRENT, EMF, DIDT, INTERCEPT = 0, 1, 2, 3  # columns of every design; further ones are harmonics of k


@dataclass(frozen=True)
class PhaseFit:
    """Estimate of one phase."""

    beta: np.ndarray  # (unknown,) R, k, L, intercept, ...
    covariance: np.ndarray  # (unknown, unknown)
    chi2: float  # residual variance over the one expected
    white: np.ndarray  # (row,) residuals, independent of each other, of unit variance where the equation holds
    speed_influence: np.ndarray  # (row, unknown) change of beta per unit of standardised speed noise of each row


@compiled
def whiten(table, variance, linked, coupling):
    """Rows L^-1 table of Omega = L D L^T, the diagonal D and the subdiagonal of L; ``table`` (row, column)."""
    rows, columns = table.shape
    out = np.empty((rows, columns))
    d, l = np.empty(rows), np.zeros(rows)
    for n in range(rows):
        d[n] = variance[n]
        if linked[n]:
            l[n] = coupling / d[n - 1]
            d[n] -= l[n] * coupling
            for c in range(columns):
                before = out[n - 1, c]
                # what has died away is cut off, as denormal numbers slow everything after them down
                out[n, c] = table[n, c] - (l[n] * before if abs(before) > 1e-100 else 0.0)
        else:
            for c in range(columns):
                out[n, c] = table[n, c]
    return out, d, l


@compiled
def misfit(residual, variance, linked, coupling):
    """Minus twice the log likelihood of a residual (row,) under Omega, a constant apart."""
    total, product, white, d = 0.0, 1.0, 0.0, 1.0
    for n in range(len(residual)):
        l = coupling / d if linked[n] else 0.0
        d = variance[n] - l * coupling
        white = residual[n] - l * white
        total += white * white / d
        product *= d
        if product < 1e-200 or product > 1e200:
            total += np.log(product)
            product = 1.0
    return total + np.log(product)


@compiled
def unwhiten(whitened, d, l):
    """Omega^-1 table from ``whiten``'s result, and the diagonal and subdiagonal of Omega^-1."""
    rows, columns = whitened.shape
    out = np.empty((rows, columns))
    diagonal, below = np.empty(rows), np.zeros(rows)
    for n in range(rows - 1, -1, -1):
        diagonal[n] = 1.0 / d[n]
        for c in range(columns):
            out[n, c] = whitened[n, c] / d[n]
        if n + 1 < rows and l[n + 1] != 0.0:
            diagonal[n] += l[n + 1] * l[n + 1] * diagonal[n + 1]
            below[n + 1] = -l[n + 1] * diagonal[n + 1]
            for c in range(columns):
                out[n, c] -= l[n + 1] * out[n + 1, c]
    return out, diagonal, below


def row_variance(rows: Rows, emf: np.ndarray, beta: np.ndarray, noise: NoiseLevels, interval: float):
    """(row,) noise variance (V2) and the covariance of linked rows, at given parameters.

    ``emf`` (row,) is the change of the voltage with speed, V s/rad.
    """
    end = (beta[DIDT] / interval * noise.current_end) ** 2
    conducting = (beta[CURRENT] * noise.current) ** 2 + 2.0 * end
    variance = noise.voltage**2 + (emf * noise.speed) ** 2 + np.where(rows.floating, 0.0, conducting)
    return variance, -end


def design(rows: Rows, shapes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Regressors (row, unknown) and their derivative by speed; ``shapes`` (row, 1 + harmonics), the first of them f."""
    X = np.zeros((len(rows.V), 3 + shapes.shape[1]))
    D = np.zeros_like(X)
    X[:, CURRENT], X[:, DIDT], X[:, INTERCEPT] = rows.i, rows.didt, ~rows.floating
    D[:, EMF], D[:, 4:] = shapes[:, 0], shapes[:, 1:]
    X[:, EMF], X[:, 4:] = rows.w * shapes[:, 0], rows.w[:, None] * shapes[:, 1:]
    return X, D


def is_singular(normal: np.ndarray) -> bool:
    """Whether a normal matrix leaves an unknown undetermined, judged free of units."""
    scale = np.sqrt(np.diagonal(normal))
    if not np.all(scale > 0.0):
        return True
    return bool(np.linalg.eigvalsh(normal / np.outer(scale, scale))[0] < 1e-13)


class PhaseProblem:
    """The least-squares problem of one phase, solved in two passes.

    Parameters
    ----------
    shapes : (row, 1 + harmonics) mean of f, and of f times each harmonic, over the interval's angle
    start : (4 + harmonics,) nominal parameters, at which the first weights are taken
    prior_L : standard deviation of L about ``start`` (H), for records without end currents
    """

    def __init__(self, rows: Rows, shapes: np.ndarray, start: np.ndarray, interval: float, prior_L: float = np.inf):
        self.rows, self.start, self.interval = rows, start, interval
        self.X, self.D = design(rows, shapes)
        self.end_measured = bool(np.isinf(prior_L))
        self.prior = np.zeros(len(start))
        self.prior[DIDT] = 0.0 if self.end_measured else prior_L**-2

    def _weigh(self, beta: np.ndarray, noise: NoiseLevels):
        """Normal matrix, score, chi2, and design with residuals of unit variance; the whitened design, its factors."""
        variance, coupling = row_variance(self.rows, self.D @ beta, beta, noise, self.interval)
        residual = self.rows.V - self.X @ beta
        whitened, d, l = whiten(np.column_stack([self.X, residual]), variance, self.rows.linked, coupling)
        scaled = whitened / np.sqrt(d)[:, None]
        gram = scaled.T @ scaled
        normal, score = gram[:-1, :-1] + np.diag(self.prior), gram[:-1, -1] - self.prior * (beta - self.start)
        chi2 = float(gram[-1, -1]) / (len(residual) - len(beta))
        return normal, score, chi2, scaled, np.ascontiguousarray(whitened[:, :-1]), d, l

    def first_pass(self, noise: NoiseLevels) -> np.ndarray | None:
        """(unknown,) plain estimate with weights at the start; None where the rows leave an unknown undetermined."""
        if len(self.rows.V) <= len(self.start):
            return None
        normal, score, *_ = self._weigh(self.start, noise)
        return None if is_singular(normal) else self.start + np.linalg.solve(normal, score)

    def excess_variance(self, beta: np.ndarray, noise: NoiseLevels) -> float:
        """Mean square of the residuals at ``beta`` less what the noise levels explain, the voltage's apart (V2)."""
        expected, _ = row_variance(self.rows, self.D @ beta, beta, noise, self.interval)
        return float(np.mean((self.rows.V - self.X @ beta) ** 2 - expected)) + noise.voltage**2

    def left(self, beta: np.ndarray) -> float:
        """Root mean square of the residuals at ``beta`` (V)."""
        return float(np.sqrt(np.mean((self.rows.V - self.X @ beta) ** 2)))

    def misfit_of_voltage(self, beta: np.ndarray, noise: NoiseLevels) -> Callable[[float], float]:
        """Minus twice the log likelihood of the residuals at ``beta``, by the noise of the voltages (V)."""
        known, coupling = row_variance(self.rows, self.D @ beta, beta, replace(noise, voltage=0.0), self.interval)
        residual = self.rows.V - self.X @ beta
        return lambda voltage: misfit(residual, known + voltage**2, self.rows.linked, coupling)

    def second_pass(self, beta: np.ndarray, noise: NoiseLevels) -> PhaseFit | None:
        """Estimate with weights at ``beta``, corrected for noisy regressors; None where an unknown is undetermined."""
        normal, score, chi2, scaled, whitened, d, l = self._weigh(beta, noise)
        inverse_X, diagonal, below = unwhiten(whitened, d, l)
        # records quieter than stated, noise-free ones above all, are corrected for the noise that they do have
        correction = min(1.0, chi2) * regressor_noise(
            self.rows, self.D, diagonal, below, noise, self.interval, self.end_measured
        )
        normal, score = normal - correction, score + correction @ beta
        if is_singular(normal):
            return None
        covariance = np.linalg.inv(normal)
        influence = inverse_X @ covariance * (self.D @ beta * noise.speed)[:, None]
        step = covariance @ score
        return PhaseFit(beta + step, covariance, chi2, scaled[:, -1] - scaled[:, :-1] @ step, influence)


def regressor_noise(rows, D, diagonal, below, noise: NoiseLevels, interval: float, end_measured: bool) -> np.ndarray:
    """(unknown, unknown) what measurement noise adds to X^T Omega^-1 X on average."""
    out = noise.speed**2 * (D * diagonal[:, None]).T @ D
    conducting = np.sum(diagonal[~rows.floating])
    out[CURRENT, CURRENT] += noise.current**2 * conducting
    if end_measured:
        out[DIDT, DIDT] += 2.0 * (noise.current_end / interval) ** 2 * (conducting - np.sum(below[rows.linked]))
    return out


def join_phases(fits: list[PhaseFit], rows: list[Rows], unknowns: tuple[int, ...]) -> np.ndarray:
    """Covariance of the named unknowns of the three phases, unknown by unknown, with the speed noise that they share.

    Returns
    -------
    (3 u, 3 u) for u unknowns, ordered [first unknown of a, b, c; second of a, b, c; ...]
    """
    u = list(unknowns)
    samples = max(int(r.index[-1]) for r in rows) + 1
    spread = []
    for fit, r in zip(fits, rows):
        full = np.zeros((samples, len(u)))
        full[r.index] = fit.speed_influence[:, u]
        spread.append(full)
    out = np.empty((len(u), 3, len(u), 3))
    for a in range(3):
        for b in range(a, 3):
            block = fits[a].covariance[np.ix_(u, u)] if a == b else spread[a].T @ spread[b]
            out[:, a, :, b], out[:, b, :, a] = block, block.T
    return out.reshape(3 * len(u), 3 * len(u))

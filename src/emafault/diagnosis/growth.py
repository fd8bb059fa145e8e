"""Evidence of a set with one member more, from the factor of the set: the Schur complement of what is added."""

from copy import copy

import numpy as np

from ..compiled import compiled
from .evidence import Reduced, factored, factored_set, optimum, sided


class Factored:
    """A set of free parameters with their priors, factored once for all that may be added to it.

    Parameters
    ----------
    r : the linear model
    free : (column,) indices of the set's parameters
    mean, sd, signs : (column,) of their priors, as ``log_evidence`` takes them
    """

    def __init__(self, r: Reduced, free: np.ndarray, mean: np.ndarray, sd: np.ndarray, signs: np.ndarray):
        self.r, self.free, self.mean, self.sd, self.signs = r, free, mean, sd, signs
        self.value, self.found, self.deviation, self.L, self.z = factored_set(
            r.M, r.b, r.constant, r.fixed, free, mean, sd
        )
        at = r.fixed.copy()
        at[free] = mean
        self.gradient = _less(r.b, r.M, np.arange(len(at)), at)
        self.step, self.power = (self.found - mean) / sd, (self.deviation / sd) ** 2

    def log_evidence(self) -> tuple[float, np.ndarray, np.ndarray, np.ndarray]:
        """Value, indices, means and standard deviations of the set."""
        if not np.isfinite(self.value):
            return -np.inf, self.free, self.mean, self.sd
        value = self.value + sided(self.r.fixed, self.free, self.signs, self.found, self.deviation)
        return value, self.free, self.found, self.deviation

    def with_more(self, more: np.ndarray, mean: np.ndarray, sd: np.ndarray, signs: np.ndarray) -> "Factored":
        """The set with further parameters, from the factor that there is: of the rest nothing is worked out again."""
        out, one = copy(self), OneMore(self, more)
        out.free, out.mean = np.concatenate([self.free, more]), np.concatenate([self.mean, mean])
        out.sd, out.signs = np.concatenate([self.sd, sd]), np.concatenate([self.signs, signs])
        away = mean - self.r.fixed[more]
        gain, found, deviation, lower, z = _grown(
            one.forward, one.back, one.left, self.z, self.step, self.power, one.gradient, away, sd
        )  # fmt: skip
        out.value = self.value + gain
        out.found, out.deviation = out.mean + out.sd * found, out.sd * deviation
        out.step, out.power = found, deviation**2
        out.gradient = _less(self.gradient, self.r.M, more, away)
        out.z = np.concatenate([self.z - one.forward.T @ away, z])
        n, beside = len(self.free), sd[:, None] * one.forward
        out.L = np.empty((n + len(more),) * 2)
        out.L[:n, :n], out.L[n:, :n], out.L[:n, n:] = self.L, beside, beside.T
        out.L[n:, n:] = np.tril(lower) + np.tril(lower, -1).T
        return out

    def and_one_more(self, more: np.ndarray) -> "OneMore":
        """The same with some further parameters free (indices), before it is said how wide their priors are."""
        return OneMore(self, more)


class OneMore:
    """A factored set with further free parameters, whose priors are tried one after another."""

    def __init__(self, of: Factored, more: np.ndarray):
        self.of, self.more = of, more
        self.forward, self.back = _complement(of.r.M, of.L, of.free, of.sd, more)
        self.left = of.r.M[np.ix_(more, more)] - self.forward @ self.forward.T
        self.gradient = of.gradient[more]

    def log_evidence(
        self, mean: np.ndarray, sd: np.ndarray, signs: np.ndarray
    ) -> tuple[float, np.ndarray, np.ndarray, np.ndarray]:
        """As ``log_evidence`` of the set's parameters and then of these: value, indices, means, standard deviations."""
        s = self.of
        return _with_more(
            s.value, self.forward, self.back, self.left, s.z, s.step, s.power, self.gradient, s.r.fixed, s.free, s.mean,
            s.sd, s.signs, self.more, mean, sd, signs,
        )  # fmt: skip


def _less(b: np.ndarray, M: np.ndarray, index: np.ndarray, d: np.ndarray) -> np.ndarray:
    """(column,) the gradient where some columns have moved by d."""
    on = np.flatnonzero(d)
    return b - d[on] @ M[index[on]] if len(on) else b


@compiled
def _with_more(
    value, forward, back, left, z, step, power, gradient, fixed, free, mean, sd, signs, more, mean_of, sd_of, signs_of
):  # fmt: skip
    """Log evidence, indices, means and standard deviations of a set with further parameters."""
    both = np.concatenate((free, more))
    means, sds = np.concatenate((mean, mean_of)), np.concatenate((sd, sd_of))
    if not np.isfinite(value):
        return -np.inf, both, means, sds
    gain, found, deviation, _, _ = _grown(
        forward, back, left, z, step, power, gradient, mean_of - fixed[more], sd_of
    )  # fmt: skip
    if not np.isfinite(gain):
        return -np.inf, both, means, sds
    for k in range(len(both)):
        found[k] = means[k] + sds[k] * found[k]
        deviation[k] *= sds[k]
    sides = sided(fixed, both, np.concatenate((signs, signs_of)), found, deviation)
    return value + gain + sides, both, found, deviation


@compiled
def _complement(M, L, free, sd, more):
    """(further, column) L^-1 of the products of a set's columns (scaled) with further ones, and L^-T of these.

    L has its transpose above the diagonal.
    """
    n, e = len(free), len(more)
    forward = np.empty((e, n))
    for m in range(e):
        row, x = M[more[m]], forward[m]
        for k in range(n):
            x[k] = row[free[k]] * sd[k]
        for k in range(n):
            x[k] /= L[k, k]
            f = x[k]
            for q in range(k + 1, n):
                x[q] -= f * L[k, q]
    back = forward.copy()
    for m in range(e):
        x = back[m]
        for k in range(n - 1, -1, -1):
            x[k] /= L[k, k]
            f = x[k]
            for q in range(k):
                x[q] -= f * L[k, q]
    return forward, back


@compiled
def _grown(forward, back, left, z, step, power, gradient, away, sd):
    """What further parameters add to a set's log evidence; means and standard deviations of all, in units of their
    priors; the lower factor of what is added, and its inverse times the gradient at the priors' means.

    ``away``: the further priors' means from where these parameters are off.
    """
    e, n = forward.shape
    gain = 0.0
    here = np.empty(e)  # the gradient at the further priors' means, the set at its best
    for k in range(e):
        moved, met = 0.0, 0.0
        for m in range(e):
            moved += left[k, m] * away[m]
        for q in range(n):
            met += forward[k, q] * z[q]
        here[k] = (gradient[k] - met - moved) * sd[k]
        gain += (gradient[k] - met - 0.5 * moved) * away[k]
    S = np.empty((e, e))
    for k in range(e):
        for m in range(e):
            S[k, m] = left[k, m] * sd[k] * sd[m]
        S[k, k] += 1.0
    found, deviation = np.empty(n + e), np.empty(n + e)
    if not factored(S):
        return -np.inf, found, deviation, S, here
    more, found[n:], deviation[n:], inverse = optimum(S, here)
    gain += more
    rows = np.empty(e)
    for k in range(n):
        x = step[k]
        for m in range(e):
            rows[m] = back[m, k] * sd[m]
            x -= rows[m] * found[n + m] + back[m, k] * away[m]
        wider = power[k]
        for m in range(e):
            f = 0.0
            for q in range(m + 1):
                f += inverse[m, q] * rows[q]
            wider += f * f
        found[k] = x
        deviation[k] = np.sqrt(wider)
    return gain, found, deviation, S, here

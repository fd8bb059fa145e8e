"""The evidence equals the Gaussian integral done by brute force."""

import numpy as np
import pytest
from scipy.integrate import dblquad
from scipy.special import log_ndtr

from emafault.diagnosis.evidence import ASYMPTOTIC, Normal, log_evidence, marginalise, sided
from emafault.diagnosis.whitening import coloured, filtered, whiten


@pytest.fixture
def case():
    rng = np.random.default_rng(3)
    X = rng.standard_normal((30, 3))
    r = 0.3 * X[:, 0] - 0.5 * X[:, 1] + 0.2 * X[:, 2] + 0.5 * rng.standard_normal(30)
    return Normal(["n", "a", "b"], X.T @ X, X.T @ r, float(r @ r)), X, r


def brute(X, r, nuisance, effect):
    """Integral of the likelihood times Gaussian priors over a nuisance and one effect's amplitude."""
    (mn, sn), (ma, sa) = nuisance, effect

    def density(a, n):
        left = r + X[:, 0] * n + X[:, 1] * a
        prior = np.exp(-0.5 * ((n - mn) / sn) ** 2 - 0.5 * ((a - ma) / sa) ** 2) / (2 * np.pi * sn * sa)
        return np.exp(-0.5 * left @ left) * prior

    value, _ = dblquad(density, mn - 8 * sn, mn + 8 * sn, ma - 8 * sa, ma + 8 * sa)
    return np.log(value)


def test_equals_the_integral(case):
    normal, X, r = case
    reduced = marginalise(normal, ["n"], np.array([0.1]), np.array([0.4]), np.zeros(3))
    value, mean, _ = log_evidence(reduced, np.array([reduced.index["a"]]), np.array([0.05]), np.array([0.6]))
    assert value == pytest.approx(brute(X, r, (0.1, 0.4), (0.05, 0.6)), abs=1e-6)
    assert mean.shape == (1,)


def test_what_is_off_counts_where_it_is_off(case):
    normal, X, r = case
    fixed = np.array([0.0, 0.0, -0.7])  # the third parameter's off lies elsewhere than the point
    reduced = marginalise(normal, ["n"], np.array([0.0]), np.array([0.4]), fixed)
    value, *_ = log_evidence(reduced, np.array([reduced.index["a"]]), np.array([0.0]), np.array([0.6]))
    assert value == pytest.approx(brute(X, r - 0.7 * X[:, 2], (0.0, 0.4), (0.0, 0.6)), abs=1e-6)


def test_a_side_of_off_doubles_or_removes(case):
    normal, *_ = case
    reduced = marginalise(normal, ["n"], np.zeros(1), np.array([0.4]), np.zeros(3))
    k = np.array([reduced.index["a"]])
    both, mean, _ = log_evidence(reduced, k, np.zeros(1), np.array([0.6]))
    right, *_ = log_evidence(reduced, k, np.zeros(1), np.array([0.6]), np.sign(mean).astype(int))
    wrong, *_ = log_evidence(reduced, k, np.zeros(1), np.array([0.6]), -np.sign(mean).astype(int))
    assert np.logaddexp(right, wrong) == pytest.approx(both + np.log(2.0), abs=1e-9)
    assert right > both > wrong


def test_whitening_by_the_banded_factor():
    rng = np.random.default_rng(1)
    n = 12
    bands = [np.full(n, 6.5), np.full(n - 1, -4.0), np.full(n - 2, 1.0)]
    C = np.diag(bands[0]) + sum(np.diag(b, k) + np.diag(b, -k) for k, b in enumerate(bands) if k)
    x = rng.standard_normal((n, 2))
    expected = np.linalg.solve(np.linalg.cholesky(C), x)
    assert np.allclose(whiten(bands, np.ones(n, bool), x.copy()), expected)


def _low_power(x):
    """Variance of means over 50 rows, over that of white noise of unit variance."""
    return 50.0 * float(np.var(x[: len(x) // 50 * 50].reshape(-1, 50).mean(axis=1)))


def test_autoregression_makes_low_frequencies_white():
    rng = np.random.default_rng(2)
    e = rng.standard_normal(20000)
    x = np.zeros_like(e)
    for k in range(1, len(e)):
        x[k] = 0.9 * x[k - 1] + e[k]
    keep = np.ones(len(x), bool)
    white = filtered(whiten([np.ones(len(x))], keep, x[:, None].copy()), coloured(x, keep))[:, 0]
    assert _low_power(x) > 20.0
    assert 0.5 < _low_power(white) < 2.0


def test_a_hole_in_the_spectrum_is_not_believed():
    rng = np.random.default_rng(3)
    x = np.diff(rng.standard_normal(20001))
    keep = np.ones(len(x), bool)
    bias = filtered(np.ones((len(x), 1)), coloured(x, keep))[100:, 0]
    assert np.sqrt(np.mean(bias**2)) < 1.2  # a constant offset counts no more than with white noise of unit variance


@pytest.mark.parametrize("at", [-500.0, -60.0, ASYMPTOTIC - 1e-6, ASYMPTOTIC + 1e-6, -3.0, -1e-9, 0.0, 2.0, 9.0])
def test_a_prior_on_one_side_counts_the_posterior_s_mass_there(at):
    """Beside a parameter that may have either sign."""
    free, signs = np.array([0, 1]), np.array([-1, 0])
    found, deviation = np.array([0.3 - 0.5 * at, 1.0]), np.array([0.5, 1.0])
    expected = np.log(2.0) + log_ndtr(at)
    assert sided(np.array([0.3, 0.0]), free, signs, found, deviation) == pytest.approx(expected, rel=1e-12, abs=1e-14)

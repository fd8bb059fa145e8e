"""The evidence equals the Gaussian integral done by brute force."""

import numpy as np
import pytest
from scipy.integrate import dblquad

from emafault.diagnosis.evidence import Normal, log_evidence, marginalise
from emafault.diagnosis.whitening import autoregression, filtered, whiten


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


def test_autoregression_finds_what_made_a_series():
    rng = np.random.default_rng(2)
    e = rng.standard_normal(20000)
    x = np.zeros_like(e)
    for k in range(2, len(e)):
        x[k] = 0.6 * x[k - 1] - 0.3 * x[k - 2] + e[k]
    coefficients, variance = autoregression(x, np.ones(len(x), bool))
    assert np.allclose(coefficients[:2], [0.6, -0.3], atol=0.03)
    assert variance == pytest.approx(1.0, abs=0.04)
    bands = [np.ones(len(x))]
    keep = np.ones(len(x), bool)
    white = filtered(whiten(bands, keep, x[:, None].copy()), keep, coefficients, variance)[:, 0]
    assert abs(np.corrcoef(white[1:], white[:-1])[0, 1]) < 0.02

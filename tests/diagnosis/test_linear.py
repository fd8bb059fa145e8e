"""Noise in the regressors: an estimate without bias that says no more than the data do."""

import numpy as np
import pytest
from scipy.stats import norm

from emafault.diagnosis.linear import OwnForm, White, assemble, compressed_columns, correct, function_of, own_columns
from emafault.diagnosis.model import Block
from emafault.diagnosis.whitening import Weights, products

ROWS, DRAWS, NOISE = 400, 300, 1.5


def corrected(rng, truth):
    """Normal equations of y = -truth x + e, where x is known with noise of its own, which is taken out on average."""
    x = rng.standard_normal(ROWS)
    known = x + NOISE * rng.standard_normal(ROWS)
    left = truth * x + rng.standard_normal(ROWS)
    both = np.column_stack([known, left])
    gram = both.T @ both
    taken = np.array([[ROWS * NOISE**2]])
    gram[0, 0] -= taken[0, 0]
    return assemble([White("one", "torque", ["a"], gram, ROWS, noise=taken)], ["a"], {})


def test_what_noisy_regressors_say_of_nothing_is_chi_square():
    rng = np.random.default_rng(3)
    gains = [float(n.g[0] ** 2 / n.H[0, 0]) for n in (corrected(rng, 0.0) for _ in range(DRAWS))]
    assert np.mean(gains) == pytest.approx(1.0, abs=0.25)  # without the sandwich: 1 + NOISE^2


def test_the_estimate_has_no_bias():
    rng = np.random.default_rng(4)
    found = [-float(n.g[0] / n.H[0, 0]) for n in (corrected(rng, -0.5) for _ in range(DRAWS))]
    assert np.mean(found) == pytest.approx(0.5, abs=0.03)


def test_a_wider_noise_is_no_better_fit():
    """The misfit is -2 log likelihood: rows whose noise a cause widens have a smaller square, and a smaller density."""
    x = np.random.default_rng(5).standard_normal(ROWS)
    usable = np.arange(ROWS) % 5 > 0
    found = {}
    for sd in (1.0, 2.0):
        block = Block("one", "bus", x, {}, [np.full(ROWS, sd**2)], usable)
        found[sd] = compressed_columns(block, [], [x], None).misfit
    exact = {sd: -2.0 * norm.logpdf(x[usable], scale=sd).sum() for sd in found}
    assert found[2.0] - found[1.0] == pytest.approx(exact[2.0] - exact[1.0])
    assert found[1.0] < found[2.0]


def test_a_form_is_seen_where_noise_averages_out():
    """The noise of a differenced signal is anti-correlated: a slow effect that no row shows is clear in all of them."""
    slow = np.full(ROWS, 0.1)
    along = {"own": [np.ones(ROWS), np.linspace(-1.0, 1.0, ROWS)]}
    usable = np.ones(ROWS, bool)
    seen = {}
    for name, bands in {"white": [np.ones(ROWS)], "differenced": [np.ones(ROWS), np.full(ROWS - 1, -0.499)]}.items():
        block = Block("one", "torque", np.zeros(ROWS), {"load.T": slow}, bands, usable, along)
        seen[name] = own_columns(block, "load", OwnForm({"load.T": 0.9}))[0]
    assert seen["white"] == []
    assert seen["differenced"] == ["own.load.torque.0", "own.load.torque.1"]


def test_what_a_form_has_by_parameters_of_its_own_needs_none_of_the_library_s():
    columns = {"load.T": np.ones(ROWS), "load.wave": np.arange(ROWS)}
    block = Block("one", "torque", np.zeros(ROWS), columns, [np.ones(ROWS)], np.ones(ROWS, bool), {"own": [1.0]})
    for amount, there in ((0.0, ["own.load.load.wave"]), (0.5, ["own.load.load.wave", "own.load.torque.0"])):
        names, found = own_columns(block, "load", OwnForm({"load.T": amount}, {"load.wave": 0.2}))
        assert names == there and [function_of(n) for n in names] == [None, 0][: len(there)]
        np.testing.assert_allclose(found[0], 0.2 * np.arange(ROWS))


def test_a_column_whose_products_underflow_says_nothing():
    """Edges that a displacement takes far from where commutations may be have columns of some 1e-160."""
    rng = np.random.default_rng(6)
    columns = [rng.standard_normal(200), 1e-160 * rng.standard_normal(200), rng.standard_normal(200)]
    weights = Weights(np.ones(200, bool), np.zeros(0), np.ones(200))
    gram = products(np.ones((1, 200)), weights.usable, columns, weights)
    assert 0.0 < gram[1, 1] < 1e-300 < 100.0 < gram[0, 0]
    white = White("r", "torque", ["a", "b"], gram, 200)
    correct(white, 0.1 * gram)
    normal = assemble([white], ["a", "b"], {})
    assert np.isfinite(normal.H).all() and np.isfinite(normal.g).all() and normal.H[1, 1] < 1e-300


def test_the_misfit_is_the_same_whatever_columns_stand_beside_it():
    """Two columns whose noise is taken for more than they have together: what makes their products a covariance again
    had moved the misfit too, and a set linearised with many columns was compared with one of few."""
    rng = np.random.default_rng(7)
    noise = np.outer([1.0, -1.0, 0.0], [1.0, -1.0, 0.0]) * 0.8 * ROWS
    x = rng.standard_normal((ROWS, 3))
    x[:, 1] = x[:, 0] + 0.1 * x[:, 1]
    white = White("one", "torque", ["a", "b"], x.T @ x, ROWS)
    white.gram[:2, 2] += 40.0
    white.gram[2, :2] += 40.0
    misfit = white.misfit
    correct(white, noise)
    assert np.linalg.eigvalsh(white.gram[:2, :2]).min() > -1e-6 * ROWS
    assert white.misfit == misfit

"""Levenberg-Marquardt against independent computations: central differences, a formed Jacobian and SciPy's minimum."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from emafault.identification import levenberg_marquardt as lm


def problem(seed=0, rows=60):
    rng = np.random.default_rng(seed)
    x = rng.normal(size=(rows, 2))
    t = np.column_stack([np.tanh(x @ [1.0, -0.5]), 0.3 * x[:, 0] + np.tanh(x[:, 1])])
    return x, t + 0.05 * rng.normal(size=t.shape), rng


def flat(weights):
    return np.concatenate([W.ravel() for W in weights])


def unflat(w, like):
    ends = np.cumsum([W.size for W in like])[:-1]
    return [part.reshape(W.shape) for part, W in zip(np.split(w, ends), like)]


@pytest.mark.parametrize("activation", ["tanh", "sigmoid", "relu"])
@pytest.mark.parametrize("hidden", [(4,), (4, 3)])
def test_jacobian_is_that_of_central_differences(activation, hidden):
    x, _, rng = problem()
    weights = lm.initialise((2, *hidden, 2), rng)
    weights = [W + 0.1 * rng.normal(size=W.shape) for W in weights]
    exact = lm.jacobian(weights, activation, x)
    w = flat(weights)
    for p in range(len(w)):
        step = np.zeros(len(w))
        step[p] = 1e-6
        up, down = (lm.outputs(unflat(w + s * step, weights), activation, x) for s in (1, -1))
        np.testing.assert_allclose(exact[:, :, p], (up - down) / 2e-6, atol=1e-7)


@pytest.mark.parametrize("hidden", [(5,), (4, 3)])
@pytest.mark.parametrize("block", [60, 7])
def test_normal_equations_are_those_of_the_formed_jacobian(hidden, block):
    x, t, rng = problem()
    blocks = [(x[n : n + block], t[n : n + block]) for n in range(0, len(x), block)]
    weights = lm.initialise((2, *hidden, 2), rng)
    J = lm.jacobian(weights, "tanh", x)
    e = lm.outputs(weights, "tanh", x) - t
    JJ, Je, sse, count = lm.normal_equations(weights, "tanh", blocks)
    np.testing.assert_allclose(JJ, np.einsum("nop,noq->pq", J, J), atol=1e-11)
    np.testing.assert_allclose(Je, np.einsum("nop,no->p", J, e), atol=1e-11)
    assert sse == pytest.approx(np.sum(e**2)) and count == e.size
    assert lm.mean_square(weights, "tanh", blocks) == pytest.approx(np.mean(e**2))


@pytest.mark.parametrize("weight_decay", [0.0, 0.05])
def test_reaches_the_minimum_that_scipy_reaches(weight_decay):
    x, t, rng = problem()
    start = lm.initialise((2, 3, 2), rng)
    trained, curve = lm.train_lm(start, "tanh", [(x, t)], weight_decay=weight_decay)
    decayed = np.concatenate(
        [np.hstack([np.ones((len(W), W.shape[1] - 1)), np.zeros((len(W), 1))]).ravel() for W in start]
    )

    def residuals(w):
        e = (lm.outputs(unflat(w, start), "tanh", x) - t).ravel() / np.sqrt(t.size)
        return np.concatenate([e, np.sqrt(weight_decay / len(w)) * decayed * w])

    reference = least_squares(residuals, flat(start), method="lm", xtol=1e-14, ftol=1e-14, gtol=1e-14)
    assert np.sum(residuals(flat(trained)) ** 2) == pytest.approx(
        2 * reference.cost, rel=1e-6 if weight_decay else 1e-3
    )
    if weight_decay:  # without it the minimum lies in a flat valley
        assert curve.stopped == "gradient"
        np.testing.assert_allclose(
            lm.outputs(trained, "tanh", x), lm.outputs(unflat(reference.x, start), "tanh", x), atol=1e-5
        )


def test_early_stopping_returns_the_best_validation_weights():
    x, t, rng = problem(rows=30)
    xv, tv, _ = problem(seed=1, rows=200)
    weights, curve = lm.train_lm(lm.initialise((2, 10, 2), rng), "tanh", [(x, t)], [(xv, tv)], max_fail=10)
    assert curve.stopped == "validation"
    assert len(curve.validation) == curve.best_epoch + 11
    assert min(curve.validation) == curve.validation[curve.best_epoch]
    assert np.mean((lm.outputs(weights, "tanh", xv) - tv) ** 2) == pytest.approx(min(curve.validation))
    assert np.all(np.diff(curve.train) < 0)

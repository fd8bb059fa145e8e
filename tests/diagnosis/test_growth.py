"""What is added to a factored set has the evidence that the whole set has when it is factored anew."""

import numpy as np
import pytest

from emafault.diagnosis.evidence import Reduced, log_evidence
from emafault.diagnosis.growth import Factored


@pytest.mark.parametrize(("inside", "more"), [(0, 1), (3, 1), (20, 3), (60, 40), (5, 40)])
def test_one_more_is_the_whole_set(inside, more):
    rng = np.random.default_rng(inside + more)
    count = inside + more + 5
    X = rng.standard_normal((2 * count, count)) * 10.0 ** rng.uniform(-2.0, 2.0, count)
    fixed = rng.standard_normal(count) * 0.1
    r = Reduced([str(k) for k in range(count)], X.T @ X, X.T @ rng.standard_normal(2 * count), -3.0, fixed)
    free = rng.permutation(count)[: inside + more]
    mean, sd = rng.standard_normal(len(free)) * 0.2, 10.0 ** rng.uniform(-2.0, 2.0, len(free))
    signs = rng.integers(-1, 2, len(free))
    a, b = slice(None, inside), slice(inside, None)

    grown = Factored(r, free[a], mean[a], sd[a], signs[a]).and_one_more(free[b])
    for width in (1.0, 0.1):  # of what is added
        value, index, found, deviation = grown.log_evidence(mean[b], width * sd[b], signs[b])
        wide = np.where(np.arange(len(free)) < inside, sd, width * sd)
        expected = log_evidence(r, free, mean, wide, signs)
        assert value == pytest.approx(expected[0], rel=1e-9)
        assert index.tolist() == free.tolist()
        assert found == pytest.approx(expected[1], rel=1e-7, abs=1e-9)
        assert deviation == pytest.approx(expected[2], rel=1e-7)


def test_a_set_grown_twice_is_the_whole_set():
    """Grown by large members and then by small ones, it may be grown once more as if it had been factored anew."""
    rng = np.random.default_rng(7)
    count = 70
    X = rng.standard_normal((2 * count, count)) * 10.0 ** rng.uniform(-2.0, 2.0, count)
    fixed = rng.standard_normal(count) * 0.1
    r = Reduced([str(k) for k in range(count)], X.T @ X, X.T @ rng.standard_normal(2 * count), -3.0, fixed)
    free, mean = rng.permutation(count)[:60], rng.standard_normal(60) * 0.2
    sd, signs = 10.0 ** rng.uniform(-2.0, 2.0, 60), rng.integers(-1, 2, 60)

    def priors(k):
        return mean[k], sd[k], signs[k]

    a, b, c, d = slice(40), slice(40, 50), slice(50, 55), slice(55, 60)
    grown = Factored(r, free[a], *priors(a)).with_more(free[b], *priors(b)).with_more(free[c], *priors(c))
    anew = Factored(r, free[:55], *priors(slice(55)))
    assert grown.value == pytest.approx(anew.value, rel=1e-12)
    for found, expected in zip(
        grown.and_one_more(free[d]).log_evidence(*priors(d)), anew.and_one_more(free[d]).log_evidence(*priors(d)),
        strict=True,
    ):  # fmt: skip
        assert found == pytest.approx(expected, rel=1e-9)


def test_columns_without_definite_sign_are_no_evidence():
    r = Reduced(["a", "b"], np.diag([1.0, -50.0]), np.zeros(2), 0.0, np.zeros(2))
    one = np.ones(1)
    good = Factored(r, np.array([0]), 0.0 * one, one, np.zeros(1, int)).and_one_more(np.array([1]))
    assert good.log_evidence(0.0 * one, one, np.zeros(1, int))[0] == -np.inf
    bad = Factored(r, np.array([1]), 0.0 * one, one, np.zeros(1, int)).and_one_more(np.array([0]))
    assert bad.log_evidence(0.0 * one, one, np.zeros(1, int))[0] == -np.inf

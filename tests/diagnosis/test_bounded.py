"""The minimum of a quadratic within bounds, against a library's."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from emafault.diagnosis.bounded import minimum_within


def problem(seed, count=12, collinear=0.95):
    """A quadratic of nearly collinear variables, and bounds about zero that many of its minima lie beyond."""
    rng = np.random.default_rng(seed)
    columns = rng.standard_normal((40, count)) * 10.0 ** rng.uniform(-1.0, 1.0, count)
    columns = (1.0 - collinear) * columns + collinear * columns[:, :1] * rng.uniform(0.5, 2.0, count)
    target = rng.standard_normal(40) * 1e2
    reach = rng.exponential(1.0, count) * np.abs(np.linalg.lstsq(columns, target)[0]).mean()
    return columns, target, -reach * rng.integers(0, 2, count), reach


@pytest.mark.parametrize("seed", range(40))
def test_it_is_the_library_s(seed):
    columns, target, low, high = problem(seed)
    high = np.where(high <= low, low + 1.0, high)
    found = minimum_within(columns.T @ columns, columns.T @ target, low, high)
    reference = lsq_linear(columns, target, (low, high), method="bvls", tol=1e-14).x
    assert np.all((low <= found) & (found <= high))
    cost = [float(np.sum((columns @ x - target) ** 2)) for x in (found, reference)]
    assert cost[0] <= cost[1] * (1.0 + 1e-9)


def test_what_was_held_on_the_way_is_let_go_where_the_minimum_lies_inside():
    """Held for good, the second variable would end at its lower end, uphill of where it began."""
    A = np.array([[1.0, 0.99], [0.99, 1.0]])
    at_best = np.array([30.0, -20.0])
    low, high = np.array([-1.0, -5.0]), np.array([1.0, 20.0])
    found = minimum_within(A, A @ at_best, low, high)
    assert found == pytest.approx([1.0, -20.0 + 0.99 * 29.0])


def test_without_bounds_it_is_the_solution_and_from_outside_it_comes_in():
    A, right, free = np.diag([1.0, 4.0]), np.array([2.0, 4.0]), np.full(2, np.inf)
    assert minimum_within(A, right, -free, free) == pytest.approx([2.0, 1.0])
    assert minimum_within(A, right, np.array([3.0, -5.0]), np.array([4.0, -2.0])) == pytest.approx([3.0, -2.0])

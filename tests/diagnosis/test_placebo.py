"""The placebo of the ladder is fitted: with as many functions as there are, it closes what these can."""

import numpy as np
import pytest

from emafault.diagnosis.closure import placebo, rms
from emafault.diagnosis.linear import White


def white(rows, residual):
    """A block of whitened rows (row, column) and residual (row,)."""
    both = np.column_stack([rows, residual])
    names = [f"remainder.torque.{n}" for n in range(rows.shape[1])]
    return White("one", "torque", names, both.T @ both, len(rows))


def test_random_signatures_are_fitted():
    rng = np.random.default_rng(2)
    rows, size = rng.standard_normal((200, 4)), 3
    residual = rows @ np.array([1.0, -1.0, 0.5, 2.0]) + 0.1 * rng.standard_normal(200)
    confirm = white(rows, residual)
    names = confirm.names
    explored = type("Explored", (), {"index": {n: k for k, n in enumerate(names)}, "M": rows.T @ rows})()
    explored.b = -rows.T @ residual
    some, every = (placebo(explored, [confirm], ["torque"], n)[0] for n in (size, 4))
    assert every == pytest.approx(0.1, rel=0.2)
    assert every < some < 0.95 * rms([confirm])
    assert placebo(explored, [confirm], ["bus"], size)[0] == rms([confirm])

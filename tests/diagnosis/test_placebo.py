"""The placebo of the ladder is fitted: with as many functions as there are, it closes what these can."""

import numpy as np
import pytest

from emafault.diagnosis.closure import placebo, rms
from emafault.diagnosis.evidence import Normal
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
    explored = Normal(confirm.names, rows.T @ rows, rows.T @ residual, 0.0)
    some, every = (placebo(explored, [confirm], ["torque"], n)[0] for n in (size, 4))
    assert every == pytest.approx(0.1, rel=0.2)
    assert every < some < 0.95 * rms([confirm])
    assert placebo(explored, [confirm], ["bus"], size)[0] == rms([confirm])


def test_what_the_recalibrated_model_makes_up_for_makes_no_placebo_large():
    """Of a function that the unit's own parameter takes up the explored recordings know next to nothing once that is
    free, and the others, where it is frozen, all."""
    rng = np.random.default_rng(3)
    rows = rng.standard_normal((200, 4))
    residual = rows @ np.array([0.0, 0.1, 0.1, 0.1]) + rng.standard_normal(200)
    confirm = white(rows, residual)
    unit = rows[:, :1] + 1e-4 * rng.standard_normal((200, 1))
    both = np.column_stack([unit, rows])
    explored = Normal(["unit.k", *confirm.names], both.T @ both, both.T @ residual, 0.0)
    assert placebo(explored, [confirm], ["torque"], 2)[0] == pytest.approx(rms([confirm]), rel=0.05)

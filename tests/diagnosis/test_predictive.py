"""Recordings that confirm are checked for what their fitted model leaves, without a rival to it."""

from types import SimpleNamespace

import numpy as np
import pytest

from emafault.diagnosis.linear import White
from emafault.diagnosis.predictive import log_odds
from emafault.diagnosis.set_prior import REMAINDER_PRIOR

ROWS = 4000
PRIOR = np.log(REMAINDER_PRIOR / (1.0 - REMAINDER_PRIOR))


def white(equation, square, names=("a", "b"), recording="c.nc"):
    """A block with columns of some power and a residual of this sum of squares."""
    return White(recording, equation, list(names), np.diag([*np.ones(len(names)), square]), ROWS)


def found(*confirm, nuisances=("a", "b", "zero@c.nc")):
    fit = SimpleNamespace(whites=[white("torque", ROWS, ("a", "b", "x")), white("bus", ROWS, ("b", "zero@c.nc"))])
    model = SimpleNamespace(deviations={"x": 1.0, "remainder.torque.0.1": 0.5})
    return log_odds(SimpleNamespace(nuisances=list(nuisances)), fit, model, confirm)


def test_what_is_left_beyond_the_best_is_weighed_against_what_is_free():
    odds = found(white("torque", 1.1 * ROWS), white("bus", ROWS))
    assert odds["torque"] == pytest.approx(PRIOR + 0.05 * ROWS - 1.5 * np.log(ROWS))
    assert odds["bus"] == pytest.approx(PRIOR - 0.5 * np.log(ROWS))  # what is a recording's own is at its best


def test_recordings_add_up_and_the_controller_s_equations_are_left_out():
    odds = found(white("torque", 1.01 * ROWS), white("torque", 0.99 * ROWS, recording="d.nc"), white("control", 1e6))
    assert odds == {"torque": pytest.approx(PRIOR - 1.5 * np.log(2 * ROWS))}

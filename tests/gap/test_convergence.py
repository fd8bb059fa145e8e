"""Fits that would stop on their way."""

import numpy as np
import pytest

from emafault.gap.how_far import refit
from emafault.gap.inference import Problem
from emafault.gap.twin import Parameter

from .test_inference import Lines


class Faulty(Lines):
    """The second recording has a fault of its own, which acts far from linearly."""

    def __init__(self, seed, fault):
        super().__init__(seed)
        self.data["two"] = self.data["two"] + np.expm1(fault) * np.cos(4 * self.x)
        self.parameters = [
            *self.parameters,
            Parameter("seeded two.N", "1", 0.0, 0.0, 2.0, -5, 5, 0.01, recordings=("two",), fault="Na"),
        ]

    def predict(self, values, part):
        values = np.atleast_2d(values)
        own = np.array([np.repeat(np.array(part) == "two", len(self.x))])
        return super().predict(values, part) + own * np.expm1(values[:, 4:]) * np.cos(4 * np.tile(self.x, len(part)))


@pytest.mark.parametrize("fault", [-2.0, 1.5, 3.0])
def test_a_fault_of_a_confirm_recording_is_fitted_to_the_end(fault):
    twin = Faulty(3, fault)
    null = Problem(twin, ["one"]).fit_null()
    confirm = Problem(twin, ["two"])
    confirm.set_covariance(null.values)
    found = refit(confirm, null.values, [4])
    assert found.values[4] == pytest.approx(fault, abs=0.3)
    assert found.rms < 1.3

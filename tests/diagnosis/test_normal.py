"""Steps of the point within the reach of the priors."""

import numpy as np
import pytest

from emafault.diagnosis.fit import NOTHING, Bench
from emafault.diagnosis.model import TOLERANCES, Block, Parameter, Variant

ROWS = 4000


class Machine:
    """Two coefficients of nearly the same column, the first far beyond where its prior has any mass."""

    forms = units = ()
    parameters = {n: Parameter(n, 0.0, 0.0, 1.0) for n in ("a", "b")}  # noqa: RUF012

    def blocks(self, values, recording, wanted=None, disturbed=False):
        rng = np.random.default_rng(0)
        noise, one, other = rng.standard_normal((3, ROWS))
        columns = {"a": one, "b": one + 0.1 * other}
        residual = noise + sum((values[n] - true) * columns[n] for n, true in (("a", 5.0), ("b", -1.0)))
        return [Block(recording, "torque", residual, columns, [np.ones(ROWS)], np.ones(ROWS, bool))]


def test_what_is_held_at_the_end_of_its_prior_is_held_while_the_others_are_fitted():
    """Cut off after a joint fit, the second would stay where it makes up for a first that is not there."""
    bench = Bench(Machine(), ["r"])
    bench.move(NOTHING, bench.normal(bench.linearise(NOTHING, corrected=False), NOTHING))
    normal = bench.normal(bench.linearise(NOTHING, corrected=False), NOTHING)
    assert bench.point["a"] == bench.reach
    b = normal.index["b"]
    assert abs(bench.point["b"] + normal.g[b]) < 1e-6 * normal.H[b, b]


def test_a_unit_at_the_end_of_its_tolerance_is_within_reach():
    """0.61 is within four tolerances of 10 %, though its logarithm is 4.9 of them from that of 1."""

    class Scaled(Machine):
        parameters = {"k": Parameter("k", 1.0, 1.0, 0.1, vanishes=0.0)}  # noqa: RUF012

    bench = Bench(Scaled(), ["r"])
    for wanted, held in ((0.61, 0.61), (0.5, 0.6), (1.45, 1.45), (2.0, np.exp(0.4))):
        assert np.exp(bench._within_reach("k", np.log(wanted))) == pytest.approx(held)


def test_the_hole_of_a_calibration_has_its_edges_at_values_of_the_unit():
    """Four tolerances of 10 % below one are 0.6, whose logarithm is further from one's than that of 1.4."""

    class Scaled(Machine):
        parameters = {  # noqa: RUF012
            "k": Parameter("k", 1.0, 1.0, 0.1, vanishes=0.0),
            "k+": Parameter("k+", 0.0, 0.0, 0.5, alias="k", vanishes=0.0),
        }

    variant = Variant([Scaled.parameters["k+"]], hole=[TOLERANCES * 0.1 / 0.5])
    low, high = Bench(Scaled(), ["r"])._hole(variant)[:, 0] * 0.5
    assert np.exp([low, high]) == pytest.approx([0.6, 1.4])

"""Fits that would stop on their way: on the confirm recordings, of a set's parts, and on averaged predictions."""

from dataclasses import replace

import numpy as np
import pytest

from emafault.gap.conclude import averaged_fit, deserved, with_outside
from emafault.gap.how_far import refit
from emafault.gap.inference import Problem
from emafault.gap.twin import Hypothesis, Parameter

from .test_inference import Lines, Scattering


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


def fitted(twin, effects):
    """Null and a set fitted to the end, both recordings, and the twin's library."""
    problem, by_id = Problem(twin, ["one", "two"]), {h.effect: h for h in twin.hypotheses}
    null = problem.fit_null()
    chosen = [by_id[e] for e in effects]
    signatures = {c.effects[0]: c.signature for c in problem.screen(null, twin.hypotheses)}
    start = problem.linear(
        null, chosen, null.values, null.prediction, np.concatenate([signatures[e] for e in effects], axis=1)
    )
    return problem, null, problem.polish(null, start, by_id), by_id


def test_a_part_that_was_left_behind_early_leads_again_where_it_does_as_well():
    twin = Lines(4, curvature=1.0)
    problem, null, pair, by_id = fitted(twin, ("curve", "step"))
    ranked = deserved(problem, null, [pair], by_id, 3.0)
    assert [c.effects for c in ranked] == [("curve",), ("curve", "step")]
    assert ranked[0].gain > pair.gain - 3.0 and ranked[0].polished


def test_a_set_of_which_every_part_lacks_something_stays():
    twin = Lines(4, curvature=1.0, step=0.8)
    problem, null, pair, by_id = fitted(twin, ("curve", "step"))
    assert deserved(problem, null, [pair], by_id, 3.0) == [pair]


@pytest.mark.parametrize(("tolerance", "named"), [(0.02, ("curve", "slope")), (0.5, ("curve",))])
def test_what_a_set_has_far_outside_its_tolerance_is_a_cause_beside_it(tolerance, named):
    twin = Lines(4, curvature=1.0)  # of slope 1.2
    twin.parameters[1] = replace(twin.parameters[1], sd=tolerance, specified="line")
    twin.hypotheses = [*twin.hypotheses, Hypothesis("slope", ("line",), ("unit.slope",), (), "calibration")]
    problem, null, curve, by_id = fitted(twin, ("curve",))
    ranked = with_outside(problem, null, [curve], by_id, 3.0)
    assert ranked[0].effects == named and ranked[-1] is curve
    assert ranked[0].gain >= curve.gain + 3.0 * (len(named) - 1)


class Averaging(Scattering):
    """A twin that can average its scatter."""

    def smooth(self, values, part):
        return Lines.predict(self, values, part)[0]


def test_an_averaged_set_explains_no_less_than_the_null_that_it_contains():
    twin = Averaging(6, curvature=1.0)
    twin.parameters = [replace(p, amplitude=p.effect is not None) for p in twin.parameters]
    problem, null, found, by_id = fitted(twin, ("curve",))
    astray = found.point.values + np.array([0.5, -0.5, -3.0, 0.0])
    stuck = problem.point(astray, problem.predict(astray)[0], 1e-9 * found.point.jacobian, found.point.free)
    assert problem.averaged(stuck, [by_id["curve"]]).objective > null.objective  # it finds no way from there
    held = averaged_fit(problem, null, replace(found, point=stuck, gain=20.0), by_id)
    assert held.point.objective <= null.objective
    led = replace(problem.point(astray, problem.predict(astray)[0], found.point.jacobian, found.point.free))
    assert averaged_fit(problem, null, replace(found, point=led, gain=20.0), by_id).gain > 15.0

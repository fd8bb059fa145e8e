"""What the confirm recordings decide, each rule on the linear twin where nothing else could decide it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from emafault.gap.decide import UNCALIBRATED, Calibration, decide
from emafault.gap.diagnose import diagnose, fault_vectors
from emafault.gap.held_out import held_out
from emafault.gap.how_far import climb, refit
from emafault.gap.inference import Problem
from emafault.gap.which import search

from .test_inference import Lines

BASE = np.array([0.3, 1.2, 0.0, 0.0])


def outcome(there, named):
    """Outcome of a curve of size ``named`` on a confirm recording whose curve is ``there``."""
    problem = Problem(Lines(3, curvature=there), ["two"])
    problem.set_covariance(BASE)
    curved = BASE + np.array([0.0, 0.0, named, 0.0])
    ladder = SimpleNamespace(problem=problem, recalibrated=refit(problem, BASE, []), nominal=refit(problem, BASE, []))
    candidate = SimpleNamespace(effects=("curve",), gain=40.0, point=SimpleNamespace(values=curved))
    return held_out(
        SimpleNamespace(
            ladder=ladder,
            decision=SimpleNamespace(verdict="explained"),
            found=SimpleNamespace(candidates=[candidate]),
            twin=SimpleNamespace(hypotheses=Lines(3).hypotheses),
            explore=None,
        )
    )


def test_a_set_that_leaves_the_confirm_recordings_worse_is_contradicted():
    for there, named in ((0.0, 1.0), (0.8, -0.8), (0.8, 0.02)):
        found = outcome(there, named)
        assert found["outcome"] == "contradicted" and found["claimed"] == []
    assert outcome(0.8, 0.8) == outcome(0.8, 0.8) | {"outcome": "holds", "claimed": ["curve"]}


def test_what_is_left_of_the_confirm_recordings_withdraws_a_name():
    twin = Lines(3, curvature=1.0)
    problem = Problem(twin, ["one", "two"])
    found = search(problem, twin.hypotheses, 3.0)
    certain = replace(Calibration.load(UNCALIBRATED), right=(9.0, 0.0, 0.0, 0.0, 0.0), gap=(9.0, 0.0, 0.0))
    for left, verdict in ((None, "explained"), (0.1, "explained"), (0.9, "unknown")):
        assert decide(problem, found, twin.hypotheses, certain, left).verdict == verdict


def test_a_placebo_is_fitted_and_not_the_recalibrated_model_over_again():
    twin = Lines(4, curvature=1.0)
    problem = Problem(twin, ["one"])
    found = search(problem, twin.hypotheses, 3.0)
    ladder = climb(twin, ["two"], problem, found.null, found.candidates[0])
    assert ladder.after.rms < ladder.placebo
    assert abs(ladder.placebo - ladder.recalibrated.rms) > 0.01 * ladder.recalibrated.rms


def test_an_interval_of_a_fault_widens_by_what_else_is_believable():
    fault = SimpleNamespace(fault="Na", recordings=("one.nc",))
    problem = SimpleNamespace(parameters=[fault], nuisances=[0])
    here = SimpleNamespace(values=np.array([0.03]), covariance=np.array([[1e-6]]), free=[0])
    other = SimpleNamespace(values=np.array([0.05]))
    narrow = fault_vectors(problem, here, None)["one.nc"]["Na"]
    wide = fault_vectors(problem, here, None, [(here, 0.5), (other, 0.5)])["one.nc"]["Na"]
    assert narrow["value"] == wide["value"] == 0.03
    ratio = (wide["high"] - wide["low"]) / (narrow["high"] - narrow["low"])
    assert ratio == pytest.approx(np.hypot(1e-3, np.sqrt(0.5) * 0.02) / 1e-3)


def test_a_diagnosis_withdraws_what_its_confirm_recordings_contradict():
    certain = replace(Calibration.load(UNCALIBRATED), right=(9.0, 0.0, 0.0, 0.0, 0.0), gap=(9.0, 0.0, 0.0))
    for there, verdict in ((1.0, "explained"), (-1.0, "unknown")):
        twin = Lines(3, curvature=1.0)
        twin.data["two"] = Lines(7, curvature=there).data["two"]
        found = diagnose(twin, "bench", ["one"], ["two"], certain).verdict
        assert (found["before_confirm"], found["verdict"]) == ("explained", verdict)

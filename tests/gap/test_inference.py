"""The machine-independent core against closed forms, on a linear twin that has nothing to do with an actuator."""

from dataclasses import replace

import numpy as np
import pytest

from emafault.gap.conclude import fitted_alike
from emafault.gap.decide import UNCALIBRATED, Calibration, decide, evidence_of, share_left
from emafault.gap.groups import groups
from emafault.gap.how_far import Ladder, closed, left_open, refit, square_error
from emafault.gap.inference import Problem
from emafault.gap.misfit import MOST, SPECIFICATION, families, left_where_acting
from emafault.gap.sizes import outside
from emafault.gap.twin import Cell, Hypothesis, Parameter
from emafault.gap.where import beyond_specification, equation_of
from emafault.gap.which import search


class Lines:
    """y = offset + slope x + curvature x^2 + step (x > 0), two recordings, independent noise of known size."""

    name = "lines"
    sigma = 0.1

    def __init__(
        self, seed: int, curvature: float = 0.0, step: float = 0.0, outside: float = 0.0, library=("curve", "step")
    ):
        self.x = np.linspace(-1.0, 1.0, 40)
        rng = np.random.default_rng(seed)
        self.data = {}
        for name in ("one", "two"):
            y = 0.3 + 1.2 * self.x + curvature * self.x**2 + step * (self.x > 0) + outside * np.sin(9 * self.x)
            self.data[name] = y + self.sigma * rng.standard_normal(len(self.x))
        self.parameters = [
            Parameter("unit.offset", "1", 0.0, 0.0, 1.0, -5, 5, 0.01),
            Parameter("unit.slope", "1", 1.0, 1.0, 1.0, -5, 5, 0.01),
            Parameter("curve.a", "1", 0.0, 0.0, 1.0, -5, 5, 0.01, "curve"),
            Parameter("step.a", "1", 0.0, 0.0, 1.0, -5, 5, 0.01, "step"),
        ]
        every = {"curve": ("curve.a",), "step": ("step.a",)}
        self.hypotheses = [Hypothesis(e, ("line",), every[e], ((0.5,),)) for e in library]

    def cells(self, part):
        return [Cell(n, "line", "x", float(x), float(x), f"bin {k // 8}") for n in part for k, x in enumerate(self.x)]

    def observed(self, part):
        return np.concatenate([self.data[n] for n in part])

    def predict(self, values, part):
        x = np.tile(self.x, len(part))
        return np.array([v[0] + v[1] * x + v[2] * x**2 + v[3] * (x > 0) for v in np.atleast_2d(values)])

    def covariance(self, values, part):
        return self.sigma**2 * np.eye(len(part) * len(self.x))


def design(twin, columns):
    x = np.tile(twin.x, 2)
    return np.stack([np.ones_like(x), x, x**2, (x > 0).astype(float)], axis=1)[:, columns]


def test_null_fit_is_the_gaussian_posterior():
    twin = Lines(1)
    problem = Problem(twin, ["one", "two"])
    null = problem.fit_null()
    A, y = design(twin, [0, 1]), twin.observed(["one", "two"])
    H = A.T @ A / twin.sigma**2 + np.eye(2)
    expected = np.linalg.solve(H, A.T @ y / twin.sigma**2 + np.array([0.0, 1.0]))
    assert null.values[:2] == pytest.approx(expected, rel=1e-6)
    assert null.covariance == pytest.approx(np.linalg.inv(H), rel=0.03)


def test_gain_in_evidence_is_the_exact_ratio_of_marginal_likelihoods():
    twin = Lines(2, curvature=0.4)
    problem = Problem(twin, ["one", "two"])
    null = problem.fit_null()
    found = {c.effects[0]: c for c in problem.screen(null, twin.hypotheses)}
    y, mean = twin.observed(["one", "two"]), np.array([0.0, 1.0])

    def log_marginal(columns, prior):
        A = design(twin, columns)
        C = twin.sigma**2 * np.eye(len(y)) + A @ A.T
        # the core trusts no correlation to the last digit, which here changes nothing: the noise is white
        r = y - A @ prior
        return -0.5 * (r @ np.linalg.solve(C, r) + np.linalg.slogdet(C)[1])

    exact = log_marginal([0, 1, 2], np.array([*mean, 0.0])) - log_marginal([0, 1], mean)
    assert found["curve"].gain == pytest.approx(exact, abs=0.1)


@pytest.mark.parametrize(
    ("truth", "named"),
    [
        ({"curvature": 0.5}, ("curve",)),
        ({"step": 0.5}, ("step",)),
        ({"curvature": 0.6, "step": 0.6}, ("curve", "step")),
    ],
)
def test_search_names_the_effects_in_the_data(truth, named):
    twin = Lines(3, **truth)
    found = search(Problem(twin, ["one", "two"]), twin.hypotheses, 3.0)
    assert tuple(sorted(found.candidates[0].effects)) == named


def test_what_the_library_lacks_is_left_over_and_called_unknown():
    twin = Lines(4, outside=0.8)
    problem = Problem(twin, ["one", "two"])
    found = search(problem, twin.hypotheses, 3.0)
    decision = decide(problem, found, twin.hypotheses, Calibration.load())
    assert decision.verdict == "unknown"
    assert families(problem, found.null)[0].excess > 5.0


def test_what_a_fit_can_only_take_up_far_from_the_specification_is_a_gap():
    twin = Lines(6, library=())
    # the unit's slope is specified to 0.02; the recordings have it 0.4 away
    twin.parameters[1] = Parameter("unit.slope", "1", 0.8, 0.8, 0.02, -5, 5, 0.01, specified="line")
    problem = Problem(twin, ["one", "two"])
    found = search(problem, (), 3.0)
    worst = found.null_families[0]
    assert (worst.equation, worst.label, worst.along) == ("line", "unit.slope", SPECIFICATION)
    moved = beyond_specification(found.null_families)[0]
    pull = abs(found.null.values[1] - 0.8) / 0.02
    assert moved["parameter"] == "unit.slope" and moved["deviations"] == pytest.approx(pull, abs=0.06)
    assert equation_of(found.null_families) == "line"
    assert all(f.along != SPECIFICATION for f in found.regions)
    widened = families(problem, found.null, widened=[1])
    assert all(f.label != "unit.slope" for f in widened)
    decision = decide(problem, found, twin.hypotheses, Calibration.load())
    assert decision.verdict == "unknown"


@pytest.mark.parametrize(("most", "verdict"), [(3.0, "explained"), (1.0, "unknown")])
def test_an_effect_that_ends_at_the_edge_of_its_range_stands_in_for_something_else(most, verdict):
    twin = Lines(8, curvature=1.5)
    twin.parameters[2] = Parameter("curve.a", "1", 0.0, 0.0, 1.0, -most, most, 0.01, "curve", amplitude=True)
    problem = Problem(twin, ["one", "two"])
    found = search(problem, twin.hypotheses, 3.0)
    assert decide(problem, found, twin.hypotheses, Calibration.load()).verdict == verdict
    assert any("curve" in c.effects for c in found.candidates) == (verdict == "explained")


class Precise(Lines):
    """Recordings that tell the slope far better than its specification does."""

    sigma = 0.01

    def __init__(self, slope, **truth):
        super().__init__(6, **truth)
        self.parameters[1] = Parameter("unit.slope", "1", slope, slope, 0.02, -5, 5, 0.01, specified="line")
        self.hypotheses.append(Hypothesis("slope", ("line",), ("unit.slope",), (), "calibration"))


@pytest.mark.parametrize("remainder", [0.0, 0.03, 0.06])
def test_a_unit_far_outside_its_specification_is_named_beside_a_remainder(remainder):
    twin = Precise(0.8, outside=remainder)  # the recordings' slope is 1.2; the null has it, and is pulled a little
    problem = Problem(twin, ["one", "two"])
    found = search(problem, twin.hypotheses, 3.0)
    decision = decide(problem, found, twin.hypotheses, Calibration.load())
    assert decision.verdict == ("partly" if remainder else "explained")
    first = found.candidates[0]
    assert first.effects == ("slope",) and found.within.values[1] == 0.8
    # the gain and the share left count from there, not from the null, which has taken the slope up
    assert first.gain < 300.0 < 10_000.0 < decision.evidence.gain
    assert decision.evidence.unexplained < 0.05
    if remainder == 0.06:
        assert problem.excess(first.point) > MOST * problem.excess(found.null)
        rival = next(c for c in found.candidates if c.effects == ("step",))
        assert outside(problem, rival.point, {h.effect: h for h in twin.hypotheses}) == ["slope"]


def test_a_unit_outside_its_specification_is_not_named_where_it_is_little_of_the_gap():
    twin = Precise(1.11, outside=0.3)
    problem = Problem(twin, ["one", "two"])
    found = search(problem, twin.hypotheses, 3.0)
    assert "slope" not in found.candidates[0].effects and found.within is found.null
    assert decide(problem, found, twin.hypotheses, Calibration.load()).verdict == "unknown"


@pytest.mark.parametrize("other_form", [0.0, 0.9])
def test_beside_a_remainder_one_more_effect_must_take_up_a_good_part_of_it(other_form):
    twin = Lines(7, curvature=1.5, step=0.3, outside=other_form)
    problem = Problem(twin, ["one", "two"])
    found = search(problem, twin.hypotheses, 3.0)
    named = set(found.candidates[0].effects)
    assert named == ({"curve"} if other_form else {"curve", "step"})
    assert found.candidates[0].polished


class Besides(Lines):
    """The second recording measures something else, which no cause of the library moves."""

    def __init__(self, seed, beside, **others):
        super().__init__(seed, **others)
        self.data["two"] = np.random.default_rng(seed).normal(0.0, self.sigma, 40) + beside * np.sin(9 * self.x)

    def cells(self, part):
        return [replace(c, equation="other", label="other") if c.recording == "two" else c for c in super().cells(part)]

    def predict(self, values, part):
        whole = super().predict(values, part)
        return np.where(np.array([c.recording == "two" for c in self.cells(part)]), 0.0, whole)


def test_a_cause_beside_a_large_remainder_is_named_and_a_stand_in_is_not():
    twin = Besides(3, beside=0.3, curvature=1.0)
    problem = Problem(twin, ["one", "two"])
    found = search(problem, twin.hypotheses, 3.0)
    evidence, _ = evidence_of(problem, found, twin.hypotheses)
    assert 0.3 < evidence.unexplained < MOST and evidence.acting < 0.02
    assert decide(problem, found, twin.hypotheses, Calibration.load(UNCALIBRATED)).verdict == "partly"
    # the same gap with its cause left out: what stands in for it leaves some of it where it acts
    twin = Besides(3, beside=0.3, curvature=1.0, library=("step",))
    problem = Problem(twin, ["one", "two"])
    found = search(problem, twin.hypotheses, 3.0)
    stand_in = problem.refine(found.null, found.singles[0], {h.effect: h for h in twin.hypotheses})
    assert left_where_acting(problem, found.null, stand_in.point) > 0.3
    assert decide(problem, found, twin.hypotheses, Calibration.load(UNCALIBRATED)).verdict == "unknown"


def test_a_set_without_evidence_over_the_empty_one_is_not_believed():
    twin = Lines(3, curvature=1.0)
    problem = Problem(twin, ["one", "two"])
    found = search(problem, twin.hypotheses, 3.0)
    certain = replace(Calibration.load(UNCALIBRATED), right=(9.0, 0.0, 0.0, 0.0, 0.0), gap=(9.0, 0.0, 0.0))
    assert decide(problem, found, twin.hypotheses, certain).verdict == "explained"
    idle = replace(found, candidates=[replace(c, gain=-1.0) for c in found.candidates])
    assert decide(problem, idle, twin.hypotheses, certain).verdict == "unknown"


def test_a_step_that_promises_nothing_is_not_taken():
    twin = Lines(5, curvature=0.5)
    problem = Problem(twin, ["one", "two"])
    null, asked = problem.fit_null(), []
    start = problem.point(null.values + 0.3, problem.predict(null.values + 0.3)[0], null.jacobian, null.free)
    moved = problem.solve(start.values, start.prediction, start.jacobian, start.free)

    def predict(values):
        asked.append(values)
        return problem.predict(values)[0]

    fit = problem.descend(start, predict=predict)
    assert problem.promised(start, moved) == pytest.approx(start.objective - fit.objective)  # all is linear here
    assert len(asked) == 1


def test_what_is_left_is_judged_where_nothing_hunts():
    twin = Lines(9, curvature=1.0)
    twin.erratic = lambda name: name == "two"
    twin.data["two"] = twin.data["two"] + 20.0 * twin.sigma * np.sign(np.sin(9 * twin.x))
    problem = Problem(twin, ["one", "two"])
    assert problem.judging == ["one"] and Problem(twin, ["two"]).judging == ["two"]
    found = search(problem, twin.hypotheses, 3.0)
    best = found.candidates[0]
    assert best.effects == ("curve",)
    problem.set_covariance(best.point.values)  # as if what hunts counted in full
    residual = problem.whiten(problem.observed - best.point.prediction)
    everywhere = float(residual @ residual) - len(problem.cells)
    assert problem.excess(best.point) < 0.05 * everywhere
    evidence, _ = evidence_of(problem, found, twin.hypotheses)
    assert evidence.unexplained < MOST and evidence.acting < MOST


def test_far_from_the_truth_an_erratic_recording_counts_no_more_than_the_others():
    twin = Lines(9, curvature=0.3)
    twin.erratic = lambda name: name == "two"
    twin.data["two"] = twin.data["two"] + 50.0 * twin.sigma * twin.x**2
    problem = Problem(twin, ["one", "two"])
    null = problem.fit_null()
    residual = problem.whiten(twin.observed(["one", "two"]) - null.prediction)
    calm, erratic = (float(np.mean(residual[problem.rows[name]] ** 2)) for name in ("one", "two"))
    assert 1.0 < calm and erratic == pytest.approx(calm, rel=0.3)
    problem.set_covariance(null.values)
    wild = problem.deviations()
    twin.data["two"] = twin.data["one"]
    same = Problem(twin, ["one", "two"])
    same.set_covariance(null.values)
    same.temper(null.prediction)  # what differs no more than the others do keeps its weight
    np.testing.assert_array_equal(same.deviations(), wild)


class HalfTold(Lines):
    """The explored recording looks at one side only, where the slope is hardly told from the offset."""

    def __init__(self, seed, **effects):
        super().__init__(seed, **effects)
        self.told = {"one": self.x > 0.9, "two": np.ones(len(self.x), bool)}

    def _rows(self, part):
        return np.concatenate([self.told[n] for n in part])

    def cells(self, part):
        return [c for c, told in zip(super().cells(part), self._rows(part), strict=True) if told]

    def observed(self, part):
        return super().observed(part)[self._rows(part)]

    def predict(self, values, part):
        return super().predict(values, part)[:, self._rows(part)]

    def covariance(self, values, part):
        return self.sigma**2 * np.eye(int(self._rows(part).sum()))


@pytest.mark.parametrize(("curvature", "held"), [(0.0, True), (3.0, False)])
def test_what_the_explored_recordings_leave_open_contradicts_nothing(curvature, held):
    twin = HalfTold(8, curvature=curvature)
    explore = Problem(twin, ["one"])
    null = explore.fit_null()
    confirm = Problem(twin, ["two"])
    confirm.set_covariance(null.values)
    frozen = refit(confirm, null.values, [])
    assert frozen.rms > 2.0
    ladder = Ladder(confirm, frozen, frozen, frozen.rms, frozen, left_open(explore, confirm, null))
    assert (ladder.misfit(frozen) < 1.3) == held


def test_probabilities_sum_to_one():
    twin = Lines(5, curvature=0.15)
    problem = Problem(twin, ["one", "two"])
    decision = decide(problem, search(problem, twin.hypotheses, 3.0), twin.hypotheses, Calibration.load(UNCALIBRATED))
    assert sum(p for _, p in decision.sets) + decision.empty + decision.unknown == pytest.approx(1.0)


@pytest.mark.parametrize("bias", [0.0, 0.5, 8.0])
def test_standard_error_of_a_mean_square_about_a_gap(bias):
    rng = np.random.default_rng(1)
    squares = np.square(bias + rng.standard_normal((20_000, 60))).mean(1)
    assert square_error(np.sqrt(1.0 + bias**2), 60) == pytest.approx(squares.std(), rel=0.03)


def test_of_a_gap_hardly_seen_noise_alone_leaves_no_share():
    weak = share_left(1.28, 1.1, 300)
    assert weak is not None and weak < MOST
    kept = share_left(1.28, 1.28, 300)
    assert kept is not None and kept > MOST


def test_closed_share_and_its_absence_below_the_noise():
    assert closed(3.0, 1.0, 1.0, 400) == pytest.approx(1.0)
    assert closed(3.0, 3.0, 1.0, 400) == pytest.approx(0.0)
    assert closed(1.01, 1.0, 1.0, 400) is None
    assert share_left(1.0, 1.0, 400) is None
    worse = share_left(2.0, 2.5, 400)
    assert worse is not None and worse > 1.0


class Specified(Lines):
    """The slope is specified to a tenth."""

    def __init__(self, seed, slope=1.2):
        super().__init__(seed)
        self.data = {n: y + (slope - 1.2) * self.x for n, y in self.data.items()}
        slope_of_unit = Parameter("unit.slope", "1", 1.2, 1.2, 0.1, -5, 5, 0.01, specified="line")
        self.parameters = [self.parameters[0], slope_of_unit, *self.parameters[2:]]


@pytest.mark.parametrize("slope", [1.2, 2.0])
def test_a_fit_carried_off_by_what_it_hardly_sees_finds_back(slope):
    twin = Specified(11, slope)
    problem = Problem(twin, ["one", "two"])
    fitted = problem.fit_null()
    assert fitted.values[1] == pytest.approx(slope, abs=0.1)
    away = fitted.values.copy()
    away[1] = 1.2 + 5.0 * 0.1
    misled = fitted.jacobian.copy()
    misled[:, problem.nuisances.index(1)] *= -1.0  # derivatives made of scatter
    stuck = problem.descend(problem.point(away, problem.predict(away)[0], misled, problem.nuisances))
    back = problem.unpulled(stuck)
    if slope == 1.2:
        assert stuck.values[1] > 1.5 and back.objective < 0.5 * stuck.objective
        assert back.values[1] == pytest.approx(1.2, abs=0.05)
    else:  # where the data want it there it stays
        assert problem.unpulled(fitted) is fitted


class Alike(Lines):
    """A second name for the curve, with an amplitude in which fits go slowly."""

    def __init__(self, seed, curvature):
        super().__init__(seed, curvature=curvature, library=("curve",))
        self.parameters.append(Parameter("bend.a", "1", 0.0, 0.0, 1.0, -5, 5, 0.01, "bend"))
        self.hypotheses.append(Hypothesis("bend", ("line",), ("bend.a",), ((0.9,),)))

    def predict(self, values, part):
        x = np.tile(self.x, len(part))
        return super().predict(values, part) + np.array([v[4] ** 5 * x**2 for v in np.atleast_2d(values)])


def test_candidates_refitted_together_come_out_as_alone_and_ask_together(monkeypatch):
    twin = Alike(13, curvature=3.0)
    problem = Problem(twin, ["one", "two"])
    null = problem.fit_null()
    by_id = {h.effect: h for h in twin.hypotheses}
    given = list(zip(problem.screen(null, twin.hypotheses), (3, 1), strict=True))
    asked = []
    predict = twin.predict
    monkeypatch.setattr(twin, "predict", lambda values, part: asked.append(len(values)) or predict(values, part))
    alone = [problem.refine(null, candidate, by_id, rounds) for candidate, rounds in given]
    first = len(asked)
    together = problem.refine_all(null, given, by_id)
    assert [c.effects for c in together] == [("curve",), ("bend",)]
    for one, other in zip(alone, together, strict=True):
        assert one.gain == other.gain and one.refined
        np.testing.assert_array_equal(one.point.values, other.point.values)
        np.testing.assert_array_equal(one.signature, other.signature)
    assert len(asked) - first < first
    assert sum(asked[first:]) == sum(asked[:first])
    assert problem.refine_all(null, [], by_id) == []


def test_a_rival_is_not_outdone_for_lack_of_convergence():
    twin = Alike(13, curvature=3.0)
    problem = Problem(twin, ["one", "two"])
    null = problem.fit_null()
    by_id = {h.effect: h for h in twin.hypotheses}
    curve, bend = (problem.refine(null, c, by_id) for c in problem.screen(null, twin.hypotheses))
    values = problem.polish(null, bend, by_id).point.values.copy()
    values[-1] -= 0.01  # where a fit might have stopped
    short = problem.point(values, problem.predict(values)[0], bend.point.jacobian, bend.point.free)
    short = replace(bend, point=short, gain=short.log_evidence - null.log_evidence)
    assert curve.gain - short.gain > 5.0
    assert len(groups(problem, null, [curve, short])[0]) == 1
    ranked = fitted_alike(problem, null, [curve, short], by_id, 3.0)
    assert {c.effects for c in groups(problem, null, ranked)[0]} == {("curve",), ("bend",)}


@pytest.mark.parametrize(("apart", "behind", "together"), [(8.0, 2.0, True), (8.0, 4.0, False), (14.0, 2.0, False)])
def test_what_the_data_do_not_prefer_is_a_group_though_its_predictions_lie_a_little_apart(apart, behind, together):
    twin = Alike(13, curvature=3.0)
    problem = Problem(twin, ["one", "two"])
    null = problem.fit_null()
    by_id = {h.effect: h for h in twin.hypotheses}
    curve, bend = (problem.polish(null, c, by_id) for c in problem.screen(null, twin.hypotheses))
    wave = np.sin(25.0 * np.tile(twin.x, 2))
    wave *= np.sqrt(apart / problem.squared_distance(null, problem.whiten(wave)))
    prediction = curve.point.prediction + wave
    residual = problem.whiten(problem.observed - prediction)
    point = replace(bend.point, prediction=prediction, misfit=float(residual @ residual))
    rival = replace(bend, point=point, gain=curve.gain - behind)
    assert (len(groups(problem, null, [curve, rival])[0]) == 2) == together


def test_an_effect_that_ends_off_is_no_candidate_and_the_null_has_what_it_found(monkeypatch):
    twin = Lines(17)
    twin.parameters = [replace(p, amplitude=p.effect is not None) for p in twin.parameters]
    problem = Problem(twin, ["one", "two"])
    fitted = Problem.fit_null

    def stopped(self):
        done = fitted(self)
        values = done.values + np.array([0.2, 0.0, 0.0, 0.0])
        return self.point(values, self.predict(values)[0], done.jacobian, self.nuisances)

    def off(self, null, candidate, hypotheses):
        point = candidate.point
        values = np.array([*point.values[:2], 0.0, 0.0])
        best = self.descend(self.point(values, self.predict(values)[0], 0.0 * point.jacobian, point.free))
        return replace(candidate, point=best, gain=best.log_evidence - null.log_evidence, polished=True)

    monkeypatch.setattr(Problem, "fit_null", stopped)
    found = search(problem, twin.hypotheses, 3.0)
    true = np.square((problem.observed - fitted(problem).prediction) / twin.sigma).sum()
    assert found.null.misfit < true + 1.0
    monkeypatch.setattr(Problem, "polish", off)
    twin.data = Lines(17, curvature=1.0).data
    assert search(Problem(twin, ["one", "two"]), twin.hypotheses, 3.0).candidates == []


def test_an_effect_that_goes_off_in_the_very_last_fit_is_no_candidate_either(monkeypatch):
    def off_at_last(problem, null, candidates, by_id, averaged=None):
        if averaged is None:
            return null, candidates
        points = [replace(c.point, values=np.array([*c.point.values[:2], 0.0, 0.0])) for c in candidates]
        return null, [replace(c, point=p) for c, p in zip(candidates, points, strict=True)]

    twin = Lines(17, curvature=1.0)
    twin.parameters = [replace(p, amplitude=p.effect is not None) for p in twin.parameters]
    assert search(Problem(twin, ["one", "two"]), twin.hypotheses, 3.0).candidates
    monkeypatch.setattr("emafault.gap.conclude.null_again", off_at_last)
    assert search(Problem(twin, ["one", "two"]), twin.hypotheses, 3.0).candidates == []


class Scattering(Lines):
    """Every prediction but that of the null scatters by itself, as a switched simulation does."""

    def predict(self, values, part):
        out = super().predict(values, part)
        for row, v in zip(out, np.atleast_2d(values), strict=True):
            if np.any(v[2:] != 0.0):
                row += 0.7 * self.sigma * np.random.default_rng(5).standard_normal(len(row))
        return out

    def scatter(self, part):
        return np.full(len(part) * len(self.x), (0.7 * self.sigma) ** 2)


def test_the_scatter_of_a_start_is_no_misfit():
    twin = Scattering(19, step=0.3)
    twin.parameters = [replace(p, step=3.0) for p in twin.parameters]
    twin.hypotheses = [replace(h, starts=((4.0,),)) for h in twin.hypotheses]
    problem = Problem(twin, ["one", "two"])
    null = problem.fit_null()
    smooth = Problem(Lines(19, step=0.3), ["one", "two"])
    gains = [
        next(c.gain for c in p.screen(n, twin.hypotheses) if c.effects == ("step",))
        for p, n in ((problem, null), (smooth, smooth.fit_null()))
    ]
    assert gains[1] > 10.0 and abs(gains[0] - gains[1]) < 3.0

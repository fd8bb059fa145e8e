"""The identifier: intervals with measured coverage, wider where magnets lag, files, a unit's calibration, ONNX."""

import json
from dataclasses import replace

import numpy as np
import pytest

from emafault.errors import InputError
from emafault.faults import FAULT_NAMES, sample_faults
from emafault.identification import evaluation, fitting
from emafault.identification.export import export_onnx
from emafault.identification.fitting import HeldOut, Prior, Recipe, fit_identifier
from emafault.identification.identifier import Identifier
from emafault.identification.intervals import ConformalIntervals, coverage, worse_than_folds
from emafault.identification.posterior import Knowledge, nine_forward, nominal_nine
from emafault.identification.rows import TrainingRows
from emafault.reconstruction.features import Features

from .conftest import NOISE, RANGES

#: estimator -> what makes it
RECIPES = {"network": Recipe({"coordinates": "log", "width": 8}, {"reweight": 1, "epochs": 60}), "closed_form": None}


def rows_of(data, features=None, covariance=True):
    """What is learnt from a set, with other features or without its covariance."""
    return TrainingRows(
        data.features if features is None else features, data.faults, data.covariance if covariance else None
    )


@pytest.fixture(scope="module")
def fitted(training, actuator):
    return {name: fit_identifier(rows_of(training), Prior(actuator), recipe) for name, recipe in RECIPES.items()}


@pytest.mark.parametrize("estimator", ["network", "closed_form"])
def test_coverage_is_the_level(fitted, fresh, estimator):
    identifier = fitted[estimator].identifier
    for level in (0.5, 0.9):
        low, high = identifier.interval(fresh.features, level, fresh.covariance)
        share = coverage(low, high, fresh.faults)
        assert abs(share["mean"] - level) < 0.03
        assert all(abs(share[name] - level) < 0.06 for name in FAULT_NAMES)


def test_split_and_plain_intervals_cover_too(training, fresh, actuator):
    rows = rows_of(training, covariance=False)
    fit = fit_identifier(rows, Prior(actuator), RECIPES["network"], HeldOut("split"))
    share = coverage(*fit.identifier.interval(fresh.features, 0.9), fresh.faults)
    assert abs(share["mean"] - 0.9) < 0.06  # 90 calibration rows


def test_a_noisier_record_gets_wider_intervals_that_still_cover(fitted, make_set):
    noisy = make_set(1000, 7, noise=3.0)
    for fit in fitted.values():
        low, high = fit.identifier.interval(noisy.features, 0.9, noisy.covariance)
        assert abs(coverage(low, high, noisy.faults)["mean"] - 0.9) < 0.05
        blind = coverage(*fit.identifier.interval(noisy.features, 0.9), noisy.faults)
        assert blind["mean"] < 0.6  # without the covariance they cannot know


@pytest.mark.parametrize("estimator", ["network", "closed_form"])
def test_lagging_magnets_widen_the_intervals(make_set, actuator, estimator):
    widths = {}
    for lag in (0.0, 40.0):
        known, new = make_set(600, 11, alpha_m=-4e-4, lag=lag), make_set(1000, 12, alpha_m=-4e-4, lag=lag)
        fit = fit_identifier(rows_of(known), Prior(actuator, -4e-4), RECIPES[estimator])
        low, high = fit.identifier.interval(new.features, 0.9, new.covariance)
        assert abs(coverage(low, high, new.faults)["mean"] - 0.9) < 0.04
        widths[lag] = (high - low).mean(axis=0)
    assert widths[40.0][5] > 1.5 * widths[0.0][5]
    assert np.all(widths[40.0][:3] > 1.5 * widths[0.0][:3])


def test_conformal_rank_and_refusals():
    residuals = np.arange(1.0, 20.0)[:, None] * np.ones(6)  # 19 rows: 90 % takes the 18th
    intervals = ConformalIntervals.calibrate(residuals, None, "by hand")
    np.testing.assert_allclose(intervals.half_width(0.9, None, 2), 18.0)
    np.testing.assert_allclose(intervals.half_width(0.5, None, 2), 10.0)
    with pytest.raises(InputError, match="level"):
        intervals.half_width(0.99, None, 1)
    with pytest.raises(InputError, match="calibration rows"):
        ConformalIntervals.calibrate(residuals[:5], None, "")


def test_a_network_that_ended_in_a_worse_optimum_is_trained_from_another_start(make_set, actuator, monkeypatch):
    known, new = rows_of(make_set(400, 1)), make_set(800, 2)
    given, seeds = fitting.train, []

    def train(features, faults, network, training, seed, rows):
        """The first start of the whole has not left its beginning."""
        seeds.append(seed)
        return given(features, faults, network, {**training, "epochs": 2} if seed == 7 else training, seed, rows)

    monkeypatch.setattr(fitting, "train", train)
    fit = fit_identifier(known, Prior(actuator), replace(RECIPES["network"], seed=7))
    assert sorted(seeds) == [7, *(7 + 1000 * start for start in range(1, 7))]  # folds, and one more start
    assert len(fit.trained.curves[0].train) > 5
    error = np.abs(fit.identifier.predict(new.features) - new.faults).mean(axis=0)
    assert error[5] < 0.6 and error[0] < 2e-3
    monkeypatch.setattr(fitting, "STARTS", 1)
    stuck = fit_identifier(known, Prior(actuator), replace(RECIPES["network"], seed=7)).identifier
    width = [np.ptp(i.interval(new.features, 0.9, new.covariance), axis=0) for i in (fit.identifier, stuck)]
    assert np.all(width[1][:, 5] > 2.0 * width[0][:, 5])
    assert np.abs(stuck.predict(new.features) - new.faults).mean(axis=0)[5] > 3.0 * error[5]


def test_intervals_are_as_wide_as_a_network_that_is_worse_than_its_folds():
    rng = np.random.default_rng(4)
    folds, own, new = rng.normal(size=(600, 6)), rng.normal(size=(90, 6)), rng.normal(size=(4000, 6))
    off = np.array([1.0, 1.0, 1.0, 1.0, 1.0, 1.5])  # of the network's errors over those of its folds
    plain = ConformalIntervals.calibrate(folds, None, "cross")
    told = plain.widened(worse_than_folds(own * off, folds))
    inside = np.mean(np.abs(new * off) <= told.half_width(0.9, None, 1), axis=0)
    assert np.all(np.abs(inside - 0.9) < 0.04)
    assert np.mean(np.abs(new * off) <= plain.half_width(0.9, None, 1), axis=0)[5] < 0.77
    assert np.array_equal(told.scores[:, :5], plain.scores[:, :5])  # what differs by chance stays
    every = worse_than_folds(own * 1.2, folds)  # each by hardly more than chance, all of them by far more
    assert np.all(every > 1.0) and np.prod(every) ** (1.0 / 6.0) == pytest.approx(1.2, rel=0.08)
    alone = worse_than_folds(own * np.array([1.2, 1.0, 1.0, 1.0, 1.0, 1.0]), folds)
    assert np.all(alone == 1.0)


@pytest.mark.parametrize("estimator", ["network", "closed_form"])
def test_saved_and_loaded_gives_the_same_numbers(fitted, fresh, tmp_path, estimator):
    identifier = fitted[estimator].identifier
    identifier.save(tmp_path / "model")
    loaded = Identifier.load(tmp_path / "model")
    assert loaded.estimator == estimator
    f, c = fresh.features[:20], fresh.covariance[:20]
    assert np.array_equal(loaded.predict(f), identifier.predict(f))
    for a, b in zip(loaded.interval(f, 0.9, c), identifier.interval(f, 0.9, c)):
        assert np.array_equal(a, b)
    entry = loaded.estimate(f, 0.9, c)[3]
    assert list(entry) == list(FAULT_NAMES)
    assert all(e["low"] < e["value"] < e["high"] for e in entry.values())
    json.dumps(entry)
    assert [p.name for p in (tmp_path / "model").iterdir()] == ["identifier.json"]


def test_broken_or_missing_files_are_refused_in_one_line(fitted, tmp_path):
    with pytest.raises(InputError, match=r"identifier\.json: no such file"):
        Identifier.load(tmp_path)
    fitted["closed_form"].identifier.save(tmp_path)
    text = (tmp_path / "identifier.json").read_text()
    (tmp_path / "identifier.json").write_text(text[: len(text) // 2])
    with pytest.raises(InputError, match="not JSON"):
        Identifier.load(tmp_path)


def test_wrong_number_of_features_is_refused(fitted):
    with pytest.raises(InputError, match="accepts 6"):
        fitted["network"].identifier.predict(np.ones((2, 8)))


def test_features_far_from_those_learnt_are_told(fitted, fresh):
    identifier = fitted["network"].identifier
    assert np.median(identifier.outside(fresh.features)) == 0.0
    assert identifier.outside(1.3 * fresh.features).min() > 0.05


def test_calibration_undoes_a_units_tolerance(fitted, fresh, actuator, width):
    scale = np.repeat([1.01, 0.995], 3)
    unit = nominal_nine(actuator)[:6] * scale
    off = evaluation.FeatureSet(
        fresh.features * scale, fresh.faults, fresh.covariance * np.outer(scale, scale), fresh.bound
    )
    for fit in fitted.values():
        nominal = evaluation.evaluate(fit.identifier, off, width)
        calibrated = evaluation.evaluate(fit.identifier, off, width, unit=unit)
        straight = evaluation.evaluate(fit.identifier, fresh, width)
        assert calibrated["errors"]["dT"]["mae"] == pytest.approx(straight["errors"]["dT"]["mae"], rel=1e-6)
        assert calibrated["coverage"]["mean"] == pytest.approx(straight["coverage"]["mean"], abs=1e-9)
        assert nominal["errors"]["dT"]["mae"] > 2.5


def test_intervals_know_that_a_reference_record_is_noisy_too(fitted, fresh, actuator, width):
    healthy = nominal_nine(actuator)[:6]
    covariance = np.kron(NOISE, np.eye(3)) * np.outer(healthy, healthy)
    rng = np.random.default_rng(8)
    unit = rng.multivariate_normal(healthy, covariance, len(fresh.faults))
    for fit in fitted.values():
        told = evaluation.evaluate(fit.identifier, fresh, width, 0.9, unit, covariance)
        untold = evaluation.evaluate(fit.identifier, fresh, width, 0.9, unit)
        assert abs(told["coverage"]["mean"] - 0.9) < 0.03
        assert untold["coverage"]["mean"] < 0.8


def test_intervals_hold_for_units_that_differ_with_and_without_a_healthy_record(make_set, actuator):
    known = Knowledge(R=0.01, k=0.005)
    nominal = nominal_nine(actuator)

    def spread(data, seed):
        own = 1.0 + np.random.default_rng(seed).normal(size=(len(data.faults), 2)) * [known.R, known.k]
        scale = np.repeat(own, 3, axis=1)
        covariance = data.covariance * scale[:, :, None] * scale[:, None, :]
        return evaluation.FeatureSet(data.features * scale, data.faults, covariance), scale

    (taught, scale), (new, own) = spread(make_set(600, 1), 31), spread(make_set(1000, 2), 32)
    units = nominal * np.column_stack([scale, np.ones((600, 3))])
    noise = np.kron(NOISE, np.eye(3)) * np.outer(nominal[:6], nominal[:6])
    measured = nominal[:6] * own + np.random.default_rng(33).multivariate_normal(np.zeros(6), noise, 1000)
    errors = {}
    for name, recipe in RECIPES.items():
        fit = fit_identifier(replace(rows_of(taught), units=units), Prior(actuator, known=known), recipe)
        widths = []
        for unit in ((None, None), (measured, noise)):
            low, high = fit.identifier.interval(new.features, 0.9, new.covariance, *unit)
            share = coverage(low, high, new.faults)
            assert abs(share["mean"] - 0.9) < 0.03 and all(abs(share[c] - 0.9) < 0.06 for c in FAULT_NAMES), name
            widths.append(np.mean(high - low, axis=0)[5])
        assert widths[1] < 0.5 * widths[0]
        errors[name] = np.mean(np.abs(fit.identifier.predict(new.features, new.covariance, measured) - new.faults), 0)
    # what its units differed by, which no six features tell, is not left in what a network learns
    assert np.all(errors["network"] < 1.12 * errors["closed_form"])


def test_a_reconstruction_without_covariance_tells_the_noise_of_a_healthy_record_by_the_rows_learnt_from(
    fresh, training, actuator
):
    healthy = nominal_nine(actuator)[:6]
    fit = fit_identifier(rows_of(training, covariance=False), Prior(actuator), RECIPES["network"])
    np.testing.assert_allclose(np.diagonal(fit.identifier.noise), np.repeat(np.diagonal(NOISE), 3), rtol=0.25)
    unknown = np.full((1, 6, 6), np.nan)
    phases = np.full((1, 3), np.nan)
    told = fit.identifier.with_noise(Features(healthy[None, :3], healthy[None, 3:], phases, phases, unknown))
    rng = np.random.default_rng(8)
    covariance = np.kron(NOISE, np.eye(3)) * np.outer(healthy, healthy)
    unit = rng.multivariate_normal(healthy, covariance, len(fresh.faults))
    low, high = fit.identifier.interval(fresh.features, 0.9, None, unit, told.covariance[0])
    assert abs(coverage(low, high, fresh.faults)["mean"] - 0.9) < 0.03
    known = Features(healthy[None, :3], healthy[None, 3:], phases, phases, covariance[None])
    assert fit.identifier.with_noise(known) is known


def test_eight_features_of_an_angle_resolved_reconstruction(actuator, width):
    from emafault import closed_form
    from emafault.faults import sample_faults

    from .conftest import RANGES

    sets = []
    for runs, seed in ((400, 1), (500, 2)):
        faults = sample_faults(runs, seed=seed, **RANGES)
        rng = np.random.default_rng(seed)
        R, k = closed_form.forward(faults, actuator, eccentricity_law="rotor_angle")
        relative = np.repeat([2e-3, 5e-4], 3)
        six = np.hstack([R, k]) * (1 + relative * rng.normal(size=(runs, 6)))
        covariance = np.diag(relative**2) * six[:, :, None] * six[:, None, :]
        xi = faults[:, 3:5] + 1e-3 * rng.normal(size=(runs, 2))
        sets.append(evaluation.FeatureSet(np.hstack([six, xi]), faults, covariance))
    for recipe in RECIPES.values():
        fit = fit_identifier(rows_of(sets[0]), Prior(actuator), recipe)
        result = evaluation.evaluate(fit.identifier, sets[1], width)
        assert result["errors"]["xi"]["mae"] < 1.1e-3
        assert result["errors"]["N"]["mae"] < 1e-3
        assert abs(result["coverage"]["mean"] - 0.9) < 0.05


def test_onnx_takes_si_and_equals_torch_and_the_network(fitted, fresh, tmp_path):
    path = tmp_path / "network.onnx"
    identifier = fitted["network"].identifier
    network = identifier.network
    difference = export_onnx(identifier, path, fresh.features[:50])
    assert difference["against_torch"] < 1e-5
    assert difference["against_float64"] < 1e-4
    import onnxruntime

    session = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    (got,) = session.run(None, {"features": fresh.features[:3].astype(np.float32)})  # another number of rows
    np.testing.assert_allclose(got[:, 5], network.predict(fresh.features[:3])[:, 5], atol=0.01)


def test_a_biased_reconstruction_is_calibrated_against_its_own_healthy_point(fresh, training, actuator, width):
    bias = np.array([1.06, 1.06, 1.06, 0.9, 0.9, 0.9])
    biased = rows_of(training, training.features * bias, covariance=False)
    fit = fit_identifier(biased, Prior(actuator), RECIPES["network"], HeldOut("split"))
    unit = nominal_nine(actuator)[:6] * np.repeat([1.01, 0.995], 3)
    off = evaluation.FeatureSet(fresh.features * bias * np.repeat([1.01, 0.995], 3), fresh.faults)
    straight = evaluation.evaluate(fit.identifier, evaluation.FeatureSet(fresh.features * bias, fresh.faults), width)
    calibrated = evaluation.evaluate(fit.identifier, off, width, unit=unit * bias)
    assert calibrated["errors"]["dT"]["mae"] < 1.1 * straight["errors"]["dT"]["mae"]


def test_a_bias_that_a_healthy_record_takes_out_is_not_in_its_intervals(fresh, training, actuator, tmp_path):
    bias = np.array([1.3, 1.3, 1.3, 0.9, 0.9, 0.9])  # 75 K of dT
    fit = fit_identifier(rows_of(training, training.features * bias, covariance=False), Prior(actuator))
    fit.identifier.save(tmp_path)
    identifier = Identifier.load(tmp_path)
    unit = nominal_nine(actuator)[:6] * np.repeat([1.01, 0.995], 3)
    of_unit = fresh.features * bias * np.repeat([1.01, 0.995], 3)
    shown = {"without": (fresh.features * bias, None), "with": (of_unit, unit * bias)}
    widths = {}
    for name, (features, own) in shown.items():
        low, high = identifier.interval(features, 0.9, None, own)
        widths[name] = np.mean(high - low, axis=0)[5]
        assert abs(coverage(low, high, fresh.faults)["mean"] - 0.9) < 0.03, name
    assert widths["without"] > 100.0 and widths["with"] < 10.0


@pytest.mark.parametrize("estimator", RECIPES)
def test_a_bias_that_changes_with_the_fault_is_that_of_a_healthy_record_at_the_healthy_point(
    fresh, training, actuator, estimator
):
    healthy, nominal = np.repeat([1.1, 0.9], 3), nominal_nine(actuator)[:6]

    def biased(data):
        turns, along = data.faults[:, :3], 0.2 * data.faults[:, 3:4]
        return data.features * (healthy + np.concatenate([1.5 * turns, along - turns], axis=1))

    rows = rows_of(training, biased(training), covariance=False)
    identifier = fit_identifier(rows, Prior(actuator), RECIPES[estimator]).identifier
    np.testing.assert_allclose(np.diagonal(identifier.noise), np.repeat(np.diagonal(NOISE), 3), rtol=0.3)
    if estimator == "network":  # the mean over all faults is 1.175 and 0.85
        np.testing.assert_allclose(identifier.nominal_unit(6) / nominal, healthy, rtol=2e-3)
    scale = np.repeat([1.01, 0.995], 3)
    measured = nominal * healthy * scale
    spread = np.kron(NOISE, np.eye(3)) * measured[:, None] * measured
    units = np.random.default_rng(8).multivariate_normal(measured, spread, len(fresh.faults))
    told = identifier.noise * measured[:, None] * measured
    low, high = identifier.interval(biased(fresh) * scale, 0.9, None, units, told)
    assert abs(coverage(low, high, fresh.faults)["mean"] - 0.9) < 0.03


def test_a_network_of_nine_features_weighs_them_as_a_healthy_record_leaves_the_unit_known(actuator, tmp_path):
    known, nominal = Knowledge(R=0.01, k=0.005, L=0.03), nominal_nine(actuator)
    relative = np.kron(np.diag([2e-3, 1e-3, 5e-4]) ** 2, np.eye(3))

    def drawn(runs, seed):
        rng = np.random.default_rng(seed)
        faults = sample_faults(runs, seed=seed, **RANGES)
        own = np.repeat(1.0 + rng.normal(size=(runs, 3)) * [known.R, known.k, known.L], 3, axis=1)
        noise = rng.multivariate_normal(np.zeros(9), relative, runs)
        nine = nine_forward(faults, actuator) * own * (1.0 + noise)
        return nine, faults, relative * nine[:, :, None] * nine[:, None, :], own

    features, faults, covariance, own = drawn(600, 1)
    new, truth, noise, units = drawn(1000, 2)
    measured = nominal * units * (1.0 + np.random.default_rng(3).multivariate_normal(np.zeros(9), relative, 1000))
    spread = relative * nominal[:, None] * nominal
    errors = {}
    recipe = Recipe({"coordinates": "log", "width": 8}, {"reweight": 1, "epochs": 200})
    rows = TrainingRows(features, faults, covariance, nominal * own)
    for name, by in {"network": recipe, "closed_form": None}.items():
        fit = fit_identifier(rows, Prior(actuator, known=known), by)
        fit.identifier.save(tmp_path / name)
        loaded = Identifier.load(tmp_path / name)
        for unit in ((None, None), (measured, spread)):
            low, high = loaded.interval(new, 0.9, noise, *unit)
            assert abs(coverage(low, high, truth)["mean"] - 0.9) < 0.03, (name, unit[0] is None)
        errors[name] = np.mean(np.abs(loaded.predict(new, noise, measured, spread) - truth), axis=0)
    assert np.all(errors["network"] < 1.12 * errors["closed_form"])  # with one network for both 5 times in N

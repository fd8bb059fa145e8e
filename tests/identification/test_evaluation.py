"""Evaluation: metrics by hand, leaks flagged, seeds summarised."""

import numpy as np
import pytest

from emafault.errors import InputError
from emafault.identification import evaluation
from emafault.identification.fitting import HeldOut, Prior, Recipe, fit_identifier
from emafault.identification.rows import TrainingRows


def test_metrics_by_hand(width):
    truth = np.zeros((4, 6))
    estimate = truth.copy()
    estimate[:, 0] = [0.01, -0.01, 0.02, 0.0]
    estimate[:, 5] = [1.2, -1.2, 1.2, -1.2]
    result = evaluation.errors(estimate, truth, width)
    assert result["Na"]["mae"] == pytest.approx(0.01)
    assert result["Na"]["over_range"] == pytest.approx(0.1)
    assert result["Na"]["bias"] == pytest.approx(0.005)
    assert result["N"]["mae"] == pytest.approx(0.01 / 3)
    assert result["dT"]["over_range"] == pytest.approx(0.01)
    assert result["dT"]["worst"] == pytest.approx(1.2)
    assert result["mean"]["over_range"] == pytest.approx((0.1 + 0.01) / 6)


def test_an_estimator_at_the_bound_has_ratio_one_and_one_below_is_a_leak(width):
    rng = np.random.default_rng(0)
    truth = np.zeros((1000, 6))
    sigma = np.array([1e-3] * 3 + [2e-3] * 2 + [0.4])
    noise = rng.normal(size=truth.shape) * sigma
    at = evaluation.errors(noise, truth, width, sigma)
    assert at["dT"]["ratio"] == pytest.approx(1.0, abs=0.08)
    assert evaluation.leaks(at) == []
    noise[:, 5] *= 0.8  # as if the ambient temperature had been used
    assert evaluation.leaks(evaluation.errors(noise, truth, width, sigma)) == ["dT"]


def test_over_seeds(make_set, actuator, width):
    known, new = make_set(120, 1), make_set(200, 2)
    results = []
    for seed in range(3):
        rows = TrainingRows(known.features, known.faults)
        fit = fit_identifier(rows, Prior(actuator), Recipe(seed=seed), HeldOut(folds=2))
        results.append(evaluation.evaluate(fit.identifier, new.rows(slice(10, 60)), width))
    summary = evaluation.over_seeds(results)
    errors = [result["errors"]["dT"]["mae"] for result in results]
    assert summary["errors.dT.mae"]["mean"] == pytest.approx(np.mean(errors))
    assert summary["errors.dT.mae"]["low"] == min(errors) < max(errors) == summary["errors.dT.mae"]["high"]
    assert summary["rows"]["mean"] == 50 and summary["errors.dT.ratio"]["low"] > 0.5


def test_runs_without_features_are_left_out_and_counted(make_set, actuator, width):
    known, new = make_set(60, 1), make_set(50, 2)
    known.features[4], new.features[[3, 7]] = np.nan, np.nan
    fit = fit_identifier(TrainingRows(known.features, known.faults), Prior(actuator))
    result = evaluation.evaluate(fit.identifier, new, width)
    assert (result["rows"], result["unidentified"]) == (48, 2)
    new.features[:] = np.nan
    with pytest.raises(InputError, match="no run has features"):
        evaluation.evaluate(fit.identifier, new, width)

"""Rows in files: what is learnt of them is what is learnt in memory, and little of them is in memory."""

import tracemalloc

import numpy as np
import pytest

from emafault.errors import InputError
from emafault.identification import rows as rows_module
from emafault.identification.fitting import HeldOut, Prior, Recipe, fit_identifier
from emafault.identification.network import Scaler
from emafault.identification.posterior import Knowledge
from emafault.identification.rows import Stored, TrainingRows, at_most, store

RECIPES = {
    "closed_form": None,
    "levenberg_marquardt": Recipe({"coordinates": "log", "width": 4}, {"epochs": 8, "reweight": 1}),
    "adam": Recipe({"width": 4}, {"optimiser": "adam", "epochs": 2}),
}


@pytest.fixture
def small_blocks(monkeypatch):
    monkeypatch.setattr(rows_module, "BLOCK", 70)


def some_rows(training, gaps=0):
    known = np.all(np.isfinite(training.features), axis=1)
    features = training.features[known].copy()
    features[:gaps, 2] = np.nan
    return TrainingRows(features, training.faults[known], training.covariance[known])


def pieces(rows, size):
    return [rows.rows(slice(n, n + size)) for n in range(0, len(rows.features), size)]


def test_stored_rows_are_the_rows(training, tmp_path):
    rows = some_rows(training)
    stored = store(tmp_path, pieces(rows, 45))
    assert isinstance(stored.features, Stored) and stored.units is None
    for name in ("features", "faults", "covariance"):
        table, whole = getattr(stored, name), getattr(rows, name)
        assert table.shape == whole.shape
        np.testing.assert_array_equal(table[:], whole)
        np.testing.assert_array_equal(table[np.array([3, 50, 51])], whole[[3, 50, 51]])
    low, high = stored.extremes()
    np.testing.assert_array_equal([low, high], [rows.features.min(axis=0), rows.features.max(axis=0)])


@pytest.mark.parametrize("kind", RECIPES)
def test_an_identifier_of_stored_rows_is_that_of_rows_in_memory(kind, training, actuator, tmp_path, small_blocks):
    rows = some_rows(training, gaps=3)
    stored = store(tmp_path, pieces(rows, 64))
    found = [fit_identifier(r, Prior(actuator), RECIPES[kind], HeldOut(folds=2)).identifier for r in (rows, stored)]
    x, covariance = rows.features[3:20], rows.covariance[3:20]
    np.testing.assert_array_equal(found[0].predict(x, covariance), found[1].predict(x, covariance))
    np.testing.assert_array_equal(found[0].interval(x, 0.9, covariance), found[1].interval(x, 0.9, covariance))


def test_units_are_taken_out_of_stored_rows(training, actuator, tmp_path, small_blocks):
    rows = some_rows(training)
    units = np.random.default_rng(0).normal(1.0, 0.01, (len(rows.features), 9))
    rows = TrainingRows(rows.features, rows.faults, rows.covariance, units)
    alike, stored = (r.of_nominal(actuator) for r in (rows, store(tmp_path, pieces(rows, 64))))
    np.testing.assert_array_equal(alike.features, stored.features[:])
    np.testing.assert_array_equal(alike.covariance, stored.covariance[:])
    assert not np.allclose(alike.features, rows.features)


def test_blocks_give_the_scaler_of_all_rows(training):
    rows = some_rows(training)
    whole = Scaler.fit("log", [(rows.features, rows.faults)])
    z = np.log(rows.features)
    np.testing.assert_allclose(whole.feature_mean, z.mean(axis=0))
    np.testing.assert_allclose(whole.feature_scale, z.std(axis=0))
    blocks = [(b.features, b.faults) for b in pieces(rows, 31)]
    for name in ("feature_mean", "feature_scale", "fault_mean", "fault_scale"):
        np.testing.assert_allclose(getattr(Scaler.fit("log", blocks), name), getattr(whole, name), rtol=1e-12)


def test_intervals_are_calibrated_on_some_of_many_rows(training, actuator, monkeypatch):
    rows = some_rows(training)
    assert len(rows.features) > 200
    monkeypatch.setattr(rows_module, "MOST_AT_ONCE", 100)
    assert len(rows.some().features) == 100
    few = at_most(np.arange(50, 350), 3)
    assert len(set(few)) == 100 and np.all(np.diff(few) > 0) and few[0] >= 50 and few[-1] < 350
    fit = fit_identifier(rows, Prior(actuator), RECIPES["levenberg_marquardt"], HeldOut("split"))
    assert len(fit.identifier.intervals.scores) <= 100
    with pytest.raises(InputError, match="9 runs have features, at least 10"):
        rows.rows(slice(9)).identified()


@pytest.mark.parametrize("kind", ["closed_form", "levenberg_marquardt"])
def test_memory_is_that_of_some_rows(kind, tmp_path, actuator, monkeypatch):
    """Nine features of units that differ, which have by far the largest tables."""
    monkeypatch.setattr(rows_module, "MOST_AT_ONCE", 500)
    monkeypatch.setattr(rows_module, "BLOCK", 250)
    rng = np.random.default_rng(5)
    knowledge = Knowledge(0.01, 0.005, 0.03)
    nominal = np.repeat([actuator.resistance, actuator.back_emf, actuator.inductance], 3)

    def block(_):
        units = nominal * (1.0 + 0.01 * rng.normal(size=(250, 9)))
        faults = np.concatenate([rng.uniform(0, 0.1, (250, 3)), rng.uniform(-0.1, 0.1, (250, 3))], axis=1)
        features = units * (1.0 - np.concatenate([faults[:, :3]] * 3, axis=1))
        covariance = (1e-3 * nominal) ** 2 * np.eye(9)
        return TrainingRows(features, faults, np.broadcast_to(covariance, (250, 9, 9)), units)

    recipe = None if kind == "closed_form" else Recipe({"width": 3}, {"epochs": 2})
    peaks = []
    for blocks in (8, 32):
        folder = tmp_path / str(blocks)
        folder.mkdir()
        stored = store(folder, map(block, range(blocks)))
        tracemalloc.start()
        fit_identifier(stored, Prior(actuator, known=knowledge), recipe, HeldOut(folds=2))
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    more = 250 * (32 - 8)  # runs, whose tables are 105 numbers each
    assert peaks[1] - peaks[0] < 60.0 * more < 0.1 * 8.0 * 105.0 * more

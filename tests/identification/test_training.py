"""Training: reproducible, near the bound, permutation of phases, refusal of what cannot be used."""

import numpy as np
import pytest

from emafault.errors import InputError
from emafault.identification import evaluation
from emafault.identification.settings import NetworkSettings, TrainingSettings
from emafault.identification.training import split_rows, train

GOOD = {"coordinates": "log", "width": 8}, {"reweight": 2}


def test_the_papers_network_has_its_shape_and_split():
    assert NetworkSettings().sizes() == (6, 12, 6)
    assert NetworkSettings().parameters() == 162
    parts = split_rows(600, TrainingSettings(), 0)
    assert [len(part) for part in parts] == [420, 90, 90]
    assert np.array_equal(np.sort(np.concatenate(parts)), np.arange(600))


def test_same_seed_same_weights_other_seed_other_weights(training):
    a, b, c = (train(training.features, training.faults, seed=seed) for seed in (4, 4, 5))
    assert all(np.array_equal(x, y) for x, y in zip(a.network.weights, b.network.weights))
    assert not np.array_equal(a.network.weights[0], c.network.weights[0])
    assert a.network.parameters == 162


@pytest.mark.parametrize(("settings", "limit"), [(({}, {}), 1.6), (GOOD, 1.12)])
def test_error_beside_the_bound(training, fresh, width, settings, limit):
    model = train(training.features, training.faults, *settings, seed=0)
    result = evaluation.errors(model.network.predict(fresh.features), fresh.faults, width, fresh.bound)
    assert max(result[name]["ratio"] for name in ("N", "xi", "dT")) < limit
    assert not evaluation.leaks(result)


def test_adam_trains_the_same_network(training, fresh, width):
    how = {"optimiser": "adam", "epochs": 15}
    runs = [train(training.features, training.faults, {"coordinates": "log"}, how, seed=1) for _ in range(2)]
    assert all(np.array_equal(x, y) for x, y in zip(runs[0].network.weights, runs[1].network.weights))
    result = evaluation.errors(runs[0].network.predict(fresh.features), fresh.faults, width)
    assert result["mean"]["over_range"] < 0.03
    assert runs[0].curves[0].train[-1] < 0.05 * runs[0].curves[0].train[0]


def test_permuted_phases_give_permuted_faults(training, fresh):
    model = train(training.features, training.faults, *GOOD, seed=0)
    order = np.array([1, 2, 0])
    turned = model.network.predict(fresh.features[:, [*order, *(order + 3)]])
    straight = model.network.predict(fresh.features)
    assert np.abs(turned[:, :3] - straight[:, order]).mean() < 1e-3
    assert np.abs(turned[:, 5] - straight[:, 5]).mean() < 0.4


@pytest.mark.parametrize(
    ("network", "training_settings", "words"),
    [
        ({"widht": 3}, {}, "network.widht"),
        ({"width": 0}, {}, "network.width"),
        ({"width": 2.5}, {}, "whole number"),
        ({"activation": "step"}, {}, "tanh"),
        ({}, {"train_fraction": 1.2}, "training.train_fraction"),
        ({}, {"optimiser": "sgd"}, "levenberg_marquardt, adam"),
    ],
)
def test_impossible_settings_are_refused_by_name(training, network, training_settings, words):
    with pytest.raises(InputError, match=words):
        train(training.features, training.faults, network, training_settings)


def test_features_that_cannot_be_are_refused(training):
    broken = training.features.copy()
    broken[3, 2] = np.nan
    with pytest.raises(InputError, match="run 3"):
        train(broken, training.faults)
    broken[3, 2] = -1.0
    with pytest.raises(InputError, match="R_c"):
        train(broken, training.faults, {"coordinates": "log"})

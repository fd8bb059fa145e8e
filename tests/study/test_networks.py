"""Networks of a study: what is chosen rests on what the workers have written, and seeds may be trained one by one."""

import json

import numpy as np
import pytest

from emafault import closed_form, config
from emafault.errors import InputError
from emafault.faults import sample_faults
from emafault.reconstruction.features import Features
from emafault.study import networks
from emafault.study.features import FeatureTable, write_features
from emafault.study.networks import choose_network, join_seeds, train_identifier

SPEC = {"search": {"trials": 3, "tolerance": 0.05}}


def trial(number, error, parameters, width=4):
    return {
        "number": number,
        "error": error,
        "parameters": parameters,
        "network": {"width": width},
        "training": {"epochs": 9},
        "seconds": 1.0,
    }


def written(folder, *lists):
    paths = []
    for worker, trials in enumerate(lists):
        paths.append(str(folder / f"worker_{worker}.json"))
        (folder / f"worker_{worker}.json").write_text(json.dumps({"worker": worker, "ran": 1, "trials": trials}))
    return paths


def test_trials_of_all_workers_are_joined_ranked_and_cut_to_the_asked_number(tmp_path):
    every = [trial(0, 0.030, 50), trial(2, 0.020, 90), trial(3, 0.0205, 60), trial(5, 0.001, 10)]
    # each ended before the other's last trial did
    workers = written(tmp_path, every[:3], [every[0], every[2], every[3]])
    choose_network(workers, SPEC, tmp_path / "trials.json", tmp_path / "chosen.json")
    found = json.loads((tmp_path / "trials.json").read_text())
    assert [(t["number"], t["pareto"]) for t in found] == [(0, True), (2, True), (3, True)]
    assert json.loads((tmp_path / "chosen.json").read_text())["number"] == 3  # within 5 % of the best, and smaller


def test_workers_that_searched_apart_are_refused(tmp_path):
    workers = written(tmp_path, [trial(0, 0.03, 50)], [trial(0, 0.04, 70, width=6)])
    with pytest.raises(InputError, match=r"search\.storage: the workers of this search share none .*worker_1\.json"):
        choose_network(workers, SPEC, tmp_path / "trials.json", tmp_path / "chosen.json")


@pytest.mark.parametrize("content", ["{", "[]", '{"trials": [{"number": 1}]}', '{"trials": 5}', '{"trials": [5]}'])
def test_what_no_worker_has_written_is_refused_by_name(tmp_path, content):
    path = tmp_path / "worker_0.json"
    path.write_text(content)
    with pytest.raises(InputError, match=r"worker_0\.json"):
        choose_network([str(path)], SPEC, tmp_path / "trials.json", tmp_path / "chosen.json")


@pytest.fixture(scope="module")
def features(tmp_path_factory):
    """A table of 90 runs, two of which gave no features."""
    actuator = config.reference_actuator()
    faults = sample_faults(90, shorted_turns=(0.0, 0.1), eccentricity=(0.0, 0.2), temperature=(-50.0, 70.0), seed=3)
    R, k = closed_form.forward(faults, actuator, 0.0, faults[:, 5])
    R[[4, 60]] = np.nan
    six = np.concatenate([R, k], axis=1)
    covariance = (1e-3 * six[:, :, None]) * (1e-3 * six[:, None, :]) * np.eye(6)
    table = FeatureTable(Features(R, k, 0.0 * R, 0.0 * R, covariance), faults, np.full(90, 20.0))
    path = tmp_path_factory.mktemp("features") / "training_weighted.nc"
    write_features(path, [table], 90)
    return str(path)


@pytest.fixture(scope="module")
def spec():
    composed = config.compose("smoke", ["network.width=3", "training.epochs=5", "evaluation.seeds=3"])
    return config.network_spec(composed, "network")


def files(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_seeds_trained_one_by_one_are_those_trained_together(features, spec, tmp_path):
    train_identifier("network", features, spec, tmp_path / "together" / "history.json")
    apart = [str(tmp_path / f"network.{seed}") for seed in range(3)]
    for seed, folder in enumerate(apart):
        train_identifier("network", features, spec, f"{folder}/history.json", seed=seed)
    join_seeds(apart, tmp_path / "joined" / "history.json")
    together, joined = files(tmp_path / "together"), files(tmp_path / "joined")
    assert len(together) == 4 and together == joined
    assert json.loads(together["history.json"])["rows"] == 88


def test_many_runs_are_learnt_from_files(features, spec, tmp_path, monkeypatch):
    train_identifier("network", features, {**spec, "seeds": 1}, tmp_path / "in_memory" / "history.json")
    calls = []
    given = networks.store
    monkeypatch.setattr(networks, "store", lambda *args: calls.append(1) or given(*args))
    monkeypatch.setattr(networks, "MOST_AT_ONCE", 89)
    train_identifier("network", features, {**spec, "seeds": 1}, tmp_path / "in_files" / "history.json")
    assert calls and files(tmp_path / "in_memory") == files(tmp_path / "in_files")

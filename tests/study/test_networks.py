"""The choice of a network rests on what the workers of a search have written, not on where they kept it."""

import json

import pytest

from emafault.errors import InputError
from emafault.study.networks import choose_network

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

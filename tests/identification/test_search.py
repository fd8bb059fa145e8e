"""The search: resumable after a kill, several workers on one file, seeded, front and choice."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from optuna.trial import TrialState

from emafault.errors import InputError
from emafault.identification import search

SPACE = {"network.width": {"low": 2, "high": 9}, "network.coordinates": ["linear", "log"]}
WORKER = """
import sys, numpy as np, json
from emafault.identification import search
data = np.load(sys.argv[1])
settings = search.SearchSettings(**json.loads(sys.argv[3]))
search.run_worker(sys.argv[2], settings, data["x"], data["f"], data["w"], worker=int(sys.argv[4]))
"""


def summarise(storage, wanted, *data):
    """Finished trials of a storage, those on the Pareto front marked."""
    return search.ranked(search.finished(storage, wanted, *data), wanted.trials)


@pytest.fixture(scope="module")
def data(make_set, width):
    known = make_set(150, 1)
    return known.features, known.faults, width


def settings(trials=6, **more):
    return search.SearchSettings(space=SPACE, trials=trials, repeats=1, training={"epochs": 25}, seed=3, **more)


@pytest.mark.parametrize("sampler", ["tpe", "nsga2"])
def test_one_worker_is_reproducible_and_the_front_is_one(data, tmp_path, sampler):
    runs = []
    for name in ("a", "b"):
        assert search.run_worker(tmp_path / name, settings(sampler=sampler), *data) == 6
        runs.append(summarise(tmp_path / name, settings(sampler=sampler), *data))
    assert [(t.error, t.parameters, t.network) for t in runs[0]] == [
        (t.error, t.parameters, t.network) for t in runs[1]
    ]
    front = sorted((t for t in runs[0] if t.pareto), key=lambda t: t.parameters)
    assert front
    assert np.all(np.diff([t.error for t in front]) < 0)
    for trial in runs[0]:
        assert any(f.error <= trial.error and f.parameters <= trial.parameters for f in front)


def test_only_what_is_missing_is_run(data, tmp_path):
    journal = tmp_path / "search.journal"
    seen = []
    assert search.run_worker(journal, settings(3), *data, progress=lambda done, asked: seen.append((done, asked))) == 3
    assert seen[0] == (0, 3) and seen[-1] == (3, 3)
    assert search.run_worker(journal, settings(5), *data) == 2
    assert search.run_worker(journal, settings(5), *data) == 0
    assert len(summarise(journal, settings(5), *data)) == 5
    other = data[0] + 1e-3, *data[1:]  # other data: another study in the same file
    assert summarise(journal, settings(5), *other) == []


def test_workers_share_a_journal_and_resume_after_a_kill(data, tmp_path):
    np.savez(tmp_path / "data.npz", x=data[0], f=data[1], w=data[2])
    journal = tmp_path / "search.journal"
    plain = {"space": SPACE, "trials": 40, "repeats": 1, "training": {"epochs": 25}, "seed": 3}

    def start(worker, trials):
        arguments = [str(tmp_path / "data.npz"), str(journal), json.dumps(plain | {"trials": trials}), str(worker)]
        environment = os.environ | {"OMP_NUM_THREADS": "1"}
        return subprocess.Popen([sys.executable, "-c", WORKER, *arguments], env=environment)

    victim = start(0, 40)
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline and (not journal.exists() or journal.read_bytes().count(b"\n") < 15):
        time.sleep(0.02)
    victim.send_signal(signal.SIGKILL)
    victim.wait()
    with open(journal, "ab") as file:  # what a kill in the middle of a write leaves
        file.write(b'{"op_code":6,"tri')
    done = len(summarise(journal, search.SearchSettings(**plain), *data))
    assert 1 <= done < 40
    asked = done + 5
    workers = [start(number, asked) for number in (1, 2)]
    assert [worker.wait(timeout=120) for worker in workers] == [0, 0]
    trials = summarise(journal, search.SearchSettings(**plain), *data)
    assert len(trials) == asked  # neither fewer for the killed trial nor more for the second worker


def test_a_trial_too_many_is_given_back(data, tmp_path, monkeypatch):
    wanted, sampler, others = settings(4), search._sampler, []

    def beaten(*arguments):  # another worker asks for the last trial after this one has counted, before it asks
        study = search.open_study(tmp_path / "journal", search.study_name(wanted, *data))
        if arguments[2] == 3 and not others:
            others.append(study.ask())
        elif others:
            raise AssertionError("asked for more than is missing")
        return sampler(*arguments)

    def wait(_):  # the other worker's trial ends meanwhile
        for key, spec in SPACE.items():
            search._suggest(others[0], key, spec)
        search.open_study(tmp_path / "journal", search.study_name(wanted, *data)).tell(others[0].number, (0.5, 10))

    monkeypatch.setattr(search, "_sampler", beaten)
    monkeypatch.setattr(search.time, "sleep", wait)
    assert search.run_worker(tmp_path / "journal", wanted, *data) == 3
    assert len(search.finished(tmp_path / "journal", wanted, *data)) == 4


def test_a_search_that_was_killed_goes_on_as_it_would_have(data, tmp_path):
    class Killed(Exception):
        pass

    def kill(done, asked):
        if done == 3:
            raise Killed

    search.run_worker(tmp_path / "whole", settings(8), *data)
    with pytest.raises(Killed):
        search.run_worker(tmp_path / "killed", settings(8), *data, progress=kill)
    search.run_worker(tmp_path / "killed", settings(8), *data)
    whole, killed = (summarise(tmp_path / name, settings(8), *data) for name in ("whole", "killed"))
    assert [(t.error, t.network, t.training) for t in whole] == [(t.error, t.network, t.training) for t in killed]


def test_a_trial_that_another_worker_told_failed_does_not_end_its_owner(data, tmp_path, monkeypatch):
    true_error, told = search.trial_error, []

    def error(*arguments):
        if not told:  # as a worker of another host does that saw no heartbeat
            study = search.open_study(tmp_path / "journal", search.study_name(settings(3), *data))
            told.append(study.get_trials()[-1].number)
            study.tell(told[0], state=TrialState.FAIL)
        return true_error(*arguments)

    monkeypatch.setattr(search, "trial_error", error)
    assert search.run_worker(tmp_path / "journal", settings(3), *data) == 3
    assert told and told[0] not in [t.number for t in summarise(tmp_path / "journal", settings(3), *data)]


def test_a_trial_of_another_host_is_abandoned_once_its_heartbeat_stops(data, tmp_path, monkeypatch):
    monkeypatch.setattr(search, "ABANDONED_AFTER", 1.0)
    monkeypatch.setattr(search, "HEARTBEAT", 0.2)
    study = search.open_study(tmp_path / "journal", search.study_name(settings(1), *data))
    owned = study.ask()
    owned.set_user_attr("owner", ["elsewhere", 1, "1"])
    watch = search._Watch()
    with search._beating(owned):
        until = time.monotonic() + 1.6
        while time.monotonic() < until:
            watch.bury_abandoned(study)
            time.sleep(0.1)
        assert study.get_trials()[0].state == TrialState.RUNNING
    assert search.run_worker(tmp_path / "journal", settings(1), *data) == 1
    assert study.get_trials()[0].state == TrialState.FAIL


def test_another_storage_is_a_setting(data, tmp_path):
    url = f"sqlite:///{tmp_path}/search.db"
    assert search.run_worker(url, settings(2), *data) == 2
    assert len(summarise(url, settings(2), *data)) == 2
    with pytest.raises(InputError, match="not a usable search storage"):
        search.open_study("nonsense://there", "name")


@pytest.mark.parametrize("content", ["notes\n", "notes", '{"a": 1}\n'])
def test_a_file_that_is_no_journal_is_refused_and_kept(data, tmp_path, content):
    path = tmp_path / "notes.txt"
    path.write_text(content)
    with pytest.raises(InputError, match=r"notes\.txt: not a search journal"):
        search.run_worker(path, settings(2), *data)
    assert path.read_text() == content
    with pytest.raises(InputError, match="cannot be stored"):
        search.open_study(tmp_path, "name")


def trial(number, error, parameters):
    return search.Trial(number, error, parameters, {}, {}, 1.0)


def test_choice_is_the_smallest_within_tolerance():
    trials = [trial(0, 0.0100, 300), trial(1, 0.0103, 100), trial(2, 0.0103, 100), trial(3, 0.012, 50)]
    assert search.choose(trials, 0.05).number == 1
    assert search.choose(trials, 0.0).number == 0
    assert search.choose(trials, 0.5).number == 3
    with pytest.raises(InputError, match="no trial"):
        search.choose([])


@pytest.mark.parametrize(
    ("space", "words"),
    [
        ({}, "search.space"),
        ({"width": [3]}, "search.space.width"),
        ({"network.width": {"low": 5, "high": 2}}, "above high"),
        ({"network.width": {"low": 5}}, "accepted are low, high"),
        ({"network.width": [3, 0]}, "network.width"),
        ({"network.colour": ["red"]}, "network.colour"),
        ({"training.optimiser": ["adam", "sgd"]}, "training.optimiser"),
    ],
)
def test_impossible_spaces_are_refused_before_anything_runs(space, words):
    with pytest.raises(InputError, match=words):
        search.SearchSettings(space=space)

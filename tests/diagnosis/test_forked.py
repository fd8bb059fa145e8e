"""Calls in forked processes: in order, each where what it kept is, and what is told reaches all of them."""

import multiprocessing
import os

import pytest

from emafault.diagnosis.forked import Workers, beside


class Shared:
    def __init__(self):
        self.kept = {}
        self.factor = 1

    def keep(self, name):
        self.kept[name] = os.getpid()
        return name

    def of(self, name):
        return self.factor * (self.kept[name] == os.getpid())

    def multiply(self, factor):
        self.factor = factor

    def place(self):
        self.factor += 1
        return os.getpid(), self.factor

    def refused(self):
        raise LookupError("not there")


NAMES = ["a", "b", "c", "d", "e"]


def test_what_a_place_has_kept_is_found_there_again():
    shared = Shared()
    workers = Workers(shared, shared, 2)
    every = range(len(NAMES))
    assert workers.map("keep", [(n,) for n in NAMES], every) == NAMES
    assert workers.map("of", [(NAMES[n],) for n in (4, 1, 3)], [4, 1, 3]) == [1, 1, 1]


def test_what_is_told_reaches_every_process():
    shared = Shared()
    workers = Workers(shared, shared, 3)
    workers.map("keep", [(n,) for n in NAMES])
    workers.tell("multiply", 7)
    assert workers.map("of", [(n,) for n in NAMES]) == [7] * 5


def test_one_process_does_all_here():
    shared = Shared()
    workers = Workers(shared, shared, 1)
    assert workers.count == 1
    workers.tell("multiply", 3)
    assert workers.map("keep", [("a",)]) == ["a"] and shared.kept == {"a": os.getpid()}
    assert workers.map("of", [("a",)], [1]) == [3]


def test_what_is_done_beside_leaves_everything_here_as_it_was():
    shared = Shared()
    with beside(shared, "place") as found:
        assert found() == found()
    assert found()[0] != os.getpid() and found()[1] == 2 and shared.factor == 1


def test_what_fails_beside_fails_where_it_is_asked_for():
    with pytest.raises(LookupError, match="not there"), beside(Shared(), "refused") as found:
        found()


def test_without_fork_it_is_done_here_once(monkeypatch):
    monkeypatch.setattr(multiprocessing, "get_all_start_methods", lambda: ["spawn"])
    shared = Shared()
    with beside(shared, "place") as found:
        assert shared.factor == 1
        assert found() == found() == (os.getpid(), 2)

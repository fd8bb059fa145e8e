"""The search over sets finds the set that is likeliest, though what stands in for several causes is nearer."""

import numpy as np
import pytest

from emafault.diagnosis.evidence import Normal, marginalise
from emafault.diagnosis.model import Parameter, Unit, Variant
from emafault.diagnosis.search import Search
from emafault.diagnosis.sets import Candidate, Choice

ROWS = 4000
CAUSES = 30
FUNCTIONS = 12


def _candidate(index, sd, names):
    count = len(index)
    widths = (1.0, 0.3, 0.1)
    return Candidate(np.array(index), np.zeros(count), np.full(count, sd), np.zeros(count, int), widths, names)


@pytest.mark.parametrize(("kind", "count"), [("structural", 3), ("form", 3)])
def test_causes_are_found_behind_a_remainder_that_stands_in_for_them(kind, count):
    rng = np.random.default_rng(5)
    causes = [f"cause_{k}" for k in range(CAUSES)]
    X = rng.standard_normal((ROWS, CAUSES))
    # functions of a remainder, among which is what each of the causes does
    left = np.column_stack([X[:, :count], rng.standard_normal((ROWS, FUNCTIONS - count))])
    nuisance = rng.standard_normal((ROWS, 1))
    r = -X[:, :count] @ np.linspace(1.0, 0.6, count) + rng.standard_normal(ROWS)
    columns = np.column_stack([nuisance, X, left])
    functions = [f"remainder.torque.0.{k}" for k in range(FUNCTIONS)]
    names = ["nuisance", *causes, *functions]
    normal = Normal(names, columns.T @ columns, columns.T @ r, float(r @ r))
    reduced = marginalise(normal, ["nuisance"], np.zeros(1), np.ones(1), np.zeros(len(names)))
    units = [Unit(c, kind, ("torque",), [Variant([Parameter(c, 0.0, 0.0, 1.0)])]) for c in causes]
    units.append(Unit("remainder:torque", "remainder", ("torque",), [Variant([])]))
    candidates = {(c, 0): _candidate([reduced.index[c]], 1.0, [c]) for c in causes}
    candidates["remainder:torque", 0] = _candidate([reduced.index[n] for n in functions], 1.0, functions)
    search = Search(reduced, units, candidates)

    assert search.run()[0].units == tuple(causes[:count])
    stand_in = search.fit((("remainder:torque", 0),))
    assert search.ranked()[0].log_posterior - stand_in.log_posterior > 12.0  # and not by a hair


@pytest.mark.parametrize(("proposed", "most"), [(False, 2), (True, 2), (True, 3)])
def test_a_set_has_no_more_forms_of_scans_than_it_may(proposed, most):
    names = ["one", "two", "three"]
    normal = Normal(names, 1e4 * np.eye(3), np.full(3, -1e4), 3e4)  # each is as surely there
    reduced = marginalise(normal, [], np.zeros(0), np.zeros(0), np.zeros(3))
    units = [Unit(n, "form", ("torque",), [Variant([])], proposed=proposed) for n in names]
    candidates = {(n, 0): _candidate([k], 1.0, [n]) for k, n in enumerate(names)}
    search = Search(reduced, units, candidates, scanned=most)
    assert len(search.run()[0].units) == (most if proposed else 3)


def test_what_an_own_form_takes_up_of_another_cause_is_given_back():
    """An effect in another form explains at one step what it and a wave do, and the wave promises nothing then."""
    rng = np.random.default_rng(2)
    causes = ["wave", *(f"cause_{k}" for k in range(CAUSES)), "effect"]
    X = rng.standard_normal((ROWS, len(causes)))
    own = np.column_stack([X[:, 0], rng.standard_normal((ROWS, 2))])
    r = -(X[:, -1] + 0.9 * X[:, 0]) + rng.standard_normal(ROWS)
    columns, shapes = np.column_stack([X, own]), [f"own.effect.torque.{k}" for k in range(3)]
    names = [*causes, *shapes]
    normal = Normal(names, columns.T @ columns, columns.T @ r, float(r @ r))
    reduced = marginalise(normal, [], np.zeros(0), np.zeros(0), np.zeros(len(names)))
    units = [Unit(c, "structural", ("torque",), [Variant([Parameter(c, 0.0, 0.0, 1.0)])]) for c in causes]
    candidates = {(c, 0): _candidate([reduced.index[c]], 1.0, [c]) for c in causes}
    form = _candidate([reduced.index["effect"]], 1.0, ["effect"])
    form.extra, form.extra_sd = np.array([reduced.index[n] for n in shapes]), np.full(3, 0.17)
    candidates["effect", 10] = form
    search = Search(reduced, units, candidates)

    best = search.run()[0]
    assert {(c.unit, c.variant) for c in best.choices} == {("effect", 0), ("wave", 0)}
    alone = search.fit((("effect", 10),))
    assert 3.0 < best.log_posterior - alone.log_posterior < 30.0
    assert best.log_posterior - search.fit((("effect", 0),)).log_posterior > 100.0


def test_a_look_at_some_sets_fits_these_alone_and_a_search_from_there_goes_on():
    names = ["one", "two", "three"]
    normal = Normal(names, 1e4 * np.eye(3), np.full(3, -1e4), 3e4)
    reduced = marginalise(normal, [], np.zeros(0), np.zeros(0), np.zeros(3))
    units = [Unit(n, "structural", ("torque",), [Variant([])]) for n in names]
    candidates = {(n, 0): _candidate([k], 1.0, [n]) for k, n in enumerate(names)}
    search = Search(reduced, units, candidates)
    search.look([(Choice("one", 0, 1.0), Choice("three", 0, 1.0), Choice("gone", 0, 1.0))])
    assert {m.units for m in search.ranked()} == {(), ("one", "three")}
    search.look_without()
    assert {m.units for m in search.ranked()} == {(), ("one",), ("three",), ("one", "three")}
    assert search.run()[0].units == ("one", "three", "two")

"""The search over sets finds the set that is likeliest, though what stands in for several causes is nearer."""

import numpy as np

from emafault.diagnosis.evidence import Normal, marginalise
from emafault.diagnosis.model import Parameter, Unit, Variant
from emafault.diagnosis.search import Candidate, Search

ROWS = 4000
EFFECTS = 30
FUNCTIONS = 12


def _candidate(index, sd, names):
    count = len(index)
    widths = (1.0, 0.3, 0.1)
    return Candidate(np.array(index), np.zeros(count), np.full(count, sd), np.zeros(count, int), widths, names)


def test_three_effects_are_found_behind_a_remainder_that_stands_in_for_them():
    rng = np.random.default_rng(5)
    effects = [f"effect_{k}" for k in range(EFFECTS)]
    X = rng.standard_normal((ROWS, EFFECTS))
    # functions of a remainder, among which is what each of the first three effects does
    left = np.column_stack([X[:, :3], rng.standard_normal((ROWS, FUNCTIONS - 3))])
    nuisance = rng.standard_normal((ROWS, 1))
    r = -X[:, :3] @ np.array([1.0, 0.8, 0.6]) + rng.standard_normal(ROWS)
    columns = np.column_stack([nuisance, X, left])
    functions = [f"remainder.torque.0.{k}" for k in range(FUNCTIONS)]
    names = ["nuisance", *effects, *functions]
    normal = Normal(names, columns.T @ columns, columns.T @ r, float(r @ r))
    reduced = marginalise(normal, ["nuisance"], np.zeros(1), np.ones(1), np.zeros(len(names)))
    units = [Unit(e, "structural", ("torque",), [Variant([Parameter(e, 0.0, 0.0, 1.0)])]) for e in effects]
    units.append(Unit("remainder:torque", "remainder", ("torque",), [Variant([])]))
    candidates = {(e, 0): _candidate([reduced.index[e]], 1.0, [e]) for e in effects}
    candidates["remainder:torque", 0] = _candidate([reduced.index[n] for n in functions], 1.0, functions)
    search = Search(reduced, units, candidates)

    assert search.run()[0].units == tuple(effects[:3])
    stand_in = search.fit((("remainder:torque", 0),))
    assert search.ranked()[0].log_posterior - stand_in.log_posterior > 12.0  # and not by a hair

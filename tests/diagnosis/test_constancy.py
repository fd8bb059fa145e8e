"""Whether what a unit takes up has the unit's form."""

from types import SimpleNamespace

import numpy as np
import pytest

from emafault.diagnosis.constancy import log_odds_of_another_cause
from emafault.diagnosis.evidence import Reduced
from emafault.diagnosis.model import Parameter, Unit, Variant
from emafault.diagnosis.search import Search
from emafault.diagnosis.sets import OTHER_FORM, Candidate

FUNCTIONS = 6
ROWS = 400
SIZE = 0.5  # of the unit


def searched(coefficients, own=True, **others):
    """A search over one unit that adds SIZE times a column to the torque and to other equations, of data in which
    functions along it have coefficients in each."""
    rng = np.random.default_rng(3)
    along = np.array([np.cos(k * np.linspace(0.0, np.pi, ROWS)) for k in range(FUNCTIONS)])
    equations = {"torque": coefficients} | others
    column = rng.standard_normal((len(equations), ROWS))
    forms = np.zeros((len(equations), FUNCTIONS, len(equations), ROWS))
    for k, x in enumerate(column):
        forms[k, :, k] = SIZE * x * along
    X = np.vstack([column.reshape(1, -1), forms.reshape(-1, column.size)])
    y = np.concatenate([SIZE * (np.asarray(c) @ along) * x for c, x in zip(equations.values(), column, strict=True)])
    y = y + 0.05 * rng.standard_normal(column.size)
    names = ["scale", *(f"own.load.{e}.{k}" for e in equations for k in range(FUNCTIONS))]
    reduced = Reduced(names, X @ X.T / 0.05**2, X @ y / 0.05**2, 0.0, np.zeros(len(names)))
    plain = Candidate(np.array([0]), np.zeros(1), np.ones(1), np.zeros(1, int), (1.0,), ["scale"])
    extra = np.arange(1, len(names))
    near = Candidate(
        *(plain.index, plain.mean, plain.sd, plain.signs, plain.widths, plain.names),
        extra=extra, extra_sd=np.full(len(extra), 0.17),
    )  # fmt: skip
    unit = Unit("load", "structural", tuple(equations), [Variant([Parameter("scale", 0.0, 0.0, 1.0)])])
    return Search(reduced, [unit], {("load", 0): plain} | ({("load", OTHER_FORM): near} if own else {}))


@pytest.mark.parametrize("variant", [0, OTHER_FORM])
def test_an_effect_has_its_own_form_or_one_near_it(variant):
    for coefficients in ([1.0, 0, 0, 0, 0, 0], [1.0, 0.15, -0.1, 0.1, 0.0, 0.1]):
        search = searched(coefficients)
        model = search.fit((("load", variant),))
        assert log_odds_of_another_cause(SimpleNamespace(search=search), model, "load") < -3.0


@pytest.mark.parametrize("variant", [0, OTHER_FORM])
def test_what_is_left_of_another_cause_has_any(variant):
    search = searched([0.4, 1.2, -0.8, 0.5, 1.0, -0.7])
    model = search.fit((("load", variant),))
    assert log_odds_of_another_cause(SimpleNamespace(search=search), model, "load") > 3.0


def test_an_effect_too_small_to_have_a_form_is_not_asked():
    search = searched([0.4, 1.2, -0.8, 0.5, 1.0, -0.7], own=False)
    model = search.fit((("load", 0),))
    assert log_odds_of_another_cause(SimpleNamespace(search=search), model, "load") == -np.inf


def test_of_another_cause_says_nothing_what_is_left_in_an_equation_that_lacks_something_else():
    as_it_is, other = [1.0, 0, 0, 0, 0, 0], [0.4, 1.2, -0.8, 0.5, 1.0, -0.7]
    both = searched(other, electrical_a=as_it_is)
    model = both.fit((("load", 0),))
    asked = [log_odds_of_another_cause(SimpleNamespace(search=both), model, "load", e) for e in ((), ("torque",))]
    assert asked[0] > 3.0 and asked[1] < -3.0
    in_both = searched(other, electrical_a=other)
    found = in_both.fit((("load", 0),))
    assert log_odds_of_another_cause(SimpleNamespace(search=in_both), found, "load", ("torque",)) > 3.0
    alone = searched(other)
    model = alone.fit((("load", 0),))
    assert log_odds_of_another_cause(SimpleNamespace(search=alone), model, "load", ("torque",)) > 3.0

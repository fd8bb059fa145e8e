"""Which listed effect a described form is much like."""

import numpy as np
import pytest

from emafault.diagnosis.described import another_form_of
from emafault.diagnosis.fit import Bench
from emafault.diagnosis.model import Block, Parameter, Unit, Variant
from emafault.diagnosis.search import Choice, Model, Search

ROWS = 2000
SPEED = np.linspace(0.1, 1.0, ROWS)
TOLERANCE = Parameter("viscous.scale", 0.0, 0.0, 0.1)
BEYOND = Parameter("viscous.scale+", 0.0, 0.0, 1.0, alias="viscous.scale")
LOAD = Parameter("load.T", 0.0, 0.0, 1.0)
FORM = Parameter("form.c", 0.0, 0.0, 1.0)


class Machine:
    """A coefficient within its tolerance, the same beyond it, a load, and a form of the speed."""

    forms = ()
    units = (
        Unit("viscous", "calibration", ("torque",), [Variant([BEYOND])]),
        Unit("load", "structural", ("torque",), [Variant([LOAD])]),
        Unit("~power", "form", ("torque",), [Variant([FORM])]),
    )

    def __init__(self, form):
        self.parameters = {p.name: p for p in (TOLERANCE, BEYOND, LOAD, FORM)}
        self.form = form

    def families(self, equation):
        return ()

    def blocks(self, values, recording, wanted=None, disturbed=False):
        residual = np.zeros(ROWS) if disturbed else np.random.default_rng(0).standard_normal(ROWS)
        columns = {"viscous.scale": SPEED, "load.T": np.ones(ROWS), "form.c": self.form}
        return [Block(recording, "torque", residual, columns, [np.ones(ROWS)], np.ones(ROWS, bool))]


@pytest.mark.parametrize(
    ("form", "nearest"),
    [(SPEED**0.8, "viscous"), (1.0 + 0.05 * np.sin(40.0 * SPEED), "load"), (np.sin(40.0 * SPEED), None)],
)
def test_a_form_is_much_like_the_effect_that_it_resembles(form, nearest):
    """The tolerance of the coefficient has the effect's own column, and does not hide it."""
    bench = Bench(Machine(form), ["a"])
    model = Model(tuple(Choice(u.id, 0, 1.0) for u in Machine.units), 0.0, 0.0, {}, {})
    normal = bench.normal(bench.linearise(model, corrected=False), model)
    reduced = bench.reduce(normal)
    search = Search(reduced, *bench.candidates(reduced))
    assert another_form_of(lambda but: bench.reduce(normal, but), search, "~power", {"form.c": 0.5}) == nearest

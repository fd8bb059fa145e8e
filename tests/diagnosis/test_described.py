"""Which listed effect a described form is much like."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from emafault.diagnosis.described import Described, with_forms
from emafault.diagnosis.describing import FEWEST, MOST
from emafault.diagnosis.fit import Bench
from emafault.diagnosis.model import Block, Parameter, Unit, Variant
from emafault.diagnosis.search import Search
from emafault.diagnosis.sets import Choice, Model
from emafault.diagnosis.shown import another_form_of, curve
from emafault.diagnosis.whitening import Weights

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

    own_families = families

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
    model = Model(tuple(Choice(u.id, 0, 1.0) for u in Machine.units))
    normal = bench.normal(bench.linearise(model, corrected=False), model)
    reduced = bench.reduce(normal)
    search = Search(reduced, *bench.candidates(reduced))
    assert another_form_of(lambda but: bench.reduce(normal, but), search, "~power", {"form.c": 0.5}) == nearest


class Wave(Machine):
    """A load that comes and goes, larger than the noise, and as much of another one that no effect is like."""

    recordings = ("a", "b", "c")
    time = np.arange(ROWS) * 1e-3

    def __init__(self, sizes):
        super().__init__(SPEED)
        self.sizes = sizes

    def samples(self, recording):
        return ROWS

    def channels(self, equation, driver):
        return ()

    def coefficients(self, equation, driver):
        return ()

    def blocks(self, values, recording, wanted=None, disturbed=False):
        load, other = np.sin(2.0 * np.pi * 3.0 * self.time), np.sin(2.0 * np.pi * 21.3 * self.time)
        rng = np.random.default_rng(self.recordings.index(recording))
        noise = np.zeros(ROWS) if disturbed else rng.standard_normal(ROWS)
        residual = noise + (values["load.T"] - self.sizes[0]) * load + self.sizes[1] * other
        along = {
            "time": self.time, "rotor_speed": SPEED, "rotor_angle": np.mod(self.time, 2.0 * np.pi),
            "angle": self.time, "current": SPEED, "output_angle": self.time, "temperature": np.full(ROWS, 20.0),
            "drivers": np.ones((1, ROWS)), "direction": np.ones(ROWS),
        }  # fmt: skip
        columns = {"viscous.scale": SPEED, "load.T": load}
        usable = np.ones(ROWS, bool)
        return [Block(recording, "torque", residual, columns, [np.ones(ROWS)], usable, along)]


@pytest.mark.parametrize(("sizes", "found"), [((0.6, 0.0), set()), ((0.6, 0.5), {"~frequency_torque_0_first"})])
def test_what_a_listed_effect_could_be_is_no_form(sizes, found):
    """Whether or not it acts yet: a form beside it would otherwise be looked for in what the effect does."""
    bench = Bench(Wave(sizes), Wave.recordings)
    white = Weights(np.ones(ROWS, bool), np.zeros(0), np.ones(ROWS))
    bench.carried |= {n: {"torque": white} for n in Wave.recordings}
    bench._describe("first")
    assert {d.id for d in bench.described if d.word == "frequency"} == found
    assert all(d.values["frequency"] == pytest.approx(21.3, abs=0.1) for d in bench.described if d.id in found)


@pytest.mark.parametrize(("leads", "kept"), [("~f_a", "ab"), ("~f_t", "t")])
def test_what_is_in_one_channel_may_be_in_another(leads, kept):
    """A channel's form keeps those of its shape in other channels beside it, which no scan would find alone."""
    bench = Bench(Wave((0.0, 0.0)), Wave.recordings)
    shape, other = ((("frequency", f, 0.01, "Hz"),) for f in (50.0, 21.3))
    form = Described("", "frequency", "sensor_current", 0, shape, 1.0, 1.0, "sensor_current")
    forms = [replace(form, id=f"~f_{j}", channel=f"current_{j}") for j in "ab"]
    forms += [replace(forms[1], id="~f_c", shape=other), replace(form, id="~f_t", equation="torque", seen="")]
    bench.describe([*forms, replace(forms[3], id="~f_u")])
    bench._keep_likely(SimpleNamespace(ranked=lambda: [Model((Choice(leads, 0, 1.0),), 0.0)]))
    assert [f.id for f in bench.described] == [f"~f_{j}" for j in kept]


@pytest.mark.parametrize(("left", "far"), [(True, False), (False, False), (False, True)])
def test_several_forms_are_one_remainder_unless_they_leave_none(monkeypatch, left, far):
    """Scans go on while the leading set is full of what they propose; what ends at a remainder is taken back, and so is
    what is far from describing all."""
    bench = Bench(Wave((0.0, 0.0)), Wave.recordings)
    form = Described("~f", "frequency", "torque", 0, (("frequency", 21.3, 0.01, "Hz"),), 1.0, 1.0)

    def describe(mark):
        bench.describe([*bench.described, replace(form, id=f"~f_{mark}")])
        bench.point["load.T"] += 1.0
        return True

    ended = ("whites", "normal", "search")
    monkeypatch.setattr(bench, "_describe", describe)
    monkeypatch.setattr(bench, "_count_scanned", lambda _: bench.scanned)
    monkeypatch.setattr(bench, "_keep_likely", lambda _: None)
    monkeypatch.setattr(bench, "_renewed", lambda: ())
    monkeypatch.setattr(bench, "_until_still", lambda *_: ended)
    monkeypatch.setattr(bench, "_none_to_leave", lambda *_: ended)
    monkeypatch.setattr(bench, "_lacking", lambda _: left)
    monkeypatch.setattr(bench, "_out_of_reach", lambda *_: far)
    found = bench._with_all_described(*"wns")
    more = 0 if left or far else MOST - FEWEST
    assert found == (ended if more else tuple("wns"))
    assert (bench.scanned, len(bench.described), bench.point["load.T"]) == (FEWEST + more, more, more)


@pytest.mark.parametrize(("adds", "far"), [(19.0, False), (21.0, True)])
def test_forms_are_out_of_reach_of_a_remainder_that_adds_more_than_they_may(monkeypatch, adds, far):
    """Of two forms the least explains ten nats, and sets may have two more."""
    bench = Bench(Wave((0.0, 0.0)), Wave.recordings)
    form = Described("~f", "frequency", "torque", 0, (("frequency", 21.3, 0.01, "Hz"),), 1.0, 1.0)
    bench.describe([form, replace(form, id="~g")])
    bench.scanned = MOST - 2
    worth = {"~f": 30.0, "~g": 10.0, "remainder:torque": adds, "remainder:bus": 500.0}

    def fit(members):
        return Model(tuple(Choice(u, v, 1.0) for u, v in members), sum(worth[u] for u, _ in members))

    search = SimpleNamespace(
        ranked=lambda: [fit((("~f", 0), ("~g", 0)))], fit=fit,
        less=lambda model, unit: fit(tuple((c.unit, 0) for c in model.choices if c.unit != unit)),
        candidates=[("~f", 0), ("remainder:torque", 0), ("remainder:bus", 0)],
    )  # fmt: skip
    monkeypatch.setattr(bench, "_searched", lambda *_: search)
    assert bench._out_of_reach(search, None) is far


@pytest.mark.parametrize(("size", "bins"), [(0.5, 30), (0.055, 15), (0.02, 8)])
def test_a_picture_has_no_more_bins_than_show_more_than_their_errors(size, bins):
    form = Described("~f", "frequency", "torque", 0, (("frequency", 21.3, 0.01, "Hz"),), 1.0, 1.0)
    machine = with_forms(Wave((0.0, size)), [form])
    values = {"load.T": 0.0} | {f"form.~f.{c}@{r}": -size * (c == "sine") for r in "abc" for c in ("cosine", "sine")}
    blocks = [b for r in Wave.recordings for b in machine.blocks(values, r)]
    white = Weights(np.ones(ROWS, bool), np.zeros(0), np.ones(ROWS))
    found = curve(machine, form, blocks, {r: {"torque": white} for r in Wave.recordings}, values)
    assert len(found["x"]) == len(found["before"]) == len(found["error"]) == bins

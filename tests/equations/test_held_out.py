"""What a misfit on recordings set aside is compared with."""

from dataclasses import replace
from functools import partial
from itertools import islice
from types import SimpleNamespace

import numpy as np
import pytest

from emafault.diagnosis.closure import Ladder
from emafault.diagnosis.described import Described
from emafault.diagnosis.fit import NOTHING, Bench
from emafault.diagnosis.model import Unit
from emafault.diagnosis.sets import Choice, Model
from emafault.equations import held_out, predicted
from emafault.equations.how_far import CONTROLLER_SETTINGS
from emafault.equations.predicted import less

from .conftest import machine_of, recorded


@pytest.fixture(scope="module")
def ladder():
    """Two recordings of the nominal unit as those that confirm, and the values of their own fit."""
    machine = machine_of({f"r{n}.nc": recorded("sine", {}, (0.0,) * 5 + (20.0,), seed=n, theta_0=n) for n in range(2)})
    bench = Bench(machine, list(machine.recordings))
    bench.settle(NOTHING)
    bench.linearise(renew=True)
    return Ladder(bench, list(machine.recordings), bench.described), bench.values()


def electrical(ladder, values, **options):
    whites = [w for w in ladder.blocks(values, **options) if w.equation.startswith("electrical")]
    return sum(w.gram[-1, -1] for w in whites), sum(w.own for w in whites), sum(w.count for w in whites)


def test_noise_alone_is_the_noise_s_part(ladder):
    misfit, own, rows = electrical(*ladder, corrected=True)
    assert misfit - own == pytest.approx(0.0, abs=4.0 * np.sqrt(4.0 * rows))
    assert electrical(*ladder)[1] == 0.0


def test_a_coefficient_that_multiplies_noise_loses_nothing_by_that(ladder):
    """A larger inductance multiplies the end currents' noise by more: that much of its misfit says nothing of it."""
    fixed, values = ladder
    larger = values | {"inductance_tolerance.L_scale": 1.05 * values["inductance_tolerance.L_scale"]}
    raw, part, _ = electrical(fixed, larger, corrected=True)
    before, own, rows = electrical(fixed, values, corrected=True)
    assert part - own > 4.0 * np.sqrt(0.05 * rows)
    assert before - own < raw - part < raw - own


def test_recordings_set_aside_are_predicted_with_the_shapes_that_the_prediction_has():
    """The fit to all recordings may refine them, and its coefficients are then those of another form."""
    machine = machine_of({"a.nc": recorded("sine")})
    shape = (("order", 2.0, 0.01, "1"),)
    form = Described("~o", "order", "torque", 0, shape, 1.0, 1.0)
    bench = Bench(machine, ["a.nc"])
    bench.describe([replace(form, shape=(("order", 2.1, 0.01, "1"),))])
    bench.settle(NOTHING)
    bench.linearise(renew=True)
    values = bench.values() | {"form.~o.cosine": 0.02}
    misfits = [
        sum(w.gram[-1, -1] for w in Ladder(bench, ["a.nc"], [f]).blocks(values) if w.equation == "torque")
        for f in (form, *bench.described)
    ]
    assert Ladder(bench, ["a.nc"], [form]).machine.forms == (form,) and bench.described != (form,)
    assert abs(misfits[0] - misfits[1]) > 100.0


def test_the_controller_s_settings_are_refitted_where_they_are_no_part_of_the_gap(ladder):
    """A gain that the exploring recordings hardly tell is frozen far from where it is."""
    fixed, values = ladder
    off = values | {"controller.position_gain": 0.9 * values["controller.position_gain"]}

    def mean_square(equation, settings):
        found = [w for w in fixed.blocks(off, settings=settings) if w.equation == equation]
        return sum(w.gram[-1, -1] for w in found) / sum(w.count for w in found)

    assert mean_square("control", ()) > 3.0
    assert mean_square("control", CONTROLLER_SETTINGS) < 1.5
    assert mean_square("torque", CONTROLLER_SETTINGS) == pytest.approx(mean_square("torque", ()), rel=0.01)


def test_what_is_let_go_leaves_a_remainder_where_that_explains_most():
    explains = {"remainder:electrical_a": 1.0, "remainder:electrical_b": 30.0, "remainder:torque": 50.0}

    def fit(members):
        value = sum(explains.get(u, 0.0) for u, _ in members)
        return Model(tuple(Choice(u, v, 1.0) for u, v in members), value, 0.0, {}, {})

    units = {"voltage_gain": Unit("voltage_gain", "structural", ("electrical",), [])}
    search = SimpleNamespace(fit=fit, units=units, candidates=[(u, 0) for u in explains])
    model = fit((("voltage_gain", 0), ("cogging", 0)))
    assert set(less(search, model, "voltage_gain", True).units) == {
        "cogging", "remainder:electrical_b",
    }  # fmt: skip
    assert less(search, model, "voltage_gain", False).units == ("cogging",)


def searching(units):
    """A search whose sets are the likelier the more they hold."""

    def fit(members):
        return Model(tuple(Choice(u, v, 1.0) for u, v in members), float(len(members)), 0.0, {}, {})

    return SimpleNamespace(fit=fit, units=units, candidates=[(u, 0) for u in units])


def lacking(sets, ratios):
    """Effects that are to be held to account first for which the sets lack something."""
    return {u for told, incomplete in islice(sets.told(ratios, {}), 1) for u in told if incomplete}


@pytest.mark.parametrize(
    ("effect", "equation", "remainder", "incomplete"),
    [
        ("control_delay", "control", "control", True),
        ("inertia", "torque", "control", False),
        ("inertia", "torque", "torque", True),
        ("inertia", "torque", "electrical_a", True),
    ],
)
def test_beside_a_remainder_no_set_is_the_true_one(effect, equation, remainder, incomplete):
    """One of the controller's own business says nothing of the machine, but of what the controller does."""
    units = {
        effect: Unit(effect, "structural", (equation,), []),
        f"remainder:{remainder}": Unit(f"remainder:{remainder}", "remainder", (remainder,), []),
    }
    search = searching(units)
    sets = held_out._Sets(None, SimpleNamespace(models=[search.fit([(u, 0) for u in units])], search=search))
    assert lacking(sets, {}) == ({effect} if incomplete else set())


@pytest.mark.parametrize(("ratio", "incomplete"), [(-4.1, {"control_delay"}), (36.5, {"control_delay"}), (None, set())])
def test_where_a_remainder_was_seen_no_set_is_the_true_one(ratio, incomplete):
    """Whether or not it is confirmed: what no model describes then need not be what the exploring recordings showed."""
    units = {"control_delay": Unit("control_delay", "structural", ("control",), [])}
    if ratio is not None:
        units["remainder:control"] = Unit("remainder:control", "remainder", ("control",), [])
    search = searching(units)
    sets = held_out._Sets(None, SimpleNamespace(models=[search.fit([(u, 0) for u in units])], search=search))
    account = SimpleNamespace(of_remainder=lambda _: ratio, let_go=lambda *_: None)
    ratios = {}
    held_out._ask_remainders(sets, account, ratios)
    assert any("remainder:control" in m.units for m in sets.models) == (ratio == 36.5)
    assert lacking(sets, ratios) == incomplete


def test_beside_a_form_that_is_not_confirmed_no_set_of_that_equation_is_the_true_one(monkeypatch):
    monkeypatch.setattr(held_out, "overdispersion", lambda *_: 1.0)
    units = {
        "~function": Unit("~function", "form", ("torque",), []),
        "inertia": Unit("inertia", "structural", ("torque",), []),
        "voltage_gain": Unit("voltage_gain", "structural", ("electrical",), []),
    }
    search = searching(units)
    fit = search.fit
    for ratio, unexplained in ((-4.1, {"inertia"}), (36.5, set())):
        both = fit((("inertia", 0), ("~function", 0)))
        sets = held_out._Sets(None, SimpleNamespace(models=[both], search=search))
        account = SimpleNamespace(ratio=lambda _, ratio=ratio: ratio, instead=lambda _: 0.0, let_go=lambda *_: None)
        held_out._ask_forms(sets, account, {})
        assert lacking(sets, {"~function": ratio}) == {"inertia"} & unexplained
        assert any("~function" in m.units for m in sets.models) == (ratio > 0.0)


def test_what_is_let_go_stands_in_for_no_other(monkeypatch):
    """Two causes that explain the same: once one is not told, the other is compared with nothing in its place."""
    alike = {"unit_calibration", "~ambient"}
    monkeypatch.setattr(
        predicted, "_misfit", lambda _, model, out="": 0.0 if (alike & set(model.units)) - {out} else 400.0
    )
    kinds = {"unit_calibration": "calibration", "~ambient": "form", "remainder:electrical_a": "remainder"}
    units = {u: Unit(u, kind, ("electrical",), []) for u, kind in kinds.items()}

    def fit(members):
        return Model(tuple(Choice(u, v, 1.0) for u, v in members), float(len(members)), 0.0, {}, {})

    def less(model, unit):
        return fit(tuple((c.unit, c.variant) for c in model.choices if c.unit != unit))

    search = SimpleNamespace(fit=fit, less=less, units=units, candidates=[(u, 0) for u in units])
    alone, both = fit((("~ambient", 0),)), fit((("unit_calibration", 0), ("~ambient", 0)))
    explored = SimpleNamespace(fit=SimpleNamespace(models=[alone, both], search=search))
    account = predicted.Account(explored, ["unit_calibration"])
    assert account.ratio("~ambient") == account.ratio("unit_calibration") == 0.0
    account.let_go("~ambient", left=True)
    assert account.ratio("unit_calibration") == 200.0
    assert account.base.units == ("remainder:electrical_a",)


def test_a_form_that_is_told_for_want_of_another_remainder_is_held_to_account():
    """It is told with 0.6, for a remainder in its equation could be it; it had not been asked for below 0.9."""
    kinds = {"~drift_output": "form", "~lag_voltage": "form", "remainder:position": "remainder"}
    acts = {"~drift_output": "position", "~lag_voltage": "electrical", "remainder:position": "position"}
    units = {u: Unit(u, kind, (acts[u],), []) for u, kind in kinds.items()}
    weights = {("~drift_output",): 0.6, ("remainder:position",): 0.35, ("~lag_voltage",): 0.03, (): 0.02}
    models = [Model(tuple(Choice(u, 0, 1.0) for u in of), float(np.log(w)), 0.0, {}, {}) for of, w in weights.items()]
    sets = held_out._Sets(None, SimpleNamespace(models=models, search=SimpleNamespace(units=units)))
    assert next(sets.untold({}, "form")) == "~drift_output"
    assert list(sets.untold({"~drift_output": 4.0}, "form")) == list(sets.untold({}, "remainder")) == []


@pytest.mark.parametrize(("shows", "ratio"), [(False, 0.0), (True, 40.0)])
def test_a_form_is_confirmed_by_what_it_adds_itself(monkeypatch, shows, ratio):
    """What stands out in one explored recording distorts the rest where no form takes it: that the rest predicts better
    beside it is no sign of it in the others."""
    units = {"~bump": Unit("~bump", "form", ("bus",), []), "~lag": Unit("~lag", "form", ("sensor_angle",), [])}

    def misfit(_, model, out=""):
        there = "~bump" in model.units
        return 100.0 + (0.0 if there else 80.0) + (90.0 if there and out and shows else 0.0)

    monkeypatch.setattr(predicted, "_misfit", misfit)

    def fit(members):
        return Model(tuple(Choice(u, v, 1.0) for u, v in members), float(len(members)), 0.0, {}, {})

    def less(model, unit):
        return fit(tuple((c.unit, c.variant) for c in model.choices if c.unit != unit))

    search = SimpleNamespace(fit=fit, less=less, units=units, candidates=[(u, 0) for u in units])
    explored = SimpleNamespace(fit=SimpleNamespace(models=[fit((("~bump", 0), ("~lag", 0)))], search=search))
    account = predicted.Account(explored, [])
    assert account.ratio("~bump") == ratio


def test_nothing_is_compared_beside_what_all_recordings_dismiss(monkeypatch):
    """Two forms that make up for each other: without one that is not told, the other predicts worse than nothing."""
    units = {u: Unit(u, "form", ("torque",), []) for u in ("~frequency", "~function")}
    misfits = {(): 400.0, ("~frequency",): 700.0, ("~function",): 900.0, ("~frequency", "~function"): 100.0}
    monkeypatch.setattr(
        predicted, "_misfit", lambda _, model, out="": misfits[tuple(u for u in model.units if u != out)]
    )

    def fit(members):
        return Model(tuple(Choice(u, v, 1.0) for u, v in members), float(len(members)), 0.0, {}, {})

    def less(model, unit):
        return fit(tuple((c.unit, c.variant) for c in model.choices if c.unit != unit))

    search = SimpleNamespace(fit=fit, less=less, units=units, candidates=[(u, 0) for u in units])
    both, one = fit((("~frequency", 0), ("~function", 0))), fit((("~function", 0),))
    explored = SimpleNamespace(fit=SimpleNamespace(models=[both], search=search))
    for models, ratio in (([both], 300.0), ([one], -250.0)):
        account = predicted.Account(explored, [])
        account.let_go_absent(models)
        assert account.ratio("~function") == ratio
    account.let_go_absent([one])
    assert account.ratio("~frequency") == 400.0  # asked after all, it is there again


def test_what_one_equation_lacks_is_no_misfit_of_those_that_share_its_nuisances(monkeypatch):
    """A torque that lacks something draws the back-EMF constant along, which all phases then miss."""

    def fit(members):
        return Model(tuple(Choice(u, v, 1.0) for u, v in members), 0.0, 0.0, {}, {})

    remainders = [(f"remainder:{e}", 0) for e in ("torque", "electrical_a", "position")]
    search = SimpleNamespace(fit=fit, candidates=remainders)
    bench = SimpleNamespace(inserted=lambda model, normal: SimpleNamespace(values={}))
    ladder = SimpleNamespace(blocks=lambda values, also, inserted: [])
    explored = SimpleNamespace(bench=bench, ladder=ladder, fit=SimpleNamespace(search=search, normal=None))
    of = {
        ("inertia",): {"torque": 50.0, "electrical_a": 20.0, "position": 3.0, "bus": -2.0},
        ("inertia", "remainder:torque"): {"torque": -9.0, "electrical_a": -5.0, "position": 4.0, "bus": 90.0},
        ("inertia", "remainder:position", "remainder:torque"): {
            "torque": -8.0,
            "electrical_a": -5.0,
            "position": -1.0,
            "bus": 0.5,
        },
    }
    monkeypatch.setattr(held_out.predictive, "log_odds", lambda bench, fit, model, confirm: of[model.units])
    found = held_out.HeldOut(explored, {}, {}, fit([("inertia", 0)]))
    assert held_out.misfits(found) == {"torque": 50.0, "electrical_a": -5.0, "position": 3.0, "bus": -2.0}


def test_what_is_told_has_to_predict_not_what_the_search_had():
    """Once an effect is held to account and not told, recordings are predicted without it."""
    units = ("compliance", "inertia", "stribeck")
    search = searching({u: Unit(u, "structural", ("torque",), []) for u in units})
    explored = SimpleNamespace(fit=SimpleNamespace(models=[search.fit([(u, 0) for u in units[:2]])], search=search))
    account = predicted.Account(explored, [])
    assert account.counterpart(search.fit([("compliance", 1)])).choices == (Choice("compliance", 0, 1.0),)
    assert account.counterpart(search.fit([("stribeck", 0)])).units == ("stribeck",)
    assert account.counterpart(search.fit([("~seen_by_all_alone", 0)])).units == ()


@pytest.mark.parametrize(("own", "named"), [(-3.0, False), (9.0, True)])
def test_beside_what_is_not_told_any_more_an_effect_is_compared_at_its_own_optimum(own, named):
    """The linear model's point is that of the set with all of it."""
    units = {
        "~function": Unit("~function", "form", ("torque",), []),
        "inertia": Unit("inertia", "structural", ("torque",), []),
    }
    search = searching(units)
    search.less = lambda model, out: search.fit([(u, 0) for u in model.units if u != out])
    with_all, with_it = search.fit([(u, 0) for u in units]), search.fit([("inertia", 0)])
    places = []
    bench = SimpleNamespace(
        here=lambda: "begun", go_to=places.append, move=lambda model, normal: None,
        settle=lambda model: Model(model.choices, own if "inertia" in model.units else 0.0),
    )  # fmt: skip
    bench.at_its_own = partial(Bench.at_its_own, bench)
    sets = held_out._Sets(bench, SimpleNamespace(models=[with_all], search=search, normal=None))
    sets.models = [with_it]
    sets.add_at_their_own("inertia", ("inertia",))
    likeliest = max(sets.models, key=lambda m: m.log_posterior)
    assert ("inertia" in likeliest.units) == named and places == ["begun", "begun"]
    assert sets.log_mass(("inertia",)) - max(m.log_posterior for m in sets.models if not m.units) == pytest.approx(own)
    sets.models = [with_all]  # where the fit ended
    sets.add_at_their_own("inertia", ("inertia",))
    assert sets.models == [with_all]

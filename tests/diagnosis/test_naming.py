"""Groups, the hole in a calibration effect's prior, and names that the held-out recordings contradict."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from emafault.diagnosis.evidence import Reduced
from emafault.diagnosis.linear import White
from emafault.diagnosis.model import Parameter, Unit, Variant
from emafault.diagnosis.naming import possible_place, read
from emafault.diagnosis.search import Search
from emafault.diagnosis.sets import Candidate, Choice, Model
from emafault.equations import held_out, predicted


def unit(name, *equations, kind="structural"):
    return Unit(name, kind, equations, [Variant([Parameter(name, 0.0, 0.0, 1.0)])])


def model(log_posterior, *effects):
    return Model(tuple(Choice(e, 0, 1.0) for e in effects), log_posterior, log_posterior, {}, {})


@pytest.mark.parametrize(("equation", "one_equation", "grouped"), [
    ("torque", True, True), ("control", True, False), ("control", False, True),
])  # fmt: skip
def test_only_what_acts_in_a_common_equation_is_a_group(equation, one_equation, grouped):
    units = [unit("load", "torque"), unit("other", equation)]
    found = read([model(0.0, "load"), model(0.0, "other"), model(-9.0)], units, (), one_equation)
    assert found.groups == ((("load", "other"),) if grouped else ())


def test_what_the_recordings_show_of_their_chain_is_beside_whatever_is_named():
    units = [unit("load", "torque")]
    empty, named = [model(0.0), model(-9.0, "load")], [model(-9.0), model(0.0, "load")]
    assert [read(m, units).verdict for m in (empty, named)] == ["no_gap", "explained"]
    assert [read(m, units, counted=True).verdict for m in (empty, named)] == ["described", "partly"]


def test_what_wanders_is_a_remainder_unless_a_listed_effect_acts_there():
    units = [unit("load", "torque"), unit("gain", "sensor_current")]
    wandering = {"torque": 5.0}
    left = "remainder:torque"
    nothing = read([model(0.0), model(-9.0, "load")], units, wandering=wandering)
    assert nothing.verdict == "unknown" and nothing.remainders == (left,)
    own = read([model(-9.0), model(0.0, "load")], units, wandering=wandering)
    assert own.verdict == "explained" and own.inclusion[left] < 0.01
    elsewhere = read([model(-9.0), model(0.0, "gain")], units, wandering=wandering)
    assert elsewhere.verdict == "partly" and elsewhere.named == ("gain",)


@pytest.mark.parametrize(("rest", "told"), [("remainder:sensor_speed", True), ("remainder:torque", False)])
def test_a_form_that_is_there_or_left_as_a_remainder_of_its_equation_is_told(rest, told):
    units = [unit("~drift_speed", "sensor_speed", kind="form"), unit(rest, rest.split(":")[1], kind="remainder")]
    found = read([model(1.0, "~drift_speed"), model(0.0, rest)], units)
    assert found.forms == (("~drift_speed",) if told else ())
    assert 0.7 < found.inclusion["~drift_speed"] < 0.8
    assert read([model(0.0, "~drift_speed"), model(1.0, rest)], units).forms == ()


def test_of_forms_that_are_the_same_but_for_what_is_free_the_likelier_is_told():
    same = replace(unit("~function_also", "torque", kind="form"), same_as="~function")
    units = [unit("load", "torque"), unit("~function", "torque", kind="form"), same]
    found = read([model(0.1, "load", "~function_also"), model(0.0, "load", "~function"), model(-30.0)], units)
    assert (found.verdict, found.named, found.forms) == ("partly", ("load",), ("~function_also",))
    assert found.inclusion["~function_also"] > 0.999 and not found.left


def test_what_is_left_for_certain_without_a_form_that_is_told_is_a_remainder():
    units = [unit("load", "torque"), *(unit(f"~{n}", "torque", kind="form") for n in ("wave", "function"))]
    found = read([model(0.1, "load", "~wave"), model(0.0, "load", "~function"), model(-30.0)], units)
    assert (found.verdict, found.forms, found.left) == ("partly", (), ("remainder:torque",))
    assert found.places["torque"] > 0.999 and not found.remainders
    perhaps = read([model(0.0, "load"), model(-1.0, "load", "~wave"), model(-30.0)], units)
    assert (perhaps.verdict, perhaps.left) == ("explained", ()) and 0.2 < perhaps.places["torque"] < 0.3


def test_where_a_form_or_an_effect_is_sure_but_not_which_something_is_unknown_there():
    units = [unit("gain", "electrical"), unit("~function", "electrical_a", kind="form")]
    either = read([model(0.0, "~function"), model(-1.0, "gain"), model(-30.0)], units)
    assert (either.verdict, either.named, either.forms, possible_place(either)) == ("unknown", (), (), "electrical_a")
    assert either.empty < 1e-9 and 0.7 < either.unknown < 0.8
    neither = read([model(0.0), model(-2.0, "~function")], units)
    assert neither.verdict == "no_gap" and 0.8 < neither.empty < 0.9
    of_controller = [unit("~controller_filter", "control", kind="form")]
    assert read([model(0.0, "~controller_filter"), model(-0.5)], of_controller).verdict == "no_gap"


def log_evidence(tolerances, *hole):
    """Of a calibration effect over no effect, of a unit that many tolerances off, with a hole in its prior or none."""
    within, information = 0.1, 1e5  # of the wide prior
    # the tolerance is a nuisance with the very same column, marginalised
    known = information / (1.0 + information * within**2)
    reduced = Reduced(["scale+"], np.array([[known]]), np.array([known * tolerances * within]), 0.0, np.zeros(1))
    candidate = Candidate(
        np.zeros(1, int), np.zeros(1), np.ones(1), np.zeros(1, int), (1.0,), ["scale+"],
        within * np.outer([-1.0, 1.0], hole), within * np.ones(len(hole)),
    )  # fmt: skip
    search = Search(reduced, [unit("scale", "torque", kind="calibration")], {("scale", 0): candidate})
    return search.fit((("scale", 0),)).log_likelihood - search.fit(()).log_likelihood


def test_a_unit_within_four_tolerances_hardly_speaks_for_its_calibration():
    assert log_evidence(2.0, 4.0) < log_evidence(2.0) - 2.0
    assert log_evidence(6.0, 4.0) == pytest.approx(log_evidence(6.0), abs=0.5)
    assert log_evidence(6.0, 4.0) > 10.0


def test_what_is_known_of_a_unit_s_value_decides_on_which_side_of_four_tolerances_it_is():
    """Known to a thirtieth of a tolerance, of which the prior's width within and beyond must not make a whole one."""
    assert log_evidence(3.7, 4.0) < log_evidence(3.7) - 15.0
    assert log_evidence(4.3, 4.0) > log_evidence(4.3)


def held(
    monkeypatch,
    misfit,
    whole,
    explored,
    named,
    another=-np.inf,
    change=-50.0,
    dispersion=1.0,
    wandering=(),
    left=40.0,
):
    """What held-out misfits, by set, make of the sets of all recordings and of the explored ones; ``left``: that of a
    remainder in the place of a name."""
    misfit = {("remainder:torque",): left, **misfit}
    units = {
        "load_spring": unit("load_spring", "torque"), "load": unit("load", "torque"),
        "~order": unit("~order", "torque", kind="form"),
        "remainder:torque": unit("remainder:torque", "torque", kind="remainder"),
    }  # fmt: skip
    everything = SimpleNamespace(
        models=whole,
        search=SimpleNamespace(
            fit=lambda members: model(-50.0, *(u for u, _ in members)),
            less=lambda m, out: model(-10.0, *(u for u in m.units if u != out)),
            log_prior=lambda members: -2.0 * len(members),
            candidates={("remainder:torque", 0): None}, units=units,
        ),
    )  # fmt: skip
    search = SimpleNamespace(
        fit=lambda members: model(-2.0, *(u for u, _ in members)),
        less=lambda m, out: model(-2.0, *(u for u in m.units if u != out)),
        candidates={("remainder:torque", 0): None}, units=units,
    )  # fmt: skip
    monkeypatch.setattr(held_out, "overdispersion", lambda every, whole, leading, unit: dispersion)
    monkeypatch.setattr(predicted, "_misfit", lambda explored, m, out="": misfit[tuple(u for u in m.units if u != out)])
    monkeypatch.setattr(held_out, "log_odds_of_change", lambda bench, fit, m, effect: change)
    monkeypatch.setattr(held_out, "log_odds_of_another_cause", lambda fit, m, effect, lacking: another)
    explored = held_out.Explored(None, SimpleNamespace(models=explored, search=search), None)
    kept, found = held_out.held_to_account(None, everything, named, explored, dict(wandering))
    return kept, found.ratios, found.changes


def test_a_name_that_predicts_the_held_out_part_worse_loses_its_odds(monkeypatch):
    misfit = {("load_spring",): 130.0, (): 100.0}
    whole = [model(0.0, "load_spring"), model(-50.0)]
    explored = [model(0.0, "load_spring"), model(-2.0)]
    kept, ratios, _ = held(monkeypatch, misfit, whole, explored, ["load_spring"])
    assert ratios == {"load_spring": -15.0} and kept[0].units == ("remainder:torque",)
    # the confirm recordings have to speak for a remainder as well
    kept, _, _ = held(monkeypatch, misfit, whole, explored, ["load_spring"], left=96.0)
    assert kept[0].units == ()
    misfit["load_spring",] = 80.0
    kept, ratios, _ = held(monkeypatch, misfit, whole, explored, ["load_spring"])
    assert ratios == {"load_spring": 10.0} and kept[0].units == ("load_spring",)


def test_a_name_that_neither_part_speaks_for_is_none(monkeypatch):
    misfit = {("load_spring",): 99.0, (): 100.0}
    whole, explored = [model(0.0, "load_spring"), model(-50.0)], [model(-8.0, "load_spring"), model(0.0)]
    kept, ratios, _ = held(monkeypatch, misfit, whole, explored, ["load_spring"])
    assert ratios == {"load_spring": 0.5} and kept[0].units == ()
    named = [m for m in kept if "load_spring" in m.units]
    assert kept[0].log_posterior - named[0].log_posterior == pytest.approx(7.5)


@pytest.mark.parametrize(("misfit", "named"), [(98.0, ()), (60.0, ("load_spring",))])
def test_beside_what_no_set_explains_the_held_out_part_decides_by_itself(monkeypatch, misfit, named):
    """The odds that the explored recordings give a set say nothing of its truth where none is true."""
    whole = [model(0.0, "load_spring"), model(-50.0)]
    part = {("load_spring",): misfit, (): 100.0}
    for wandering, expected in (({}, ("load_spring",)), ({"electrical_a": 9.0}, named)):
        kept, _, _ = held(monkeypatch, part, whole, [*whole], ["load_spring"], wandering=wandering)
        assert kept[0].units == expected
    # the controller's own business is beside nothing
    kept, _, _ = held(monkeypatch, part, whole, [*whole], ["load_spring"], wandering={"control": 9.0})
    assert kept[0].units == ("load_spring",)


def test_a_name_that_the_explored_recordings_cannot_have_keeps_its_odds(monkeypatch):
    whole = [model(0.0, "load_spring"), model(-50.0)]
    kept, ratios, _ = held(monkeypatch, {(): 100.0}, whole, [model(0.0)], [])
    assert ratios == {"load_spring": 0.0} and kept[0].units == ("load_spring",)
    assert all(np.isfinite(m.log_posterior) for m in kept)


def test_members_of_a_group_are_held_to_account_together(monkeypatch):
    misfit = {("load_spring",): 80.0, (): 100.0}
    whole = [model(0.0, "load_spring"), model(-0.2, "load"), model(-50.0)]
    explored = [model(0.0, "load_spring"), model(-0.2, "load"), model(-9.0)]
    kept, ratios, changes = held(monkeypatch, misfit, whole, explored, [])
    assert set(ratios) == set(changes) == {"load_spring", "load"} and kept[0].units == ("load_spring",)
    kept, _, _ = held(monkeypatch, misfit, whole, explored, [], change=4.0)
    assert kept[0].units == ("remainder:torque",)


def test_a_name_that_has_another_size_in_each_recording_loses_its_odds(monkeypatch):
    misfit = {("load_spring",): 80.0, (): 100.0}
    whole, explored = [model(0.0, "load_spring"), model(-50.0)], [model(0.0, "load_spring"), model(-2.0)]
    kept, _, changes = held(monkeypatch, misfit, whole, explored, ["load_spring"], change=4.0)
    assert changes == {"load_spring": 4.0} and kept[0].units == ("remainder:torque",)
    named = [m for m in kept if "load_spring" in m.units]
    assert kept[0].log_posterior - named[0].log_posterior == pytest.approx(4.0)


def test_a_name_that_has_any_form_loses_its_odds(monkeypatch):
    misfit = {("load_spring",): 80.0, (): 100.0}
    whole, explored = [model(0.0, "load_spring"), model(-50.0)], [model(0.0, "load_spring"), model(-2.0)]
    kept, _, _ = held(monkeypatch, misfit, whole, explored, ["load_spring"], another=4.0)
    assert kept[0].units == ("remainder:torque",)


def test_a_name_whose_score_is_overdispersed_is_told_by_less(monkeypatch):
    misfit = {("load_spring",): 80.0, (): 100.0}
    whole = [replace(model(0.0, "load_spring"), log_likelihood=2.0), model(-10.0)]
    explored = [model(0.0, "load_spring"), model(-2.0)]
    kept, _, _ = held(monkeypatch, misfit, whole, explored, ["load_spring"], dispersion=4.0)
    odds = np.logaddexp.reduce([m.log_posterior for m in kept if "load_spring" in m.units])
    odds -= np.logaddexp.reduce([m.log_posterior for m in kept if not m.units])
    assert odds == pytest.approx(-2.0 + 12.0 / 4.0, abs=1e-3)  # odds of the prior, and a quarter of the ratio


@pytest.mark.parametrize(("after", "told"), [(99.0, False), (80.0, True)])
def test_a_described_form_is_told_where_the_held_out_part_confirms_it(monkeypatch, after, told):
    misfit = {("~order",): after, (): 100.0}
    whole = [model(0.0, "~order"), model(-50.0)]
    kept, ratios, _ = held(monkeypatch, misfit, whole, [model(0.0, "~order"), model(-2.0)], [])
    assert ratios["~order"] == 0.5 * (100.0 - after)
    assert ("~order" in kept[0].units) == told
    if not told:
        assert all("~order" not in m.units for m in kept)


@pytest.mark.parametrize(("after", "told"), [(99.0, False), (80.0, True)])
def test_a_remainder_is_told_where_the_held_out_part_confirms_it(monkeypatch, after, told):
    misfit = {("remainder:torque",): after, (): 100.0}
    whole = [model(0.0, "remainder:torque"), model(-1.0, "load_spring"), model(-9.0)]
    explored = [model(0.0, "remainder:torque"), model(-2.0)]
    kept, ratios, _ = held(monkeypatch, misfit, whole, explored, [])
    assert ratios == {"remainder:torque": 0.5 * (100.0 - after)}
    assert (kept[0].units == ("remainder:torque",)) == told
    if not told:  # its mass is that of nothing
        assert all("remainder:torque" not in m.units for m in kept) and kept[0].units == ()


def test_a_remainder_that_the_explored_recordings_never_had_is_not_told(monkeypatch):
    whole = [model(0.0, "remainder:torque"), model(-9.0)]
    kept, ratios, _ = held(monkeypatch, {(): 100.0}, whole, [model(0.0)], [])
    assert ratios == {"remainder:torque": 0.0} and kept[0].units == ()


def test_remainders_are_integrated_over_what_the_explored_recordings_leave_open():
    """The predictive density of the confirm recordings is that of a Gaussian with the remainder's posterior in its
    covariance."""
    rng = np.random.default_rng(3)
    rows, width = 30, 0.3
    names = ["remainder.torque.0.0", "remainder.torque.0.1", "remainder.torque.0.0@last"]
    X, y = rng.standard_normal((rows, 3)), rng.standard_normal(rows)
    M = np.array([[40.0, 3.0], [3.0, 2.0]])
    gram = np.column_stack([X, y]).T @ np.column_stack([X, y])
    ladder = SimpleNamespace(
        blocks=lambda *a, remainders, **k: [White("last", "torque", names, gram, rows)] if remainders else [],
        recordings=["last"],
    )
    candidate = Candidate(
        np.arange(3), np.zeros(3), np.ones(3), np.zeros(3, int), (width,), [*names[:2], "remainder.torque.0.0@first"]
    )
    search = SimpleNamespace(
        candidates={("remainder:torque", 0): candidate},
        units={"remainder:torque": unit("r", "torque", kind="remainder")},
        reduced=Reduced(names[:2], M, np.zeros(2), 0.0, np.zeros(2)),
    )  # fmt: skip
    bench = SimpleNamespace(inserted=lambda m, normal: SimpleNamespace(values={}))
    left = Model((Choice("remainder:torque", 0, width),))
    explored = held_out.Explored(bench, SimpleNamespace(search=search, normal=None), ladder)
    found = predicted._misfit(explored, left)
    posterior = np.zeros((3, 3))
    posterior[:2, :2] = np.linalg.inv(M + np.eye(2) / width**2)
    posterior[2, 2] = width**2
    covariance = np.eye(rows) + X @ posterior @ X.T
    assert found == pytest.approx(y @ np.linalg.solve(covariance, y) + np.linalg.slogdet(covariance)[1])


def test_what_is_named_in_place_of_a_name_is_held_to_account_as_well(monkeypatch):
    misfit = {("load_spring",): 130.0, (): 100.0}
    whole = [model(0.0, "load_spring"), model(-50.0)]
    _, ratios, _ = held(monkeypatch, misfit, whole, [model(0.0, "load_spring"), model(-2.0)], [])
    assert ratios == {"load_spring": -15.0}


def test_what_may_be_the_controllers_alone_is_no_gap_of_the_machine():
    units = [unit("late", "control"), unit("load", "torque")]
    for other, verdict in (("late", "no_gap"), ("load", "unknown")):
        weak = [model(0.0, other), model(-0.2)]  # 0.55 to 0.45
        assert read(weak, units).verdict == verdict
    left = [model(0.0, "late", "remainder:bus"), model(-0.2, "remainder:bus")]
    assert read(left, [*units, unit("remainder:bus", "bus", kind="remainder")]).verdict == "unknown"

"""Scores of verdicts that name by inclusion and describe what no catalogue lists, written by hand."""

import pytest

from emafault.withheld import verdicts
from emafault.withheld.disturbances import Unlisted
from emafault.withheld.scoreboard import write_scoreboard
from emafault.withheld.scoring import score_rows
from emafault.withheld.verdicts import first_answer, judge, listed_names

from .test_scoring import COGGING, LOAD, key_of, verdict_of

ORDER = Unlisted("bearing_order", 0.5, 11)


@pytest.fixture(autouse=True)
def distances(monkeypatch):
    near = {"friction_asymmetry": 2.0}
    monkeypatch.setattr(verdicts, "rival_distances", lambda key, rivals: {r: near.get(r, 40.0) for r in rivals})


def mixed(effects, *unlisted, rung="T7", plain=False, controller=()):
    """A key with something unlisted at a squared distance of 400."""
    key = key_of(effects, rung)
    key["case"] |= {"plain": plain, "controller": dict(controller)}
    return key | {"unlisted": [] if plain else [u.told(400.0) for u in unlisted]}


def said(kind, inclusion=None, discovered=(), groups=(), which=None):
    """A verdict that names by inclusion."""
    named = [e for e, p in (inclusion or {}).items() if p >= 0.9]
    sets = which or [(named, 0.95), ([], 0.05)]
    return verdict_of(kind, sets, groups, inclusion=inclusion or {}, discovered=list(discovered))


def described(form="order", equation="torque", along="order", amplitude=0.0101, **more):
    found = {"order": Unlisted("bearing_order", 0.5, 11).acting().parameters["order"][0], "amplitude": amplitude}
    values = {n: {"value": v, "low": v, "high": v, "units": "1"} for n, v in found.items()}
    return {"form": form, "equation": equation, "along": along, "parameters": values, "probability": 0.98, **more}


def metrics(*rows):
    return {m["id"]: m["value"] for m in score_rows(rows)["metrics"]}


def test_named_is_an_inclusion_of_nine_tenths_or_a_group():
    verdict = said("partly", {"cogging": 0.93, "stribeck": 0.89}, which=[(["cogging", "stribeck"], 0.8), ([], 0.2)])
    assert first_answer(verdict).effects == ("cogging",) and listed_names(verdict) == ("cogging",)
    verdict = said("group", {"cogging": 0.93, "load_constant": 0.5}, groups=[["friction_asymmetry", "load_constant"]])
    assert listed_names(verdict) == ("cogging", "friction_asymmetry", "load_constant")
    assert judge(mixed(COGGING, ORDER), said("described", discovered=[described()]))["all_named"] is False


def test_listed_effects_beside_something_unlisted():
    both = {"cogging": 0.95, "stribeck": 0.92}
    right = judge(mixed(COGGING, ORDER), said("partly", {"cogging": 0.95}, [described()]))
    another = judge(mixed(COGGING, ORDER), said("partly", both, [described()]))
    assert (right["all_named"], right["another"]) == (True, False)
    assert (another["all_named"], another["beside"]) == (True, ["stribeck"])
    grouped = said("group", {"load_constant": 0.5}, groups=[["friction_asymmetry", "load_constant"]])
    row = judge(mixed(LOAD, ORDER), grouped)
    assert row["all_named"] and not row["another"]
    far = judge(mixed(LOAD, ORDER), said("group", {}, groups=[["load_constant", "stribeck"]]))
    assert not far["all_named"] and far["beside"] == ["stribeck"]
    half = said("partly", {"load_constant": 0.5}, groups=[["friction_asymmetry", "load_constant"]])
    half = judge(mixed({**COGGING, **LOAD}, ORDER), half)  # a group is near whether or not the other effect is found
    assert not half["all_named"] and not half["another"]
    lost = judge(mixed(COGGING, ORDER), said("unknown", {"cogging": 0.6}))
    twins = [judge(mixed(COGGING, plain=True), said("explained", {"cogging": 0.99})) for _ in range(1)]
    found = metrics(right, another, lost, *twins)
    assert found["named_t7"] == pytest.approx(2 / 3) and found["beside_t7"] == pytest.approx(1 / 3)
    assert found["loss_t7"] == pytest.approx(1 / 3) and found["without_t7"] == 1.0
    assert found["several_t7"] is None
    two = judge(mixed({**COGGING, **LOAD}, ORDER), said("partly", {"cogging": 0.95}))
    assert metrics(two)["several_t7"] == 0.0 and metrics(two)["named_t7"] is None


def test_what_is_described_is_compared_with_the_key():
    row = judge(mixed({}, ORDER, rung="T8"), said("described", discovered=[described()]))
    assert row["unlisted"][0] | {"size": 0} == {
        "name": "bearing_order", "inside": True, "distance": 400.0, "size": 0, "detectable": True,
        "equation_right": True, "form_right": True, "parameters_right": True,
    }  # fmt: skip
    for change in ({"form": "bump"}, {"along": "time"}, {"equation": "electrical_a"}):
        one = judge(mixed({}, ORDER, rung="T8"), said("described", discovered=[described(**change)]))["unlisted"][0]
        assert not one["form_right"] and one["equation_right"] is ("equation" not in change)
    wrong = judge(mixed({}, ORDER, rung="T8"), said("described", discovered=[described(amplitude=0.012)]))
    assert wrong["unlisted"][0]["parameters_right"] is False
    seal = Unlisted("seal", 0.5, 3)
    unknown = said("unknown", which=[(["unknown"], 0.9, {"equation": "torque"}), ([], 0.1)])
    outside = judge(mixed({}, seal, rung="T8"), unknown)
    named = judge(mixed({}, seal, rung="T8"), said("explained", {"stribeck": 0.95}))
    found = metrics(row, wrong, outside, named)
    assert (found["form_t8"], found["parameters_t8"]) == (1.0, 0.5)
    assert (found["equation_t8"], found["wrong_t8"]) == (0.5, 0.5)


def test_what_is_described_and_not_there_is_a_false_discovery():
    nothing = judge(key_of({}, "T0"), said("described", discovered=[described()]))
    own = judge(key_of(COGGING), said("explained", {"cogging": 1.0}, [described(another_form_of="cogging")]))
    control = judge(key_of({}, "T0"), said("no_gap", discovered=[described(form="controller", equation="control")]))
    assert [r["false_claims"] for r in (nothing, own, control)] == [1, 0, 0]
    assert [r["claimed"] for r in (nothing, own, control)] == [True, True, False]
    assert metrics(nothing, own, control)["false_share"] == 0.5
    beside = [described(), described(form="bump"), described(form="remainder"), described(equation="bus")]
    within, without = mixed({}, ORDER, rung="T8"), mixed({}, Unlisted("seal", 0.5, 3), rung="T8")
    assert [judge(key, said("described", discovered=beside))["false_claims"] for key in (within, without)] == [2, 1]


def test_a_left_out_effect_that_is_described_is_right_and_a_listed_name_is_not():
    key = key_of(COGGING, "T3", left_out=["cogging"])
    right = judge(key, said("described", discovered=[described()], which=[([], 0.9), (["unknown"], 0.1)]))
    assert right["right"] and right["confident_right"] and right["equation_right"] and not right["wrong_name"]
    assert right["unknown"] == pytest.approx(1.0)
    wrong = judge(key, said("partly", {"stribeck": 0.95}, [described()]))
    assert not wrong["right"] and wrong["wrong_name"]


def test_another_controller_is_held_against_the_nominal_one():
    def pair(verdict, inclusion, discovered=()):
        off = judge(mixed(COGGING, rung="T9", controller={"speed_gain": 1.4}), said(verdict, inclusion, discovered))
        return off, judge(mixed(COGGING, rung="T9", plain=True), said("explained", {"cogging": 0.99, "inertia": 0.02}))

    control = described(form="controller", equation="control")
    same = metrics(*pair("partly", {"cogging": 0.96, "inertia": 0.02}, [control]))
    assert same["same_t9"] == 1.0 and same["inclusion_t9"] == pytest.approx(0.03)
    moved = metrics(*pair("partly", {"cogging": 0.99, "inertia": 0.6, "control_delay": 0.8}, [described()]))
    assert moved["same_t9"] == 0.0 and moved["inclusion_t9"] == pytest.approx(0.58)


def test_a_diagnosis_that_failed_is_wrong_and_shown(tmp_path):
    row = judge(key_of(COGGING), {"verdict": "failed", "which": [], "error": "ValueError: no"})
    assert row["failed"] and not row["right"] and metrics(row)["failed"] == 1.0
    rows = [row, judge(mixed(COGGING, ORDER), said("partly", {"cogging": 0.95}, [described()]))]
    rows[0]["nearest_rival"] = {"effect": "stribeck", "distance": 12.0}
    page = write_scoreboard(score_rows(rows) | {"missing": []}, tmp_path).read_text()
    assert "bearing order" in page and "Nearest rival" in page

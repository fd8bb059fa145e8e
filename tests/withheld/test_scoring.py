"""Scores of verdicts written by hand, for which every figure is known beforehand."""

import json

import numpy as np
import pytest

from emafault.errors import InputError
from emafault.withheld import scoreboard, verdicts
from emafault.withheld.cases import draw_case
from emafault.withheld.metrics import area_under_curve, calibration_error
from emafault.withheld.scoreboard import write_scoreboard
from emafault.withheld.scoring import score, score_rows
from emafault.withheld.verdicts import Answer, first_answer, is_right, judge, names_truth


def key_of(effects, rung="T1", distance=100.0, left_out=(), strong=False):
    """A key with one unknown recording, of a fault vector N_a = 0.02, dT = 30."""
    case = draw_case("T0", 0).to_dict()
    plan = {**case["recordings"][0], "health": "unknown", "fault": [0.02, 0.0, 0.0, 0.0, 0.0, 30.0]}
    case |= {"rung": rung, "effects": effects, "recordings": [plan], "left_out": list(left_out)}
    case |= {"amplitude": 0.5, "strong_faults": strong}
    distances = {"nominal": distance, "members": dict.fromkeys(effects, distance)} if effects else None
    return {"case": case, "detectability": distances, "fault_sd": [[0.01] * 6]}


def verdict_of(kind, sets, groups=(), **more):
    """A verdict whose ``which`` holds (effects, probability) or (effects, probability, more of the entry)."""
    which = [{"effects": list(s[0]), "probability": s[1], "group": None, **(s[2] if len(s) > 2 else {})} for s in sets]
    return {"bench": "b", "verdict": kind, "which": which, "groups": [list(g) for g in groups], **more}


COGGING = {"cogging": {"a": 0.005}}
LOAD = {"load_constant": {"T": 5.0}}


def test_naming():
    assert names_truth(("cogging",), ("cogging",))
    assert names_truth(("cogging", "inertia"), ("cogging",))  # a calibration effect beside it names no cause
    assert not names_truth(("cogging", "stribeck"), ("cogging",))
    assert names_truth(("inertia", "backlash"), ("inertia",))
    assert not names_truth(("backlash",), ("inertia",))
    assert not names_truth(("inertia", "stribeck"), ("inertia",))
    assert not names_truth((), ("cogging",))


def test_answers():
    named = first_answer(verdict_of("explained", [(["cogging"], 0.9), ([], 0.1)]))
    assert named == Answer("named", ("cogging",), 0.9)
    sets = [(["friction_asymmetry"], 0.5, {"group": 0}), (["load_constant"], 0.4, {"group": 0}), (["unknown"], 0.1)]
    grouped = first_answer(verdict_of("group", sets, [["friction_asymmetry", "load_constant"]]))
    assert grouped.kind == "group" and grouped.effects == ("friction_asymmetry", "load_constant")
    assert grouped.probability == pytest.approx(0.9)
    assert first_answer(verdict_of("unknown", [(["unknown"], 0.6), (["cogging"], 0.4)])).kind == "unknown"
    assert first_answer(verdict_of("no_gap", [([], 0.99)])) == Answer("no_gap", (), 0.99)


def test_a_group_is_right_only_if_all_of_it_is_near():
    group = Answer("group", ("friction_asymmetry", "load_constant"), 0.9)
    assert is_right(group, key_of(LOAD), {"friction_asymmetry": 5.9})
    assert not is_right(group, key_of(LOAD), {"friction_asymmetry": 6.1})
    assert not is_right(group, key_of(COGGING), {"friction_asymmetry": 1.0, "load_constant": 1.0})
    assert not is_right(Answer("group", ("load_constant", "unknown"), 0.9), key_of(LOAD), {})


def test_a_group_of_sets_is_no_exact_name_but_right_as_a_group_if_all_of_it_is_near(monkeypatch):
    sets = [(["cogging", other], 0.48, {"group": 0}) for other in ("load_constant", "friction_asymmetry")]
    verdict = verdict_of("group", sets, [["cogging", "friction_asymmetry", "load_constant"]])
    for distance, near in ((5.9, True), (6.1, False)):
        monkeypatch.setattr(verdicts, "rival_distances", lambda key, rivals, d=distance: dict.fromkeys(rivals, d))
        row = judge(key_of({**COGGING, **LOAD}, "T2"), verdict)
        assert not row["right"] and row["in_group"] is near
    row = judge(key_of({**LOAD, "stribeck": {"a": 0.01, "w_s": 6.0}}, "T2"), verdict)
    assert not row["in_group"]


def test_unknown_and_no_gap():
    assert not is_right(Answer("unknown", ("unknown",), 1.0), key_of(COGGING), {})
    assert is_right(Answer("unknown", ("unknown",), 1.0), key_of(COGGING, "T3", left_out=("cogging",)), {})
    assert is_right(Answer("no_gap", (), 1.0), key_of({}, "T0"), {})
    row = judge(key_of({}, "T0"), verdict_of("explained", [(["cogging"], 0.9)]))
    assert row["wrong_name"] and not row["right"]
    row = judge(key_of({}, "T0"), verdict_of("unknown", [(["unknown"], 0.9)]))
    assert not row["wrong_name"] and not row["right"]


def test_coverage_and_equation(monkeypatch):
    monkeypatch.setattr(verdicts, "rival_distances", lambda key, rivals: dict.fromkeys(rivals, 40.0))
    inside = {"parameters": {"a": {"value": 0.004, "low": 0.003, "high": 0.006, "units": "N m"}}}
    outside = {"parameters": {"a": {"value": 0.002, "low": 0.001, "high": 0.003, "units": "N m"}}}
    for entry, hit in ((inside, [True]), (outside, [False]), ({}, [])):
        row = judge(key_of(COGGING), verdict_of("explained", [(["cogging"], 1.0, entry)]))
        assert row["covered"] == hit and row["right"]
    turned = {"dynamic_eccentricity": {"d": 0.02, "psi": -3.1}}
    entry = {"parameters": {"psi": {"value": 3.15, "low": 3.0, "high": 3.3, "units": "rad"}}}
    assert judge(key_of(turned), verdict_of("explained", [(list(turned), 1.0, entry)]))["covered"] == [True]
    for equation, right in (("torque", True), ("electrical_b", False)):
        verdict = verdict_of("unknown", [(["unknown"], 0.7, {"equation": equation}), ([], 0.3)])
        row = judge(key_of(COGGING, "T3", left_out=("cogging",)), verdict)
        assert row["equation_right"] is right and row["right"]


def test_ladder_and_fault_vector():
    ladder = {"nominal": 9.0, "recalibrated": 3.0, "placebo": 2.9, "after": 1.1, "floor": 1.0, "closed": 0.97}

    def faults(na, dT):
        values = {n: {"value": 0.0} for n in ("Na", "Nb", "Nc", "xi_x", "xi_y", "dT")}
        return values | {"Na": {"value": na}, "dT": {"value": dT}}

    vectors = {"recording_0.nc": {"before": faults(0.06, 30.0), "after": faults(0.02, 30.0)}}
    row = judge(
        key_of(COGGING), verdict_of("explained", [(["cogging"], 1.0)], shrinks={"signal": ladder}, fault_vector=vectors)
    )
    assert row["signal"] == {"recalibrated": 9.0, "placebo": 2.9**2, "after": 1.1**2, "floor": 1.0}
    assert row["features"] is None
    assert row["fault_vector"]["before"] == pytest.approx(0.4**2)
    assert row["fault_vector"]["after"] == pytest.approx(0.0)
    assert row["fault_vector"]["bound"] == pytest.approx(6 * 0.01**2)
    assert row["fault_vector"]["oracle"] is None  # no told diagnosis was run
    told = {"fault_vector": {"recording_0.nc": {"after": faults(0.03, 30.0)}}}
    verdict = verdict_of("explained", [(["cogging"], 1.0)], fault_vector=vectors)
    assert judge(key_of(COGGING), verdict, told)["fault_vector"]["oracle"] == pytest.approx(0.01)
    assert judge(key_of(COGGING), verdict, {"fault_vector": {}})["fault_vector"]["oracle"] is None
    values = {m["id"]: m["value"] for m in score_rows([row])["metrics"]}
    assert values["closed_faults"] is None and values["fault_ratio"] is None
    assert values["closed_faults_bound"] == pytest.approx(0.16 / (0.16 - 6e-4))
    row = judge(key_of(COGGING), verdict, told)
    row["signal"] = {"recalibrated": 9.0, "placebo": 2.9**2, "after": 1.1**2, "floor": 1.0}
    values = {m["id"]: m["value"] for m in score_rows([row])["metrics"]}
    assert values["closed_signal"] == pytest.approx((9.0 - 1.21) / 8.0)
    assert values["placebo"] == pytest.approx((9.0 - 2.9**2) / 8.0)
    assert values["closed_faults"] == pytest.approx(0.16 / (0.16 - 0.01))
    assert values["fault_ratio"] == pytest.approx(0.0)


def test_curve_and_calibration():
    rows = [{"left_out": ["x"], "unknown": u} for u in (0.9, 0.4)] + [
        {"left_out": [], "unknown": u} for u in (0.1, 0.5)
    ]
    assert area_under_curve(rows) == pytest.approx(0.75)
    assert area_under_curve(rows[:2]) is None
    rows = [{"confidence": 0.95, "confident_right": c} for c in (True,) * 9 + (False,)]
    assert calibration_error(rows) == pytest.approx(0.05)


def test_errors_of_probabilities_on_both_sides_do_not_cancel():
    rows = [{"confidence": 0.75, "confident_right": c} for c in (True,) * 9 + (False,)]
    rows += [{"confidence": 0.95, "confident_right": c} for c in (True,) * 8 + (False,) * 2]
    assert calibration_error(rows) == pytest.approx(0.15)
    assert calibration_error(rows[:10]) == pytest.approx(0.15)  # too modest is an error like too sure


def test_a_group_is_as_right_for_its_probability_as_it_is_for_its_answer(monkeypatch):
    sets = [([e], 0.48, {"group": 0}) for e in ("load_constant", "friction_asymmetry")]
    verdict = verdict_of("group", sets, [["friction_asymmetry", "load_constant"]])
    for distance, right in ((5.9, True), (6.1, False)):
        monkeypatch.setattr(verdicts, "rival_distances", lambda key, rivals, d=distance: dict.fromkeys(rivals, d))
        row = judge(key_of(LOAD), verdict)
        assert row["right"] is right and row["confident_right"] is right and row["confidence"] == pytest.approx(0.96)


@pytest.mark.parametrize(("distance", "detectable"), [(24.0, False), (26.0, True), (99.0, True)])
def test_detectable_is_a_squared_distance_of_25(distance, detectable):
    row = judge(key_of(COGGING, distance=distance), verdict_of("no_gap", [([], 1.0)]))
    assert row["detectable"] is detectable


def test_cases_of_one_bench_are_drawn_again_together():
    """T3 diagnoses benches of T1 again; as independent cases their shares would look surer than they are."""
    named = verdict_of("explained", [(["cogging"], 1.0)])
    rows = []
    for seed in range(12):
        key = key_of(COGGING)
        key["case"]["seed"] = seed
        rows.append(judge(key, verdict_of("no_gap", [([], 1.0)]) if seed % 2 else named))
    once = {m["id"]: m for m in score_rows(rows)["metrics"]}["right_t1"]
    doubled = {m["id"]: m for m in score_rows([r for r in rows for _ in range(8)])["metrics"]}["right_t1"]
    assert doubled["high"] - doubled["low"] == pytest.approx(once["high"] - once["low"], abs=0.1)
    assert rows[0]["bench"] == judge(key_of(COGGING, "T3", left_out=["cogging"]), named)["bench"]


def test_score_of_a_folder(tmp_path, monkeypatch):
    monkeypatch.setattr(verdicts, "rival_distances", lambda key, rivals: dict.fromkeys(rivals, 40.0))
    named = verdict_of("explained", [(["cogging"], 0.9), ([], 0.1)])
    none = verdict_of("no_gap", [([], 0.95), (["cogging"], 0.05)])
    unknown = verdict_of("unknown", [(["unknown"], 0.8, {"equation": "torque"}), ([], 0.2)])
    both = {**COGGING, **LOAD}
    cases = {
        "t1_1": (key_of(COGGING), named),
        "t1_2": (key_of(LOAD), named),
        "t1_3": (key_of(LOAD, distance=4.0), none),
        "t0_1": (key_of({}, "T0"), none),
        "t0_2": (key_of({}, "T0", strong=True), named),
        "t2_1": (
            key_of(both, "T2"),
            verdict_of("explained", [(["load_constant", "cogging"], 0.7), (["cogging"], 0.3)]),
        ),
        "t2_2": (key_of(both, "T2"), named),
        "t3_1": (key_of(COGGING, "T3", left_out=["cogging"]), unknown),
        "t3_2": (key_of(LOAD, "T3", left_out=["load_constant"]), named),
        "t4_1": (key_of(LOAD, "T4"), None),
    }
    for name, (key, verdict) in cases.items():
        (tmp_path / "keys").mkdir(exist_ok=True)
        (tmp_path / "keys" / f"{name}.json").write_text(json.dumps(key))
        if verdict:
            (tmp_path / "diagnoses" / name).mkdir(parents=True)
            (tmp_path / "diagnoses" / name / "diagnosis.json").write_text(json.dumps(verdict))
    scores = score(tmp_path)
    assert score(tmp_path, processes=2) == scores
    assert scores["missing"] == ["t4_1"]
    metrics = {m["id"]: m for m in scores["metrics"]}
    expected = {
        "right_t1": 0.5, "right_t1_all": 1 / 3, "wrong_t0": 0.5, "no_gap_t0": 0.5, "wrong_t0_weak": 0.0,
        "wrong_t0_strong": 1.0, "pairs_t2": 0.5, "wrong_t3": 0.5, "unknown_t3": 0.5, "equation_t3": 1.0,
        "auroc_t3": 0.75, "apart_t3": 0.5,
    }  # fmt: skip
    for name, value in expected.items():
        assert metrics[name]["value"] == pytest.approx(value), name
        assert metrics[name]["low"] <= value <= metrics[name]["high"]
    assert metrics["right_t4"]["value"] is None
    assert metrics["right_t1"]["cases"] == 2 and not metrics["right_t1"]["good_met"]
    confusion = scores["confusion"]
    counts = np.array(confusion["counts"])
    assert counts.sum() == 2
    assert counts[confusion["truth"].index("load_constant"), confusion["said"].index("cogging")] == 1
    assert scores["hardest"][0]["truth"] == "load_constant" and scores["hardest"][0]["apart"] == 40.0
    page = write_scoreboard(scores, tmp_path / "board").read_text()
    assert "1 cases have no verdict" in page and "right effect or group first" in page
    assert json.loads((tmp_path / "board" / "scores.json").read_text())["missing"] == ["t4_1"]
    assert {p.name for p in (tmp_path / "board").glob("*.png")} >= {"confusion.png", "power.png", "reliability.png"}


def test_a_broken_verdict_is_named(tmp_path):
    (tmp_path / "diagnosis.json").write_text("{}")
    with pytest.raises(InputError, match=r"diagnosis\.json"):
        verdicts.read_verdict(tmp_path / "diagnosis.json")


def test_changes_put_into_measured_recordings_stand_apart_from_effects_left_out():
    row = {"twin": "friction_axis", "case": "emps", "named": ["stribeck"], "right": True, "verdict": "explained"}
    rows = [
        row | {"kind": "put in", "what": "friction higher at low speed"},
        row | {"kind": "left out", "what": "viscous_asymmetry", "named": [], "verdict": "unknown"},
        row | {"kind": "left out", "what": "stribeck", "named": [], "verdict": "partly", "right": False},
    ]
    page = scoreboard._measured(rows)
    assert "1 of 1 right; 0 with the word unknown" in page and "1 of 2 right; 1 with the word unknown" in page
    assert scoreboard._measured([]) == ""

"""Calibration of the probabilities on blind cases whose verdicts are made up here."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from emafault.effects import EFFECTS
from emafault.errors import InputError
from emafault.gap.decide import UNCALIBRATED, Calibration, saturating
from emafault.study import blind
from emafault.study.blind import calibrate, companions, diagnose_bench, run_cases
from emafault.study.curves import DETECTABLE
from emafault.withheld import verdicts

START = Calibration.load(UNCALIBRATED)


def add(folder, name, effects, evidence, left_out=(), named=None):
    """One case and its verdict."""
    case = {"effects": {e: {} for e in effects}, "left_out": list(left_out)}
    detectability = {"nominal": 1e4, "members": dict.fromkeys(effects, 1e4)} if effects else None
    key = {"case": case, "detectability": detectability}
    gain, null_excess, excess, left = evidence
    candidates = [[list(named or effects), gain]] if gain > 0 else []
    found = {"gain": gain, "null_excess": null_excess, "excess": excess, "unexplained": left, "acting": left}
    found |= {"margin": gain, "dof": 100}
    verdict = {"evidence": found | {"candidates": candidates, "held_out": None}, "which": []}
    (folder / "keys").mkdir(parents=True, exist_ok=True)
    (folder / "diagnoses" / name).mkdir(parents=True)
    (folder / "keys" / f"{name}.json").write_text(json.dumps(key))
    (folder / "diagnoses" / name / "diagnosis.json").write_text(json.dumps(verdict))


def fill(folder, wrong):
    """Effect-free cases, and single effects with one and the same clear evidence, ``wrong`` of them misnamed."""
    rng = np.random.default_rng(4)
    for n in range(30):
        add(folder, f"t0_{n}", [], (0.0, 2.0 + 3.0 * rng.random(), 0.0, 1.0))
    for n in range(40):
        misnamed = ["cogging"] if n < wrong else None
        add(folder, f"t1_{n}", ["stribeck"], (200.0, 60.0, 3.0, 1e-3), named=misnamed)


def probability(coefficients, features):
    return 1.0 / (1.0 + np.exp(-np.dot(coefficients, [1.0, *features])))


def test_the_curves_tell_the_cases_apart_and_no_set_gets_more_than_its_kind_had_right(tmp_path):
    fill(tmp_path, wrong=2)
    found = calibrate(tmp_path, START)
    assert probability(found.gap, [0.0, saturating(3.0)]) < 0.2
    assert probability(found.gap, [saturating(200.0), saturating(60.0)]) > 0.95
    assert found.most == pytest.approx(39.0 / 42.0, abs=1e-3)


def test_curves_and_scoreboard_call_the_same_cases_detectable():
    assert DETECTABLE == verdicts.DETECTABLE == 25.0


def test_evidence_counts_one_way_only(tmp_path):
    fill(tmp_path, wrong=0)
    for n in range(15):  # more gain, and wrong: chance must not turn the sense of the gain
        add(tmp_path, f"t4_{n}", ["stribeck"], (900.0, 60.0, 3.0, 1e-3), named=["backlash"])
    found = calibrate(tmp_path, START)
    gain, unexplained, acting, margin = found.right[1:]
    assert min(gain, margin) >= 0.0 >= max(unexplained, acting)
    assert min(found.gap[1:]) >= 0.0


def test_what_the_library_lacks_is_a_gap_only_where_it_leaves_more_than_effect_free_cases_do(tmp_path):
    for name in ("one", "two", "three"):
        fill(tmp_path / name, wrong=0)
    for n in range(30):
        add(tmp_path / "two", f"t3_{n}", ["backlash"], (0.0, 3.0, 3.0, 1.0), left_out=["backlash"])
        add(tmp_path / "three", f"t3_{n}", ["backlash"], (0.0, 15.0 + n, 3.0, 1.0), left_out=["backlash"])
    one, two, three = (calibrate(tmp_path / name, START).gap for name in ("one", "two", "three"))
    assert one == two
    assert probability(three, [0.0, saturating(30.0)]) > max(0.9, probability(one, [0.0, saturating(30.0)]))
    assert probability(three, [0.0, saturating(3.0)]) < 0.2


@pytest.fixture
def asked(monkeypatch):
    """What is asked of the diagnosis, by bench, and benches and keys that hold nothing."""
    calls = []

    def make(rung, seeds, folder, actuator, noise, rivals=False):
        for case in companions(rung, seeds[0]):
            (folder / "benches" / case.bench).mkdir(parents=True, exist_ok=True)
            (folder / "benches" / case.bench / "recording_0.nc").write_text("")
            (folder / "keys").mkdir(exist_ok=True)
            (folder / "keys" / f"{case.name}.json").write_text(json.dumps({"case": case.to_dict()}))

    def diagnose(bench, actuator, noise, by, exclude):
        assert (bench / "recording_0.nc").exists()
        calls.append((bench.name, by, tuple(exclude)))
        if len(exclude) == 1:
            raise InputError("a bench that cannot be used")
        return {"verdict": "no_gap", "which": []}

    monkeypatch.setattr(blind, "make_cases", make)
    monkeypatch.setattr(blind, "diagnose_bench", diagnose)
    return calls


def test_a_case_its_twin_and_the_told_diagnosis_are_each_made_once(asked, tmp_path):
    names = run_cases("T7", [5], tmp_path, None, None, told=[5])
    case, twin = companions("T7", 5)
    others = tuple(e for e in EFFECTS if e not in case.effects)
    assert asked == [(case.bench, "equations", ()), (twin.bench, "equations", ()), (case.bench, "equations", others)]
    assert names == [case.name, twin.name] and not list((tmp_path / "benches").iterdir())
    assert (tmp_path / "oracles" / case.name / "diagnosis.json").exists()
    run_cases("T7", [5], tmp_path, None, None, told=[5])
    assert len(asked) == 3


def test_a_diagnosis_that_fails_is_a_verdict_of_its_own(asked, tmp_path):
    shown, left_out = companions("T1", 5, again=True)
    assert run_cases("T1", [5], tmp_path, None, None, "simulation", again=[5]) == [shown.name, left_out.name]
    assert asked == [(shown.bench, "simulation", ()), (shown.bench, "simulation", left_out.left_out)]
    verdict = json.loads((tmp_path / "diagnoses" / left_out.name / "diagnosis.json").read_text())
    assert verdict["verdict"] == "failed" and "cannot be used" in verdict["error"]
    key = json.loads((tmp_path / "keys" / f"{left_out.name}.json").read_text())
    assert key["case"]["left_out"] == list(shown.effects)


def test_an_unknown_path_is_refused(monkeypatch):
    monkeypatch.setattr(blind, "read_bench", lambda *_: SimpleNamespace(name="b", recordings={}))
    with pytest.raises(InputError, match="by: got 'guessing'"):
        diagnose_bench(None, None, None, "guessing")

"""Blind cases are made, diagnosed and kept; the diagnosis itself is stood in for here."""

import json

import pytest

from emafault.config import withheld_spec
from emafault.effects import EFFECTS
from emafault.errors import InputError
from emafault.study import blind
from emafault.study.blind import companions, run_batch, run_cases
from emafault.study.scored import unpack


@pytest.fixture
def asked(monkeypatch):
    """What is asked of the diagnosis, by bench, and benches and keys that hold nothing."""
    calls = []

    def make(rung, seeds, folder, actuator, noise, rivals, population):
        for case in companions(rung, seeds[0]):
            (folder / "benches" / case.bench).mkdir(parents=True, exist_ok=True)
            (folder / "benches" / case.bench / "recording_0.nc").write_text("")
            (folder / "keys").mkdir(exist_ok=True)
            (folder / "keys" / f"{case.name}.json").write_text(json.dumps({"case": case.to_dict()}))

    def diagnose(bench, actuator, noise, exclude, tolerances):
        assert (bench / "recording_0.nc").exists()
        calls.append((bench.name, tuple(exclude)))
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
    assert asked == [(case.bench, ()), (twin.bench, ()), (case.bench, others)]
    assert names == [case.name, twin.name] and not list((tmp_path / "benches").iterdir())
    assert (tmp_path / "oracles" / case.name / "diagnosis.json").exists()
    left = tmp_path / "benches" / case.bench / "recording_0.nc"  # by a job that was killed once all was diagnosed
    left.parent.mkdir()
    left.write_text("")
    run_cases("T7", [5], tmp_path, None, None, told=[5])
    assert len(asked) == 3 and not left.parent.exists()


def test_a_diagnosis_that_fails_is_a_verdict_of_its_own(asked, tmp_path):
    shown, left_out = companions("T1", 5, again=True)
    assert run_cases("T1", [5], tmp_path, None, None, again=[5]) == [shown.name, left_out.name]
    assert asked == [(shown.bench, ()), (shown.bench, left_out.left_out)]
    verdict = json.loads((tmp_path / "diagnoses" / left_out.name / "diagnosis.json").read_text())
    assert verdict["verdict"] == "failed" and "cannot be used" in verdict["error"]
    key = json.loads((tmp_path / "keys" / f"{left_out.name}.json").read_text())
    assert key["case"]["left_out"] == list(shown.effects)


def test_what_a_job_writes_is_all_that_scoring_needs(asked, tmp_path):
    spec = withheld_spec("smallest", "T7", 0)
    spec["seeds"] |= {"first": 5, "last": 6, "told": [5]}
    run_batch(tmp_path / "made" / "T7_0.json", spec, "0123456789abcdef")
    cases = tmp_path / "made" / "cases_01234567"
    unpack(tmp_path / "made" / "T7_0.json", tmp_path / "elsewhere")
    for folder in ("keys", "diagnoses", "oracles"):
        made = {p.relative_to(cases): p.read_bytes() for p in (cases / folder).rglob("*.json")}
        there = tmp_path / "elsewhere"
        assert made and made == {p.relative_to(there): p.read_bytes() for p in (there / folder).rglob("*.json")}


@pytest.mark.parametrize("content", ["{", "[]", '{"files": {"../outside.json": "x"}}', '{"files": 5}'])
def test_a_file_of_another_kind_is_refused_and_nothing_is_written_outside(tmp_path, content):
    (tmp_path / "batch.json").write_text(content)
    with pytest.raises(InputError, match=r"batch\.json"):
        unpack(tmp_path / "batch.json", tmp_path / "into")
    assert not (tmp_path / "outside.json").exists()

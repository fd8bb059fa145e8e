"""Verdict files and the page of measured machines."""

import json
from pathlib import Path

import pytest

from emafault.errors import InputError
from emafault.study.measured import diagnose_file, file_name, summary

DATA = Path(__file__).parents[2] / "data" / "measured"


def test_a_file_gets_its_verdict_and_page(tmp_path):
    diagnose_file(DATA / "emps" / "emps_estimation.npz", "friction_axis", tmp_path)
    verdict = json.loads((tmp_path / "diagnosis.json").read_text())
    assert verdict["verdict"] in ("explained", "group", "partly", "unknown", "no_gap")
    assert {"bench", "recordings", "where", "which", "groups", "shrinks", "held_out", "notes"} <= set(verdict)
    page = (tmp_path / "report.html").read_text()
    assert "emps_estimation" in page and page.count("<img") == 2


def test_a_file_of_several_machines_gets_a_folder_for_each(tmp_path):
    found = diagnose_file(DATA / "odrive_cogging", "slow_rotation", tmp_path)
    top = json.loads((tmp_path / "diagnosis.json").read_text())
    assert set(top["cases"]) == set(found) == {"cogging_maps", "slow_moves"}
    for case in found:
        assert json.loads((tmp_path / case / "diagnosis.json").read_text()) == top["cases"][case]
        line = summary(case, top["cases"][case])
        assert line[0] == case and all(isinstance(cell, str) for cell in line)


def test_a_wrong_file_writes_nothing(tmp_path):
    with pytest.raises(InputError):
        diagnose_file(DATA / "emps" / "emps_estimation.npz", "back_emf", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_names_of_files_are_plain():
    assert file_name("motor a/b.csv: 1") == "motor_a_b.csv_1"

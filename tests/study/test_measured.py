"""Verdict files and the page of measured machines."""

import json
import shutil
from pathlib import Path

import pytest
import yaml

from emafault.errors import InputError
from emafault.study.measured import diagnose_sets, file_name, summary

DATA = Path(__file__).parents[2] / "data" / "measured"


def diagnosed(folder: Path, sets: list[dict]) -> Path:
    """Folder of what ``diagnose_sets`` writes of a list of sets."""
    listed, out = folder / "sets.yaml", folder / "out"
    for entry in sets:
        shutil.copytree(DATA / entry["folder"], folder / entry["folder"])
    shutil.copy(DATA / "nameplate.yaml", folder)
    listed.write_text(yaml.safe_dump(sets))
    diagnose_sets(listed, out / "report.html", out / "figures", out / "verdicts.json", out / "withheld.json")
    return out


def test_every_case_of_a_set_gets_its_verdict_and_its_place_on_the_page(tmp_path):
    files = ["cogging_maps.npz", "slow_moves.npz"]
    out = diagnosed(tmp_path, [{"folder": "odrive_cogging", "twin": "slow_rotation", "files": files}])
    verdicts = json.loads((out / "verdicts.json").read_text())
    assert list(verdicts) == [f"odrive_cogging/{file}" for file in files]
    page = (out / "report.html").read_text()
    for cases in verdicts.values():
        for case, verdict in cases.items():
            assert verdict["verdict"] in ("explained", "group", "partly", "unknown", "no_gap")
            assert {"recordings", "where", "which", "groups", "shrinks", "held_out", "notes"} <= set(verdict)
            line = summary(case, verdict)
            assert line[0] == case and all(isinstance(cell, str) for cell in line) and case in page
    rows = json.loads((out / "withheld.json").read_text())
    assert {row["twin"] for row in rows} == {"slow_rotation"} and page.count("<img") >= 4


def test_a_wrong_file_writes_nothing(tmp_path):
    with pytest.raises(InputError, match="emps_estimation"):
        diagnosed(tmp_path, [{"folder": "emps", "twin": "back_emf", "files": ["emps_estimation.npz"]}])
    assert not (tmp_path / "out").exists()


def test_names_of_files_are_plain():
    assert file_name("motor a/b.csv: 1") == "motor_a_b.csv_1"

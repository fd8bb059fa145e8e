"""The page docs/actuators.md, run as it stands: from a datasheet to a diagnosis and to other simulators."""

import json
import re
from contextlib import chdir
from pathlib import Path
from xml.etree.ElementTree import parse

import pytest

import pages
from emafault.cli import main
from emafault.datasheet.compose import of_file
from emafault.datasheet.sheet import read_sheet

PAGE = (Path(__file__).parents[2] / "docs" / "actuators.md").read_text()


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """A folder in which every command of the page has been run, and what each printed."""
    folder = tmp_path_factory.mktemp("session")
    (folder / "mine.yaml").write_text(re.search(r"```yaml\n(.*?)```", PAGE, re.S)[1])
    (folder / "healthy").mkdir()
    (folder / "bench").mkdir()
    return folder


@pytest.fixture(scope="module")
def said(session):
    out = {}
    with chdir(session):
        for line in re.findall(r"^    emafault (.*)$", PAGE, re.M):
            code, out[line] = pages.run(f"emafault {line}")
            assert code == 0, line
    return out


def test_the_identified_file_is_the_unit_and_names_its_sources(session, said):
    datasheet, unit = (of_file(session / name) for name in ("mine.yaml", "unit.yaml"))
    factors = {"resistance": 1.04, "coulomb_friction": 0.8, "back_emf": 1.0, "inertia": 1.0, "inductance": 1.0}
    for name, factor in factors.items():
        found = unit.parameters[name]
        off = found.value / (factor * datasheet.parameters[name].value) - 1.0
        assert found.source == "identified" and abs(off) < 3.0 * found.tolerance < 0.02, name
    assert unit.parameters["speed_gain"].value == pytest.approx(datasheet.parameters["speed_gain"].value, rel=0.05)
    assert read_sheet(session / "unit.yaml").numbers["resistance"].datasheet == "0.60 ohm +- 10 %"
    assert unit.parameters["gear_ratio"].source == "datasheet"


def test_the_diagnosis_names_the_effect_with_its_size(session, said):
    verdict = json.loads((session / "verdict" / "diagnosis.json").read_text())
    assert verdict["which"][0]["effects"] == ["cogging"] and not verdict["discovered"]
    a = verdict["which"][0]["parameters"]["a"]
    assert a["low"] < 0.002 < a["high"]


def test_fault_vectors_of_the_diagnosis(session, said):
    text = next(text for line, text in said.items() if "--diagnosis" in line)
    assert "taken out: cogging" in text and "bench/4.nc" in text
    with chdir(session):
        assert main(["identify", "bench/", "--diagnosis", "verdict/diagnosis.json", "--level", "0.5"]) == 0
        assert main(["identify", "healthy/", "--diagnosis", "verdict/diagnosis.json"]) == 2
        assert main(["identify", "bench/", "--diagnosis", "unit.yaml"]) == 2


def test_another_actuator_than_the_file_s_is_refused(session, said, capsys):
    assert main(["diagnose", str(session / "bench"), "--no-tracking"]) == 2
    text = capsys.readouterr().err
    assert text.count("\n") == 1 and "was recorded on another actuator" in text


def test_exports_are_xml(session, said):
    for name in ("hinge.xml", "hinge.urdf"):
        assert parse(session / name).getroot() is not None

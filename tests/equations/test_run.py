"""A bench through the installed command: named, written, handed over, retrained with."""

import json

import jsonschema
import pytest

from emafault.cli import main
from emafault.config import compose, retraining_spec
from emafault.io.recording import write_recording
from emafault.reporting.written import SCHEMA_FILE
from emafault.study.retrain import retrain_network

from .test_diagnose import bench

EFFECT = {"magnet_temperature": {"alpha_m": -8e-4}}


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("magnets")
    for name, recording in bench(EFFECT).items():
        write_recording(folder / "bench" / name, recording)
    assert main(["diagnose", str(folder / "bench"), "--out", str(folder / "out"), "--no-tracking"]) == 0
    return folder


@pytest.fixture(scope="module")
def verdict(written):
    return json.loads((written / "out" / "diagnosis.json").read_text())


def test_the_effect_is_named_and_the_file_follows_its_schema(verdict):
    jsonschema.validate(verdict, json.loads(SCHEMA_FILE.read_text()))
    first = verdict["which"][0]
    assert verdict["verdict"] == "explained" and first["effects"] == ["magnet_temperature"]
    value = first["parameters"]["alpha_m"]
    assert value["value"] == pytest.approx(-8e-4, rel=0.05) and value["low"] < value["value"] < value["high"]


def test_the_schema_refuses_a_probability_above_one(verdict):
    broken = json.loads(json.dumps(verdict))
    broken["which"][0]["probability"] = 1.1
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(broken, json.loads(SCHEMA_FILE.read_text()))


def test_a_placebo_closes_little_of_what_the_effect_closes(verdict):
    signal = verdict["shrinks"]["signal"]
    gap = signal["recalibrated"] ** 2 - signal["after"] ** 2
    assert gap > 0.0 and signal["recalibrated"] ** 2 - signal["placebo"] ** 2 < 0.25 * gap


def test_what_to_record_next_tells_two_readings_apart(verdict):
    assert 0 < len(verdict["next_experiment"]) <= 3
    for entry in verdict["next_experiment"]:
        assert entry["expected_odds"] >= 1.0 and len(set(entry["separates"])) == 2


def test_the_page_needs_nothing_else_and_says_the_finding(written):
    page = (written / "out" / "report.html").read_text()
    assert "What these recordings cannot tell" in page and "Sealed before" in page
    assert page.count("data:image/png;base64,") >= 3 and "http://" not in page and "https://" not in page


def test_the_fix_is_an_experiment_that_composes(written, verdict):
    composed = compose(str(written / "out" / "experiment.yaml"))
    assert composed["effects"]["magnet_temperature"]["alpha_m"] == pytest.approx(-8e-4, rel=0.05)
    unit = verdict["simulator"]["after"]["unit_calibration"]
    assert composed["effects"]["unit_calibration"] == pytest.approx(unit, rel=1e-6)
    assert composed["name"] == "diagnosed_bench"


def test_retraining_takes_the_verdict(written):
    spec = retraining_spec(compose(overrides=["sampling.runs=120", "evaluation.seeds=1"]))
    out = written / "out"
    retrain_network(written / "bench", out, spec, out / "retrained.json")
    found = json.loads((out / "retrained.json").read_text())
    assert found["after"]["rms"] < found["before"]["rms"]
    assert "What retraining brought" in (out / "report.html").read_text()

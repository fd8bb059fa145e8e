"""A bench through the installed command: named, written, handed over, retrained with."""

import json
import re
from dataclasses import replace

import jsonschema
import numpy as np
import pytest

from emafault.cli import main
from emafault.config import compose, diagnosis_spec, retraining_spec
from emafault.equations.run import diagnose_folder
from emafault.errors import InputError
from emafault.io.recording import write_recording
from emafault.reporting.retrained import write_with_section
from emafault.reporting.written import SCHEMA_FILE
from emafault.study.retrain import retrain_network

from .conftest import all_but, bench, recorded

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
    assert "What these recordings leave open" in page and "Sealed before" in page
    assert page.count("data:image/png;base64,") >= 3 and "http://" not in page and "https://" not in page


def test_the_page_has_a_chart_of_every_equation_and_every_fitted_number(written, verdict):
    page = (written / "out" / "report.html").read_text()
    for equation in ("electrical_a", "electrical_b", "electrical_c", "torque", "sensor_speed", "position", "control"):
        assert f'id="panel_{equation}"' in page
    for number in (
        "magnet temperature: temperature coefficient",
        "unit calibration: resistance relative to nominal",
        "inertia: relative to nominal",
        "speed gain",
    ):
        assert f">{number}</td>" in page
    said = re.findall(r'<figure id="(quality|which|how_far|faults)">.*?alt="(.*?)"', page)
    assert len(said) == 4 and all(re.search(r"\d|none", text) for _, text in said)
    falls = re.search(r"Electrical a: the residual over the noise falls from ([\d.]+) to ([\d.]+)", page)
    assert falls and float(falls[2]) < 1.1 < float(falls[1])
    assert len(page) < 3e6


def test_the_fix_is_an_experiment_that_composes(written, verdict):
    composed = compose(str(written / "out" / "experiment.yaml"))
    assert composed["effects"]["magnet_temperature"]["alpha_m"] == pytest.approx(-8e-4, rel=0.05)
    unit = verdict["simulator"]["after"]["unit_calibration"]
    assert composed["effects"]["unit_calibration"] == pytest.approx(unit, rel=1e-6)
    assert composed["name"] == "diagnosed_bench"


def test_retraining_takes_the_verdict(written):
    spec = retraining_spec(compose(overrides=["sampling.runs=120", "evaluation.seeds=1"]))
    out = written / "out"
    files = [out / name for name in ("diagnosis.json", "report.html", "retrained.json", "retrained.html")]
    before = files[1].read_bytes()
    retrain_network(written / "bench", *files[:2], spec, *files[2:])
    found = json.loads((out / "retrained.json").read_text())
    assert found["after"]["rms"] < found["before"]["rms"]
    assert "What retraining brought" in files[3].read_text() and files[1].read_bytes() == before
    with pytest.raises(InputError, match=r"retrained\.html: not the report of a diagnosis"):
        write_with_section(files[3], found, files[3])


def test_the_same_input_gives_the_same(written, verdict):
    assert main(["diagnose", str(written / "bench"), "--out", str(written / "again"), "--no-tracking"]) == 0
    assert json.loads((written / "again" / "diagnosis.json").read_text()) == verdict
    first, second = ((written / out / "experiment.yaml").read_text() for out in ("out", "again"))
    assert first == second


def test_a_diagnosis_is_tracked_and_a_tracker_that_fails_breaks_nothing(tmp_path, capsys):
    write_recording(tmp_path / "single" / "a.nc", recorded())
    uri = f"sqlite:///{tmp_path}/tracked.db"
    spec = diagnosis_spec(compose()) | {"tracking": {"uri": uri, "experiment": "emafault"}}
    few = all_but("cogging", "stribeck", "self_heating")
    verdict = diagnose_folder(tmp_path / "single", spec, tmp_path / "out", exclude=few)
    assert "cogging" in verdict["inclusion"] and "inertia" not in verdict["inclusion"]
    assert verdict["shrinks"]["signal"] is None and verdict["recordings"]["confirm"] == []
    from mlflow import MlflowClient

    client = MlflowClient(tracking_uri=uri)
    (run,) = client.search_runs([client.get_experiment_by_name("emafault-diagnoses").experiment_id])
    assert run.info.run_name == "single" and run.data.params["verdict"] == verdict["verdict"]
    broken = spec | {"tracking": {"uri": "sqlite:////proc/nowhere/x.db", "experiment": "emafault"}}
    diagnose_folder(tmp_path / "single", broken, tmp_path / "out", exclude=few)
    assert "not tracked" in capsys.readouterr().err


def test_of_a_large_bench_a_part_is_taken_and_said(tmp_path, capsys):
    for n in range(7):
        write_recording(tmp_path / "large" / f"{n}.nc", recorded(("sine", "reversal")[n % 2], seed=n))
    few = ["diagnose", str(tmp_path / "large"), "--samples", "5000", "--no-tracking"]
    assert main([*few, "--out", str(tmp_path / "out")]) == 0
    verdict = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    taken = verdict["recordings"]["explore"] + verdict["recordings"]["confirm"]
    assert len(taken) == 5 and {f"{n}.nc" for n in range(7)} > set(taken)
    (told,) = (w["message"] for w in verdict["warnings"] if w["kind"] == "samples")
    printed = capsys.readouterr().out
    assert told.startswith("5 of 7 recordings are taken, 0 of them in part") and told in printed.splitlines()[1:]
    assert f"<li>{told}.</li>" in (tmp_path / "out" / "report.html").read_text()
    assert main([*few, "--corrected", str(tmp_path / "new")]) == 2
    said = capsys.readouterr().err
    assert said.startswith("emafault diagnose: --corrected: 5 of 7 recordings") and not (tmp_path / "new").exists()
    by = ["--diagnosis", str(tmp_path / "out" / "diagnosis.json")]
    assert main(["identify", str(tmp_path / "large"), *by]) == 2
    assert "is none of its 5 recordings" in capsys.readouterr().err
    assert main(["identify", *(str(tmp_path / "large" / n) for n in taken), *by]) == 0


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nowhere"], "no such file or folder"),
        (["empty"], "holds no recording"),
        (["swapped"], "a.nc: phase_current has its phases swapped"),
        (["swapped", "--twin", "toaster"], "toaster"),
        (["good", "--exclude", "gremlins"], "gremlins"),
        (["good", "--experiment", "../up"], "--experiment"),
        (["good", "--twin", "friction_axis", "--experiment", "mine"], "has no simulator"),
        (["good", "actuator.gear_ratio=none"], "actuator.gear_ratio"),
    ],
)
def test_bad_input_is_refused_in_one_line(tmp_path, capsys, monkeypatch, arguments, said):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").mkdir()
    good = recorded()
    write_recording(tmp_path / "good" / "a.nc", good)
    order = np.array([1, 0, 2])
    swapped = replace(
        good, phase_current=good.phase_current[:, order], phase_current_end=good.phase_current_end[:, order]
    )
    write_recording(tmp_path / "swapped" / "a.nc", swapped)
    assert main(["diagnose", *arguments, "--no-tracking"]) == 2
    error = capsys.readouterr().err.strip()
    assert said in error and "\n" not in error
    assert not (tmp_path / "results").exists()

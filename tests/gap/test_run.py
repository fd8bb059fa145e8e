"""A bench through the installed command: named, written, handed over, the same each time; and refused in one line."""

import json
from dataclasses import replace

import numpy as np
import pytest

from emafault.cli import main
from emafault.config import compose, retraining_spec
from emafault.gap.run import diagnose_path, to_json
from emafault.recording import write_recording
from emafault.study.retrain import retrain_network

EFFECT = {"magnet_temperature": {"alpha_m": -8e-4}}


@pytest.fixture(scope="module")
def written(tmp_path_factory, shop):
    """A bench with a strong effect and its diagnosis by the command."""
    folder = tmp_path_factory.mktemp("magnets")
    for name, recording in shop.make_bench(EFFECT).items():
        write_recording(folder / "bench" / name, recording)
    code = main(
        ["diagnose", str(folder / "bench"), "--by", "simulation", "--out", str(folder / "out"), "--no-tracking"]
    )
    assert code == 0
    return folder


@pytest.fixture(scope="module")
def verdict(written):
    return json.loads((written / "out" / "diagnosis.json").read_text())


def test_the_effect_is_named_with_its_value(verdict):
    first = verdict["which"][0]
    assert verdict["verdict"] == "explained" and first["effects"] == ["magnet_temperature"]
    value = first["parameters"]["alpha_m"]
    assert value["value"] == pytest.approx(-8e-4, rel=0.05) and value["low"] < value["value"] < value["high"]
    assert sum(e["probability"] for e in verdict["which"]) == pytest.approx(1.0, abs=1e-3)


def test_the_verdict_file_holds_what_the_contract_asks_for(verdict):
    keys = {"bench", "verdict", "recordings", "where", "which", "groups", "fault_vector", "biased_outputs", "shrinks"}
    assert keys | {"next_experiment", "warnings", "digest"} <= set(verdict)
    assert len(verdict["recordings"]["confirm"]) == 1 and len(verdict["recordings"]["explore"]) == 3
    assert set(verdict["fault_vector"]) == {f"recording_{n}.nc" for n in range(4)}
    signal, features = verdict["shrinks"]["signal"], verdict["shrinks"]["features"]
    for ladder in (signal, features):
        assert ladder["after"] < 0.3 * ladder["recalibrated"] and ladder["placebo"] > 2.0 * ladder["after"]
    assert 0 < len(verdict["next_experiment"]) <= 3
    for entry in verdict["next_experiment"]:
        assert entry["expected_odds"] >= 1.0 and len(entry["separates"]) == 2
        assert -273.0 < entry["ambient_temperature"] < 200.0


def test_the_report_needs_nothing_else_and_says_the_finding(written):
    page = (written / "out" / "report.html").read_text()
    assert "Magnet temperature explains the gap" in page and "What these recordings cannot tell" in page
    assert page.count("data:image/png;base64,") >= 6
    assert "http://" not in page and "https://" not in page and 'src="/' not in page


def test_the_fix_is_an_experiment_that_composes(written, verdict):
    path = written / "out" / "experiment.yaml"
    composed = compose(str(path))
    assert composed["effects"]["magnet_temperature"]["alpha_m"] == pytest.approx(-8e-4, rel=0.05)
    unit = verdict["simulator"]["after"]["unit_calibration"]
    assert composed["effects"]["unit_calibration"] == pytest.approx(unit, rel=1e-6)
    assert composed["name"] == "diagnosed_bench"


def test_retraining_with_the_effect_shrinks_the_fault_error(written):
    spec = retraining_spec(compose(overrides=["sampling.runs=120", "evaluation.seeds=1"]))
    out = written / "out"
    retrain_network(written / "bench", out, spec, out / "retrained.json")
    found = json.loads((out / "retrained.json").read_text())
    assert found["reference"] == "truth" and found["after"]["rms"] < 0.6 * found["before"]["rms"]
    assert "What retraining brought" in (out / "report.html").read_text()


def test_identical_input_gives_identical_results(written, verdict):
    again = diagnose_path(written / "bench", _spec(), written / "again", track=False)
    assert json.loads(to_json(again["bench"])) == verdict
    first, second = ((written / f / "experiment.yaml").read_text() for f in ("out", "again"))
    assert first == second


def test_the_effect_left_out_of_the_library_is_not_named(written):
    out = written / "without"
    command = ["diagnose", str(written / "bench"), "--by", "simulation", "--out", str(out), "--no-tracking"]
    assert main([*command, "--exclude", *EFFECT]) == 0
    verdict = json.loads((out / "diagnosis.json").read_text())
    assert all("magnet_temperature" not in e["effects"] for e in verdict["which"])


def test_a_diagnosis_is_tracked_and_a_tracker_that_fails_breaks_nothing(written, shop, tmp_path, capsys):
    write_recording(tmp_path / "single" / "a.nc", shop.record("ramp", {"speed": 0.2}, 30.0, "unknown", duration=0.3))
    uri = f"sqlite:///{tmp_path}/tracked.db"
    spec = _spec() | {"tracking": {"uri": uri, "experiment": "emafault"}}
    verdict = diagnose_path(tmp_path / "single", spec, tmp_path / "out")["single"]
    assert verdict["shrinks"]["signal"] is None and verdict["recordings"]["confirm"] == []
    from mlflow import MlflowClient

    client = MlflowClient(tracking_uri=uri)
    (run,) = client.search_runs([client.get_experiment_by_name("emafault").experiment_id])
    assert run.info.run_name == "single" and run.data.params["verdict"] == verdict["verdict"]
    broken = spec | {"tracking": {"uri": "sqlite:////proc/nowhere/x.db", "experiment": "emafault"}}
    diagnose_path(tmp_path / "single", broken, tmp_path / "out")
    assert "not tracked" in capsys.readouterr().err


def _spec():
    from emafault.config import diagnosis_spec

    return diagnosis_spec(compose())


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nowhere"], "no such file or folder"),
        (["empty"], "holds no recording"),
        (["swapped"], "a.nc: phase_current has its phases swapped"),
        (["swapped", "--twin", "toaster"], "toaster"),
        (["good", "--exclude", "gremlins"], "gremlins"),
        (["good", "--experiment", "../up"], "--experiment"),
        (["good", "actuator.gear_ratio=none"], "actuator.gear_ratio"),
    ],
)
def test_bad_input_is_refused_in_one_line(tmp_path, shop, plain, capsys, monkeypatch, arguments, said):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").mkdir()
    good = plain["recording_0.nc"]
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

"""What to record next as a command: motions that a bench can play, and refusals in one line."""

import json

import numpy as np
import pytest

from emafault.actuator.commands import read_command
from emafault.cli import main
from emafault.equations.sentences import separated
from emafault.reporting.written import to_json

ENTRY = {
    "command": "sine, amplitude 0.04 rad, frequency 2 Hz, 0.6 s", "ambient_temperature": 20.0,
    "separates": ["stribeck", "cogging+stribeck"], "expected_odds": 12.0,
    "motion": {"name": "sine", "duration": 0.6, "settings": {"amplitude": 0.04, "frequency": 2.0}},
}  # fmt: skip


def verdict(folder, **changes):
    path = folder / "diagnosis.json"
    path.write_text(to_json({"bench": "mine", "twin": "actuator", "next_experiment": [ENTRY]} | changes))
    return str(path)


def test_a_motion_is_written_as_the_simulator_reads_it(tmp_path, capsys):
    assert main(["plan", verdict(tmp_path), "--out", str(tmp_path / "plan")]) == 0
    said = capsys.readouterr().out
    assert (
        "distinguishes stribeck from stribeck with cogging, expected Bayes factor 12" in said and "1_sine.csv" in said
    )
    position = read_command(tmp_path / "plan" / "1_sine.csv", 0.6, 1e-3)
    time = 1e-3 * np.arange(601)
    assert position[:601] == pytest.approx(0.04 * np.sin(4.0 * np.pi * time), abs=1e-9)


def test_a_bench_that_leaves_nothing_open_is_told_so(tmp_path, capsys):
    assert main(["plan", verdict(tmp_path, next_experiment=[]), "--out", str(tmp_path)]) == 0
    assert "Nothing to record" in capsys.readouterr().out


def test_what_no_recording_distinguishes_is_said_and_no_motion_is_written_for_it(tmp_path, capsys):
    alike = ENTRY | {"separates": ["load_constant", "friction_asymmetry"], "expected_odds": 1.0004}
    assert main(["plan", verdict(tmp_path, next_experiment=[ENTRY, alike]), "--out", str(tmp_path / "plan")]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1] == "No recording of the menu distinguishes load constant from friction asymmetry"
    assert [p.name for p in (tmp_path / "plan").iterdir()] == ["1_sine.csv"]


def test_sets_are_distinguished_in_words():
    assert separated(["stribeck", "cogging"]) == "stribeck from cogging"
    assert separated(["stribeck", "no_gap"]) == "stribeck from no gap"
    assert separated(["no_gap", "bus_voltage"]) == "no gap from bus voltage"
    assert (
        separated(["stribeck", "bus_voltage+inertia+stribeck"]) == "stribeck from stribeck with bus voltage and inertia"
    )


@pytest.mark.parametrize(("text", "said"), [
    ("{", "not JSON"),
    ('{"twin": "friction_axis"}', "of a bench of the actuator"),
    ("[]", "of a bench of the actuator"),
    (json.dumps({"twin": "actuator", "next_experiment": [{"command": "x"}]}), "diagnose the bench once more"),
])  # fmt: skip
def test_a_verdict_that_cannot_be_used_is_refused_in_one_line(tmp_path, capsys, text, said):
    path = tmp_path / "diagnosis.json"
    path.write_text(text)
    assert main(["plan", str(path)]) == 2
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1
    assert main(["plan", str(tmp_path / "none.json")]) == 2
    assert "no such file" in capsys.readouterr().err

"""The installed command: simulate, identify, and refusals in one line with exit code 2."""

import json
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from emafault.cli import main
from emafault.faults import FAULT_NAMES
from emafault.io.recording import read_recording, write_recording

FAULT = (0.0375, 0.0504, 0.0507, 0.0059, -2.8e-5, -4.0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bench")
    assert main(["simulate", str(folder / "faulty.nc"), "--fault", *map(str, FAULT)]) == 0
    assert main(["simulate", str(folder / "warm.nc"), "command=ramp", "--fault", "dT=40", "--seed", "3"]) == 0
    return folder


def test_simulate_writes_the_fault_and_the_overrides(folder):
    recording = read_recording(folder / "faulty.nc")
    assert recording.fault == pytest.approx(FAULT)
    assert recording.attributes["health"] == "seeded" and "emafault" in recording.attributes["software"]
    assert read_recording(folder / "warm.nc").health == "healthy"
    assert json.loads(read_recording(folder / "warm.nc").attributes["configuration"])["command"]["name"] == "ramp"
    assert read_recording(folder / "warm.nc").ambient_temperature == pytest.approx(60.0, abs=2.0)


def test_identify_untrained_prints_a_table_and_writes_intervals(folder, tmp_path, capsys):
    out = tmp_path / "out.json"
    nowhere = ["--results", str(tmp_path)]
    assert main(["identify", str(folder), "--json", str(out), *nowhere]) == 0
    printed = capsys.readouterr().out
    assert "faulty.nc" in printed and "dT" in printed and "closed_form" in printed
    result = json.loads(out.read_text())
    estimate = result[str(folder / "faulty.nc")]
    assert set(result) == {str(folder / "faulty.nc"), str(folder / "warm.nc")} and set(estimate) == set(FAULT_NAMES)
    for name, truth, widest in zip(FAULT_NAMES, FAULT, (0.01, 0.01, 0.01, 0.01, 0.01, 2.0)):
        entry = estimate[name]
        half = 0.5 * (entry["high"] - entry["low"])
        assert entry["low"] < entry["value"] < entry["high"] and half < widest
        assert abs(entry["value"] - truth) < 3.0 * half


MISTAKEN = {
    "phases b and c swapped": lambda r: replace(r, phase_current=r.phase_current[:, [0, 2, 1]]),
    "current's sign": lambda r: replace(r, phase_current=-r.phase_current, phase_current_end=-r.phase_current_end),
    "angle 60 electrical degrees off": lambda r: replace(r, rotor_angle=r.rotor_angle + np.pi / 6.0),
    "mV for V": lambda r: replace(r, phase_voltage=1e3 * r.phase_voltage),
    "rpm for rad/s": lambda r: replace(r, rotor_speed=r.rotor_speed * 30.0 / np.pi),
    "wrapped angle": lambda r: replace(r, rotor_angle=np.mod(r.rotor_angle, 2.0 * np.pi)),
}


@pytest.mark.parametrize("mistake", MISTAKEN)
def test_identify_refuses_a_miswired_recording_in_one_line(folder, tmp_path, capsys, mistake):
    wrong = tmp_path / "wrong.nc"
    write_recording(wrong, MISTAKEN[mistake](read_recording(folder / "faulty.nc")))
    assert main(["identify", str(wrong), "--results", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert said.startswith("emafault identify: wrong.nc: ") and said.count("\n") == 1
    assert ("jumps by a turn" in said) == (mistake == "wrapped angle")
    assert main(["identify", str(folder / "faulty.nc"), "--reference", str(wrong), "--results", str(tmp_path)]) == 2


def test_a_reference_takes_the_unit_s_tolerance_out(tmp_path):
    healthy, faulty = tmp_path / "healthy.nc", tmp_path / "faulty.nc"
    # a unit off nominal by more than the fault's own signature
    unit = ["effects.unit_calibration.R_scale=1.03", "effects.unit_calibration.k_scale=0.99"]
    main(["simulate", str(healthy), "--fault", "dT=5", "--seed", "1", *unit])
    main(["simulate", str(faulty), "--fault", "Na=0.05", "dT=30", "--seed", "2", *unit])
    found = {}
    for name, extra in {"raw": [], "calibrated": ["--reference", str(healthy)]}.items():
        out = tmp_path / f"{name}.json"
        arguments = ["identify", str(faulty), "--json", str(out), "--results", str(tmp_path), *extra]
        assert main(arguments) == 0
        (found[name],) = json.loads(out.read_text()).values()
    assert abs(found["raw"]["dT"]["value"] - 30.0) > 5.0
    assert abs(found["calibrated"]["dT"]["value"] - 30.0) < 2.5
    assert abs(found["calibrated"]["Na"]["value"] - 0.05) < 0.006
    width = {name: f["dT"]["high"] - f["dT"]["low"] for name, f in found.items()}
    assert width["calibrated"] > 1.4 * width["raw"]  # what the reference itself does not know is in the interval


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["identify", "nowhere.nc"], "nowhere.nc: no such file"),
        (["identify", "{bench}", "--experiment", "nothing"], "experiment: got 'nothing'"),
        (["identify", "{bench}", "--method", "magic"], "--method: got 'magic'"),
        (["identify", "{bench}", "--reference", "{bench}/faulty.nc"], "'seeded', a reference must be healthy"),
        (["identify", "{bench}", "--json", "{bench}/faulty.nc/out.json"], "cannot be written"),
        (["identify", "{bench}", "--level", "2"], "--level: got 2.0"),
        (["identify", "{broken}"], "broken.nc: "),
        (["simulate", "{bench}/x.nc", "--fault", "Na=2"], "Na got 2"),
        (["simulate", "{bench}/x.nc", "--fault", "1", "2"], "six numbers"),
        (["simulate", "{bench}/x.nc", "command=warp"], "command: got 'warp'"),
        (["simulate", "{bench}/faulty.nc/x.nc"], "cannot be written"),
    ],
)
def test_refused_input_is_one_line_and_exit_code_2(folder, tmp_path, capsys, arguments, says):
    broken = tmp_path / "broken.nc"
    broken.write_bytes((folder / "faulty.nc").read_bytes()[:20_000])
    given = [word.format(bench=folder, broken=broken) for word in arguments]
    if given[0] == "identify":
        given += ["--results", str(tmp_path)]
    assert main(given) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1 and says in lines[0]


def test_the_command_starts_fast_and_without_torch():
    code = (
        "import sys, emafault.config, emafault.cli.simulate, emafault.cli.identify\n"
        "assert not {'torch', 'mlflow', 'optuna', 'matplotlib'} & set(sys.modules), 'heavy import'"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_noise_repeats_with_its_seed(tmp_path):
    for name, seed in {"a": "1", "b": "1", "c": "2"}.items():
        main(
            [
                "simulate",
                str(tmp_path / f"{name}.nc"),
                "recording.duration=0.3",
                "recording.discard=0.05",
                "--seed",
                seed,
            ]
        )
    a, b, c = (read_recording(tmp_path / f"{name}.nc").phase_voltage for name in "abc")
    assert np.array_equal(a, b) and not np.array_equal(a, c)


def test_identification_before_and_after_the_chain_is_corrected(tmp_path):
    """The folder that stands for the corrected recordings has them without what the chain does."""
    from emafault.cli.diagnose import identified

    talk = "unlisted=[{place: current_a, form: crosstalk, source: b, gain: 0.05}]"
    for name, more in {"bench": [talk], "corrected": []}.items():
        (tmp_path / name).mkdir()
        assert main(["simulate", str(tmp_path / name / "a.nc"), "--fault", "Na=0.05", "dT=20", *more]) == 0
    head, recorded, corrected, true, note = identified(tmp_path / "bench", tmp_path / "corrected").splitlines()
    assert head.split()[-6:] == list(FAULT_NAMES) and "closed_form" in note and "a.nc" in recorded
    rows = [np.array([float(x) for x in line.split()[-6:]]) for line in (recorded, corrected, true)]
    assert rows[2] == pytest.approx([0.05, 0.0, 0.0, 0.0, 0.0, 20.0])
    assert np.abs(rows[1][:5] - rows[2][:5]).max() < 0.01 < np.abs(rows[0][:5] - rows[2][:5]).max()


def _identified(path, tmp_path, capsys, *more):
    out = tmp_path / "nine.json"
    (tmp_path / "nowhere").mkdir(exist_ok=True)
    nowhere = ["--results", str(tmp_path / "nowhere"), "--force"]
    assert main(["identify", str(path), "--experiment", "nine_features", "--json", str(out), *nowhere, *more]) == 0
    (found,) = json.loads(out.read_text()).values()
    said = capsys.readouterr()
    assert "nine/closed_form" in said.out
    return found, said.err


def test_nine_features_narrow_the_intervals_and_need_end_currents(folder, tmp_path, capsys):
    found, said = _identified(folder / "faulty.nc", tmp_path, capsys)
    assert said == ""
    blind = tmp_path / "blind.nc"
    write_recording(blind, replace(read_recording(folder / "faulty.nc"), phase_current_end=None))
    wide, said = _identified(blind, tmp_path, capsys)
    assert "no end currents" in said
    for name, truth in zip(FAULT_NAMES, FAULT):
        half = 0.5 * (found[name]["high"] - found[name]["low"])
        assert abs(found[name]["value"] - truth) < 3.0 * half
        assert name == "dT" or half < 0.5 * 0.5 * (wide[name]["high"] - wide[name]["low"])


def test_a_recording_that_fits_neither_its_equations_nor_any_fault_is_told(tmp_path, capsys):
    bent = tmp_path / "bent.nc"
    main(["simulate", str(bent), "effects.back_emf_shape.h5=0.02", "--fault", "Na=0.05", "dT=10"])
    found, said = _identified(bent, tmp_path, capsys)
    assert "phase a, b, c does not fit its equation" in said
    truth = dict(zip(FAULT_NAMES, (0.05, 0.0, 0.0, 0.0, 0.0, 10.0)))
    assert all(found[n]["low"] < v < found[n]["high"] for n, v in truth.items())
    other = tmp_path / "other.nc"
    main(["simulate", str(other), "effects.inductance_tolerance.L_scale=1.2", "--fault", "Na=0.05"])
    _, said = _identified(other, tmp_path, capsys)
    assert "R, k and L fit no fault of this unit" in said and "equation" not in said
    main(["simulate", str(other), "effects.inductance_tolerance.L_scale=1.4", "--fault", "Na=0.05", "--force"])
    assert main(["identify", str(other), "--experiment", "nine_features", "--results", str(tmp_path)]) == 2
    assert "fit no fault of this actuator" in capsys.readouterr().err

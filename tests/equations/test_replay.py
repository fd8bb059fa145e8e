"""A bench replayed: with what made it the simulator comes as near as two runs of its own, without it does not."""

import json

import pytest

from emafault.cli import main
from emafault.io.recording import read_recording

UNLISTED = """unlisted:
  - {place: torque, form: order, order: 2.4, amplitude: 0.02, phase: 1.0}
  - place: current_b
    form: drift
    at_end: 0.0
    recordings: {a.nc: {at_end: 0.2}, b.nc: {at_end: 0.1}}
"""
HEAD = "# @package _global_\nname: mine\nactuator: {position_gain: 80.0}\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A bench of an actuator with a wave in its torque, a drift and another gain, and the experiment that says so."""
    folder = tmp_path_factory.mktemp("replayed")
    (folder / "mine.yaml").write_text(HEAD + UNLISTED)
    (folder / "bench").mkdir()
    for seed, name, drift, command in ((1, "a", 0.2, "parabolic"), (2, "b", 0.1, "sine")):
        unlisted = UNLISTED.replace("at_end: 0.0", f"at_end: {drift}").split("    recordings")[0]
        (folder / f"{name}.yaml").write_text(HEAD + unlisted)
        what = ["--experiment", str(folder / f"{name}.yaml"), "--seed", str(seed), "--fault", "Na=0.04", "dT=15"]
        of = [str(folder / "bench" / f"{name}.nc"), f"command={command}", "recording.duration=0.5"]
        assert main(["simulate", *of, *what]) == 0
    return folder


def test_the_corrected_simulator_is_as_near_as_two_runs_of_its_own(folder, capsys):
    out = folder / "out"
    given = ["--replay", str(folder / "bench"), "--experiment", str(folder / "mine.yaml")]
    assert main(["simulate", str(out), *given, "--seed", "7"]) == 0
    printed = capsys.readouterr().out
    assert "rotor speed (rad/s)" in printed and "without: the nominal actuator" in printed
    rows = json.loads((out / "replay.json").read_text())
    for quantity in ("rotor speed", "current", "sum of the currents"):
        row = rows[quantity]
        assert row["without"] > 4.0 * row["least"] and row["corrected"] < 1.5 * row["least"] and row["closed"] > 0.98
    replayed, bench = (read_recording(f / "a.nc") for f in (out, folder / "bench"))
    assert replayed.fault == pytest.approx(bench.fault) and replayed.health == bench.health
    assert main(["simulate", str(out), *given]) == 2
    assert "holds files already" in capsys.readouterr().err


def test_what_is_the_bench_s_is_not_given(folder, capsys):
    given = ["simulate", str(folder / "new"), "--replay", str(folder / "bench")]
    assert main([*given, "--fault", "Na=0.1"]) == 2
    assert "takes fault, health and unit from the bench" in capsys.readouterr().err
    assert main([*given, "--experiment", str(folder / "none.yaml")]) == 2

"""Maps of machines of another kind: measured sets from their raw form, a machine of one's own, and what is refused."""

import re
from pathlib import Path

import numpy as np
import pytest
import yaml

from emafault.cli import main
from emafault.errors import InputError
from emafault.machines.files import read_arrays
from emafault.machines.library import read_cases, stated
from emafault.units import converted
from machines import line

DATA = Path(__file__).parents[2] / "data" / "measured"
SETS = {
    "lea_pmsm_temperature": ("dq_machine", "profile24_first60.csv.gz"),
    "bldc_sixstep_esc": ("six_step_bus", "f40_merged.csv.gz"),
    "emps": ("friction_axis", "emps_estimation.npz"),
}


def imported(folder: str, out: Path) -> tuple[dict, dict]:
    """Arrays that the twin reads of what its map gives, and of the file that the project has."""
    twin, file = SETS[folder]
    assert main(["import", "--map", str(DATA / folder / "map.yaml"), "--out", str(out)]) == 0
    cases = [read_cases(stated(twin), path) for path in (out / file, DATA / folder / file)]
    assert cases[0].keys() == cases[1].keys() and len(cases[0]) == 1
    (case,) = cases[0]
    return cases[0][case], cases[1][case]


@pytest.mark.parametrize("folder", ["lea_pmsm_temperature", "emps"])
def test_a_map_alone_gives_what_the_twin_reads(folder, tmp_path, capsys):
    got, wanted = imported(folder, tmp_path)
    assert got.keys() == wanted.keys()
    for name, values in wanted.items():
        assert np.array_equal(got[name], values), name
    twin, file = SETS[folder]
    assert (
        capsys.readouterr().out == f"{file} written to {tmp_path}; next: emafault diagnose {tmp_path} --twin {twin}\n"
    )


def test_a_map_alone_merges_two_loggers(tmp_path, capsys):
    got, wanted = imported("bldc_sixstep_esc", tmp_path)
    assert "305 of 11487 rows left out" in capsys.readouterr().out  # the bench log ends, the table holds its last value
    assert got.keys() == wanted.keys() and got["t"].size == 11182
    for name, values in wanted.items():
        # the table has six digits; where the torque's noise changes sign it was interpolated without its sign
        error = np.abs(got[name] - values[:11182])
        assert np.quantile(error / np.abs(values).max(), 1.0 if name != "T" else 0.99) < 5e-6, name
    assert np.abs(got["T"] - wanted["T"][:11182]).max() < 1e-3


def test_the_second_instrument_may_be_missing(tmp_path):
    given = yaml.safe_load((DATA / "bldc_sixstep_esc" / "map.yaml").read_text())
    file = DATA / "bldc_sixstep_esc" / "f40_esc32_log.csv.gz"
    given["recordings"] = [{"name": "alone", "file": str(file)}]
    given["loggers"] = {"controller": {}}
    given["signals"] = {k: spec for k, spec in given["signals"].items() if "logger" not in spec}
    assert run(tmp_path, given) == 0
    (got,) = read_cases(stated("six_step_bus"), tmp_path / "out" / "alone.csv.gz").values()
    (wanted,) = read_cases(stated("six_step_bus"), file).values()
    assert got.keys() == wanted.keys()
    for name, values in wanted.items():
        np.testing.assert_allclose(got[name], values, rtol=1e-12, atol=1e-6 if name == "t" else 0.0)


MINE = {
    "machine": "mine.py",
    "recordings": [{"name": "bench", "file": "raw.csv"}],
    "signals": {
        "w": {"channel": "speed", "unit": "rpm"},
        "i": {"channel": "shunt", "unit": "mV", "scale": 2.0, "sign": -1, "offset": 3.0},
        "v": {"channel": "u"},
        "recording": {"channel": "run"},
    },
}


@pytest.fixture
def bench(tmp_path):
    """Folder with a machine of one's own, its raw table in other units, and a map."""
    units = 'UNITS = {"w": "rad/s", "i": "mV", "v": "V", "recording": "1"}\n'
    (tmp_path / "mine.py").write_text(Path(line.__file__).read_text() + units)
    raw = line.recorded()
    table = [raw["w"] * 30.0 / np.pi, 3.0 - 0.5 * raw["i"], raw["v"], raw["recording"]]
    np.savetxt(tmp_path / "raw.csv", np.column_stack(table), fmt="%.17g", delimiter=",", comments="",
               header="speed,shunt,u [V],run")  # fmt: skip
    return tmp_path


def run(bench: Path, given: dict, *more: str) -> int:
    (bench / "map.yaml").write_text(yaml.safe_dump(given, sort_keys=False))
    return main(["import", "--map", str(bench / "map.yaml"), "--out", str(bench / "out"), *more])


def changed(**signals) -> dict:
    """The map with some signals changed, None to leave one out."""
    both = {k: v for k, v in (MINE["signals"] | signals).items() if v is not None}
    return MINE | {"signals": both}


def test_a_machine_of_ones_own_needs_its_file_and_a_map(bench, capsys):
    assert run(bench, MINE) == 0
    (got,) = read_cases(stated(str(bench / "mine.py")), bench / "out" / "bench.csv.gz").values()
    for name, values in line.recorded().items():
        np.testing.assert_allclose(got[name], values, rtol=1e-12)
    assert run(bench, MINE) == 2 and "bench.csv.gz: exists already, --force replaces it" in capsys.readouterr().err
    assert run(bench, MINE, "--force") == 0


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (changed(w={"channel": "sped", "unit": "rpm"}), r"no channel 'sped' \(did you mean speed\?\); there are"),
        (changed(w={"channel": "speed"}), "'speed' has no unit; say signals.w.unit in the map, as rad/s"),
        (changed(w={"channel": "speed", "unit": "A"}), "'speed' for signals.w: the unit 'A' is not one of rad/s"),
        (changed(w={"channel": "speed", "unit": "Hz"}), "the unit 'Hz' is not one of rad/s .a turn a second"),
        (changed(v=None), r"map.yaml: signals: 'v' is missing; mine needs w, i, v, recording"),
        (changed(volts={"channel": "u"}), r"signals.volts: there is no such key; .*signals accepts i, recording, v, w"),
        (changed(v={"channel": "u", "unti": "V"}), "signals.v: .*'unti' was unexpected"),
        (changed(v={"unit": "V"}), "signals.v: "),
        (changed(v={"value": "12 A"}), "signals.v.value: got '12 A', accepted is a number with a unit of V"),
        (changed(v={"time": True}), "signals.v.time: there are no times"),
        (MINE | {"recordings": [MINE["recordings"][0] | {"segment": [0, "1 s"]}]}, "segment: there are no times"),
        (MINE | {"loggers": {"one": {"clock": "found"}}}, "loggers.one.clock: 'found' is not valid"),
        (MINE | {"machine": "toaster"}, "map.yaml: machine: got 'toaster', accepted are dq_machine"),
        (MINE | {"machine": "back_emf"}, "back_emf states no units of columns; accepted are dq_machine, six_step_bus"),
        (MINE | {"machine": "dq_machine"}, "signals.w: there is no such key; .*accepts i_d, i_q"),
    ],
)  # fmt: skip
def test_what_cannot_be_used_is_refused_in_one_line(bench, given, says, capsys):
    assert run(bench, given) == 2
    said = capsys.readouterr().err
    assert re.search(says, said) and said.count("\n") == 1
    assert not (bench / "out").exists()


def test_a_table_that_the_twin_refuses_is_not_written(bench, capsys):
    lines = (bench / "raw.csv").read_text().splitlines()
    (bench / "raw.csv").write_text("\n".join(lines[:6]))
    assert run(bench, MINE) == 2
    assert "emafault import: bench.csv.gz: 'w' has 5 rows, at least 10 are needed\n" == capsys.readouterr().err
    assert not (bench / "out").exists()


def test_frequencies_and_speeds_are_two_things():
    assert converted(2.0, "kHz", "Hz", "x") == 2000.0 and converted(1.0, "turn/s", "rad/s", "x") == 2.0 * np.pi
    with pytest.raises(InputError, match="x: the unit 'rpm' is not one of Hz"):
        converted(1.0, "rpm", "Hz", "x")


def test_options_of_the_actuator_are_refused(bench, capsys):
    assert run(bench, MINE, "actuator.pole_pairs=7") == 2
    assert "names a machine, for which neither overrides nor --actuator" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("added", "says"),
    [
        ('UNITS = ["w"]', r"UNITS is \['w'\], accepted is column -> unit"),
        ('OPTIONAL = ["x"]', "OPTIONAL names x, accepted are keys of UNITS"),
        ('ENDING = ".mat"', "ENDING is '.mat', accepted are .csv.gz, .npz"),
    ],
)
def test_what_a_machine_states_of_its_columns_is_checked(bench, added, says, capsys):
    with open(bench / "mine.py", "a") as file:
        file.write(added + "\n")
    assert run(bench, MINE) == 2 and re.search(says, capsys.readouterr().err)


def test_a_second_logger_a_segment_and_temperatures(tmp_path, capsys):
    """Rows are those of the first logger; a number, a time, degrees Fahrenheit and a log with gaps."""
    units = {"t": "ms", "x": "degC", "y": "m", "c": "N/V"}
    (tmp_path / "mine.py").write_text(
        f"UNITS = {units}\nENDING = '.npz'\nfrom emafault.machines.files import read_arrays\n"
        "def read(path): return {'x': read_arrays(path)}\ndef build(case, arrays): return None\n"
    )
    t = np.linspace(0.0, 1.0, 11)
    np.savez(tmp_path / "first.npz", time=t, x=32.0 + 18.0 * t)
    late = np.linspace(5.0, 6.0, 101)
    np.savez(tmp_path / "second.npz", time=late, y=np.where(np.arange(101) % 3 == 1, np.nan, 1e3 * (late - 5.25)))
    given = {
        "machine": "mine.py",
        "loggers": {"one": {}, "two": {"clock": {"skew": "-4.75 s"}}},
        "recordings": [
            {"name": "b", "files": {"one": "first.npz", "two": "second.npz"}, "segment": ["200 ms", "850 ms"]}
        ],
        "signals": {
            "t": {"time": True},
            "x": {"channel": "x", "unit": "degF"},
            "y": {"channel": "y", "logger": "two", "unit": "mm"},
            "c": {"value": "35 N/V"},
        },
    }
    assert run(tmp_path, given) == 0
    got = read_arrays(tmp_path / "out" / "b.npz")
    np.testing.assert_allclose(got["t"], np.arange(300.0, 801.0, 100.0))  # the second log begins at 250 ms
    np.testing.assert_allclose(got["x"], 10.0 * got["t"] / 1e3, atol=1e-12)
    np.testing.assert_allclose(got["y"], got["t"] / 1e3 - 0.5, atol=1e-12)
    assert got["c"].shape == () and got["c"] == 35.0
    given["loggers"]["two"]["clock"]["skew"] = 100.0
    assert run(tmp_path, given, "--force") == 2
    assert "b: no time is in all logs and the segment; look at clock.skew and segment" in capsys.readouterr().err
    given["loggers"] = {"one": {"rate": 10.0}, "two": {"rate": "100 Hz"}}  # both count from one step on
    del given["recordings"][0]["segment"]
    assert run(tmp_path, given, "--force") == 0
    assert "b.npz: 1 of 11 rows left out" in capsys.readouterr().out

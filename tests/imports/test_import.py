"""Raw logs with what goes wrong at a bench: what was simulated comes out, or a line that says what to do."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
import yaml

from emafault.cli import main
from emafault.errors import InputError
from emafault.imports.mapping import complete
from emafault.io.bench import read_bench
from emafault.io.recording import read_recording

from .checks import ELECTRICAL, bring, off
from .measured import ACTUATOR, INTERVAL, averaged, log, map_of, simulated
from .writers import WITHOUT_UNITS, WRITERS, channel


@pytest.mark.parametrize("reference", ["star", "dc_minus", "virtual_star", "line_to_line", "duty"])
def test_any_reference_gives_the_star_point_s(reference, fine, truth, tmp_path):
    result = bring(tmp_path, map_of(reference), log=log(fine, reference))
    recording = result.recordings["one.nc"]
    # where a leg's current runs out within an interval its duty does not tell the voltage
    assert off(recording, truth, **({"voltage": 0.1, "tail": 0.08} if reference == "duty" else {})) == []
    said = recording.known["phase_voltage"]["reference"]
    assert said == ("star" if reference == "star" else "modelled_star")
    assert any("star point" in text for text in result.lost["one"]) == (reference != "star")
    assert min(f.margin for f in result.findings) >= 3.0


@pytest.mark.parametrize("file", ["european.csv", "log.parquet", "v73.mat", "log.tdms", "log.mf4", "bag", "log.nc"])
def test_any_format_through_the_command(file, tmp_path, fine, truth, capsys):
    written = log(fine, "dc_minus")
    WRITERS[file](tmp_path / file, written)
    given = map_of("dc_minus")
    names = list(written.channels)
    for spec in given["signals"].values():
        key = "channels" if "channels" in spec else "channel"
        spec[key] = (
            [channel(file, n, names) for n in spec[key]] if key == "channels" else channel(file, spec[key], names)
        )
        if file in WITHOUT_UNITS:
            first = spec[key][0] if key == "channels" else spec[key]
            at = next(n for n in names if channel(file, n, names) == first)
            spec["unit"] = written.units[at]
    given["recordings"][0]["file"] = file
    (tmp_path / "map.yaml").write_text(yaml.safe_dump(given))
    assert main(["import", "--map", str(tmp_path / "map.yaml"), "--out", str(tmp_path / "bench")]) == 0
    printed = capsys.readouterr().out
    assert "electrical zero: 57.3 degrees" in printed and "one.nc and import.html" in printed
    recording = read_recording(tmp_path / "bench" / "one.nc")
    assert 0.0 < recording.known["rotor_angle"]["zero_error"] < np.deg2rad(0.5)
    assert off(recording, truth) == []
    assert read_bench(tmp_path / "bench", ACTUATOR).recordings.keys() == {"one.nc"}
    assert json.loads(recording.attributes["import_map"])["unit"] == "unit 7" == recording.attributes["unit"]
    assert main(["import", "--map", str(tmp_path / "map.yaml"), "--out", str(tmp_path / "bench")]) == 2
    assert "one.nc: exists already, --force replaces it" in capsys.readouterr().err
    assert recording.attributes["source"] == file and recording.known["phase_voltage"] == {"reference": "modelled_star"}
    page = (tmp_path / "bench" / "import.html").read_text()
    assert (
        "at an interval of 200 us." in page
        and "pole pairs" in page
        and "What these recordings do not determine" in page
    )
    (said,) = re.findall(r'<img alt="(.*?)"', page)
    assert f"speed up to {np.abs(recording.rotor_speed).max():.3g} rad/s" in said and "mrad from its command" in said


def scaled(factor, *names):
    """A change of channels by a factor."""
    return lambda x: x.change(**dict.fromkeys(names, lambda v: factor * v))


RIGHTED = {
    "voltages b and c swapped": (lambda x: x.swap("ub", "uc"), "phase_voltage: channels are of acb"),
    "voltages a and b swapped": (lambda x: x.swap("ua", "ub"), "phase_voltage: channels are of bac"),
    "currents b and c swapped": (lambda x: x.swap("ib", "ic"), "phase_current: channels are of acb"),
    "currents a and c swapped": (lambda x: x.swap("ia", "ic"), "phase_current: channels are of cba"),
    "one current's sign": (lambda x: x.change(ib=np.negative), "b times -1"),
    "two currents' signs": (lambda x: x.change(ib=np.negative, ia=np.negative), "c times -1"),
    "all currents' signs": (lambda x: x.change(ia=np.negative, ib=np.negative, ic=np.negative), "all turned round"),
    "one voltage's sign": (lambda x: x.change(uc=np.negative), "channel of c turned round"),
    "angle's sense": (lambda x: x.change(angle=np.negative), "rotor_angle: turned round"),
    "speed's sense": (lambda x: x.change(speed=np.negative), "rotor_speed: turned round"),
    "shaft's sense": (lambda x: x.change(out=np.negative, cmd=np.negative), "output_position: turned round"),
    "rotor's sense": (lambda x: x.change(angle=np.negative, speed=np.negative), "rotor_angle: turned round"),
    "command's sense": (lambda x: x.change(cmd=np.negative), "commanded_position: turned round"),
    "angle a third of a turn on": (lambda x: x.change(angle=lambda v: v + ELECTRICAL / 3.0), "electrical zero: -62.7"),
    "angle half a turn on": (lambda x: x.change(angle=lambda v: v + ELECTRICAL / 2.0), "electrical zero: -122.7"),
    "angle that wraps": (lambda x: x.change(angle=lambda v: np.mod(v, 2.0 * np.pi)), "electrical zero: 57.3"),
    "one current's decade": (lambda x: x.change(ib=lambda v: 0.1 * v), "b times 10"),
    "all currents' decade": (scaled(100.0, "ia", "ib", "ic"), "R beside the actuator's: 0.01 times"),
    "one voltage's decade": (lambda x: x.change(ua=lambda v: 10.0 * v), "phase_voltage a beside the others: 10 times"),
    "all voltages' decade": (scaled(0.1, "ua", "ub", "uc"), "k beside the actuator's: 0.1"),
    "bus's decade": (lambda x: x.change(bus=lambda v: 0.1 * v), "bus_voltage beside the actuator's: 0.1"),
    "voltages swapped, a current's sign": (
        lambda x: x.swap("ub", "uc").change(ia=np.negative), "phase_voltage: channels are of acb"
    ),
}  # fmt: skip


@pytest.mark.parametrize("mistake", RIGHTED)
@pytest.mark.parametrize("reference", ["star", "line_to_line"])
def test_a_mistake_is_found_and_put_right(mistake, reference, fine, truth, tmp_path):
    change, says = RIGHTED[mistake]
    result = bring(tmp_path, map_of(reference), log=change(log(fine, reference)))
    assert off(result.recordings["one.nc"], truth) == []
    if reference == "star":
        assert any(says in finding.text() for finding in result.findings)


REFUSED = {
    "voltages, round": (lambda x: x.swap("ua", "ub").swap("ub", "uc"), {}, "say signals.phase_voltage.order or"),
    "phases of both": (lambda x: x.swap("ub", "uc").swap("ib", "ic"), {}, "say sense: phases_reversed .* motion"),
    "rotor and voltages at once": (
        lambda x: x.change(angle=np.negative, speed=np.negative).swap("ub", "uc"), {}, "one way, .* the other; say sign"
    ),
    "speed in rpm": (lambda x: x.change(speed=lambda v: v * 30.0 / np.pi), {}, "rotor_speed: is 9.549 .* it is in rpm"),
    "another machine": (scaled(4.0 / 3.0, "angle", "speed"), {}, "pole pairs: 3 .*, the actuator has 4; give .*=3"),
    "angle in degrees": (lambda x: x.change(angle=np.rad2deg), {}, "rotor_speed: is 0.01745|rotor_speed beside"),
    "angle in electrical radians": (lambda x: x.change(angle=lambda v: 4.0 * v), {}, "rotor_speed"),
    "shaft in degrees": (lambda x: x.change(out=np.rad2deg), {}, "output_position: moves 57.3 times .* in degrees"),
    "voltage of half a probe": (scaled(3.0, "ua"), {}, "times better .* say signals.phase_voltage.scale"),
    "the sign is stated": (scaled(-1.0, "ib"), {"phase_current": {"sign": 1}}, "against signals.phase_curr.*sign"),
    "the scale is stated": (scaled(10.0, "ib"), {"phase_current": {"scale": 1}}, "against .*phase_current.scale"),
    "the zero is stated": (lambda x: x, {"rotor_angle": {"electrical_zero": "-60 deg"}}, "by the voltages and -60"),
    "a gap": (lambda x: x.change(out=lambda v: np.where(np.arange(len(v)) == 900, np.nan, v)), {}, "no value at 0.018"),
    "no unit": (lambda x: x, {"phase_voltage": {"unit": "kg"}}, "the unit 'kg' is not one of V"),
    "a channel that is not there": (lambda x: x, {"bus_voltage": {"channel": "vdc"}}, "no channel 'vdc'; there are ua"),
    "command still": (lambda x: x.change(cmd=np.zeros_like), {}, "commanded_position: never moves"),
    "command in degrees": (lambda x: x.change(cmd=np.rad2deg), {}, "commanded_position: moves 57.2.* in degrees"),
    "output still": (lambda x: x.change(out=np.zeros_like), {}, "output_position: never moves"),
}  # fmt: skip


@pytest.mark.parametrize("mistake", REFUSED)
def test_what_the_data_leave_open_or_contradict_is_refused_in_one_line(mistake, fine, tmp_path):
    change, stated, says = REFUSED[mistake]
    given = map_of()
    for name, spec in stated.items():
        given["signals"][name] |= spec
    with pytest.raises(InputError, match=says) as refusal:
        bring(tmp_path, given, log=change(log(fine)))
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("sense", "change"),
    [
        ("phases_reversed", lambda x: x.swap("ub", "uc").swap("ib", "ic")),
        ("motion_reversed", lambda x: x.change(**dict.fromkeys(("angle", "speed", "out", "cmd"), np.negative))),
    ],
)
def test_what_is_reversed_as_a_whole_is_the_map_s_to_say(sense, change, fine, truth, tmp_path):
    result = bring(tmp_path, map_of(sense=sense), log=change(log(fine)))
    assert off(result.recordings["one.nc"], truth) == []
    with pytest.raises(InputError, match="take it out"):
        bring(tmp_path, map_of(sense=sense), log=log(fine))


def test_names_that_go_round_are_put_right_once_one_order_is_stated(fine, truth, tmp_path):
    given = map_of()
    given["signals"]["phase_current"]["order"] = "abc"
    result = bring(tmp_path, given, log=log(fine).swap("ua", "ub").swap("ub", "uc"))
    assert off(result.recordings["one.nc"], truth) == []


def test_counts_wraps_units_and_stamps_are_as_the_map_says(fine, truth, tmp_path):
    step = fine["time"][1] - fine["time"][0]
    raw = log(fine).change(
        angle=lambda v: np.floor(v * 40_000 / (2.0 * np.pi)) % 65_536, speed=lambda v: v * 30.0 / np.pi,
        out=lambda v: np.rad2deg(v) + 1.25, cmd=lambda v: np.rad2deg(v) + 1.25, ua=lambda v: v / 50.0,
        ub=lambda v: v / 50.0, uc=lambda v: v / 50.0, ia=lambda v: 1e3 * v, ib=lambda v: 1e3 * v, ic=lambda v: 1e3 * v,
    )  # fmt: skip
    raw.units |= {"angle": "1"} | dict.fromkeys(("ia", "ib", "ic"), "mA") | dict.fromkeys(("out", "cmd"), "deg")
    given = map_of(interval="200 us", loggers={"daq": {"samples": "means", "stamp": "start"}})
    signals = given["signals"]
    signals["rotor_angle"] |= {"counts_per_turn": 40_000, "wraps_at": 65_536}
    signals["phase_voltage"] |= {"scale": 50}
    signals["rotor_speed"] |= {"unit": "rpm"}
    for name in ("output_position", "commanded_position"):
        signals[name] |= {"offset": 1.25}
    # angles and positions are instants, which have no interval to be stamped in: these are a step late
    raw.time = raw.time - step
    for name in ("angle", "out", "cmd"):
        raw.channels[name] = np.append(raw.channels[name][:1], raw.channels[name][:-1])
    result = bring(tmp_path, given, log=raw)
    assert off(result.recordings["one.nc"], truth, command=1e-5) == []


def test_recordings_of_a_bench_are_read_together_each_from_its_own_zero(fine, truth, tmp_path):
    slow = simulated(0.1 * INTERVAL, motion="parabolic")
    given = map_of()
    second = given["recordings"][0] | {"name": "two", "file": "slow.parquet", "health": "healthy"}
    given["recordings"].append(second)
    later = log(slow).change(angle=lambda v: v + 1.0).swap("ub", "uc")
    result = bring(tmp_path, given, log=log(fine).swap("ub", "uc"), slow=later)
    assert off(result.recordings["one.nc"], truth) == [] == off(result.recordings["two.nc"], averaged(slow, 10))
    assert result.recordings["two.nc"].health == "healthy" and len(result.warnings) > 0


def test_the_example_of_the_documentation_fits_the_schema(tmp_path):
    text = (Path(__file__).parents[2] / "docs" / "recordings.md").read_text()
    example = yaml.safe_load(text.split("```yaml")[1].split("```")[0])
    found = complete(example, tmp_path / "bench.yaml")
    assert found["recordings"][0]["files"] == {"scope": str(tmp_path / "cold.csv"), "daq": str(tmp_path / "cold.tdms")}
    assert found["loggers"]["scope"] == {"samples": "instants", "stamp": "end", "clock": "same"}

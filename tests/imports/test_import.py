"""Raw logs with what goes wrong at a bench: what was simulated comes out, or a line that says what to do."""

import json

import numpy as np
import pytest
import yaml

from emafault.cli import main
from emafault.errors import InputError
from emafault.imports.mapping import complete
from emafault.imports.run import imported
from emafault.imports.signal import Signal, pulse_uncertainty
from emafault.io.bench import read_bench
from emafault.io.recording import read_recording

from .measured import ACTUATOR, INTERVAL, NOISE, log, map_of, rested, simulated
from .writers import WITHOUT_UNITS, WRITERS, channel, parquet

ELECTRICAL = 2.0 * np.pi / ACTUATOR.pole_pairs


def bring(folder, given, **logs):
    """Import logs, written as Parquet, by a map."""
    for name, written in logs.items():
        parquet(folder / f"{name}.parquet", written)
    return imported(complete(given, folder / "map.yaml"), ACTUATOR, NOISE["u"])


def off(recording, truth, voltage=0.056, tail=0.0, current=0.0056, command=1e-9):
    """Channels that are not those of the truth; the angle counts up to whole electrical turns.

    ``voltage``, ``current`` and ``command``: what their errors may be, most of it noise; ``tail``: share of voltages
    that may be further off
    """
    n = len(recording.time)
    errors = {
        "phase_current": (recording.phase_current - truth["phase_current"][:n], current),
        "rotor_speed": (recording.rotor_speed - truth["rotor_speed"][:n], 0.33),
        "output_position": (recording.output_position - truth["output_position"][:n], 1.1e-5),
        "commanded_position": (recording.commanded_position - truth["commanded_position"][:n], command),
    }
    u = np.abs(recording.phase_voltage - truth["phase_voltage"][:n])
    kept = np.sort(u, axis=None)[: int((1.0 - tail) * u.size)]
    turn = recording.rotor_angle - truth["rotor_angle"][:n]
    turn -= ELECTRICAL * np.round(np.median(turn) / ELECTRICAL)
    wrong = [name for name, (error, most) in errors.items() if np.sqrt(np.mean(error**2)) > most]
    wrong += ["phase_voltage"] if np.sqrt(np.mean(kept**2)) > voltage else []
    return wrong + (["rotor_angle"] if np.sqrt(np.mean(turn**2)) > np.deg2rad(0.5) / ACTUATOR.pole_pairs else [])


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
    assert "electrical zero: 57.3 degrees" in printed and "1 recordings and import.html" in printed
    recording = read_recording(tmp_path / "bench" / "one.nc")
    assert off(recording, truth) == []
    assert read_bench(tmp_path / "bench", ACTUATOR).recordings.keys() == {"one.nc"}
    assert json.loads(recording.attributes["import_map"])["unit"] == "unit 7" == recording.attributes["unit"]
    assert recording.attributes["source"] == file and recording.known["phase_voltage"] == {"reference": "modelled_star"}
    page = (tmp_path / "bench" / "import.html").read_text()
    assert "pole pairs" in page and "What these recordings cannot tell" in page


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
    "speed in rpm": (lambda x: x.change(speed=lambda v: v * 30.0 / np.pi), {}, "rotor_speed: is 9.549 .* it is in rpm"),
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


REST = 0.06  # s, before the motion


@pytest.mark.parametrize(
    ("second", "skew", "drift"),
    [(("angle", "speed", "out", "cmd"), 0.0371, 3e-4), (("ia", "ib", "ic"), -0.0122, 0.0)],
)
def test_a_second_clock_is_found(second, skew, drift, fine, truth, tmp_path):
    step = 0.1 * INTERVAL
    s = rested(fine, REST)
    one, two = log(s), log(s)
    one.channels = {n: v[max(0, -round(skew / step)) :] for n, v in one.channels.items() if n not in second}
    two.channels = {n: v[max(0, round(skew / step)) :] for n, v in two.channels.items() if n in second}
    # each counts from when it was started, one in seconds that are too short
    one.time = step * np.arange(1, len(next(iter(one.channels.values()))) + 1)
    two.time = step * np.arange(1, len(next(iter(two.channels.values()))) + 1) / (1.0 + drift) + 1e5
    begin = REST - max(0.0, -skew)
    given = map_of(loggers={"daq": {"samples": "means"}, "pod": {"samples": "means", "clock": "found"}})
    given["recordings"][0] = {
        "name": "one", "health": "unknown", "ambient": 24.0, "files": {"daq": "one.parquet", "pod": "two.parquet"},
        "segment": [begin, begin + 0.49],
    }  # fmt: skip
    for spec in given["signals"].values():
        if set(spec.get("channels", [spec.get("channel")])) <= set(second):
            spec["logger"] = "pod"
    result = bring(tmp_path, given, one=one, two=two)
    (finding,) = (f for f in result.findings if "clock of pod" in f.what)
    found = float(finding.taken.split()[0]), float(finding.taken.split()[-3])
    assert found[0] == pytest.approx(1e3 * skew, abs=0.1) and found[1] == pytest.approx(1e6 * drift, abs=100.0)
    # shared out anew over the intervals of the other clock, but right to a part of a sample
    assert off(result.recordings["one.nc"], truth, current=0.1, command=1e-5) == []


def test_instants_of_pulses_are_averaged_and_their_uncertainty_is_written(tmp_path):
    step = 5e-7
    s = simulated(step, duration=0.25)
    kept = slice(1, None, 4)  # 500 kS/s, each the value at an instant
    raw = log({name: values[kept] for name, values in s.items()}, "dc_minus", noisy=False)
    result = bring(tmp_path, map_of("dc_minus", "instants"), log=raw)
    recording = result.recordings["one.nc"]
    coarse = simulated(INTERVAL, duration=0.25)
    begin = round((raw.time[0] % INTERVAL) / step)
    moved = {n: np.roll(v, -begin, axis=0) for n, v in s.items()}
    wanted = moved["phase_voltage"][: len(recording.time) * 400].reshape(-1, 400, 3).mean(axis=1)
    error = recording.phase_voltage - wanted
    noise = recording.known["phase_voltage"]["noise"]
    assert 0.3 < np.sqrt(np.mean(error**2)) / noise < 1.5 and noise > NOISE["u"]
    assert any("a 200 us mean is uncertain by" in text for text in result.lost["one"])
    assert recording.phase_current_end is not None and len(coarse["time"]) >= len(recording.time)


def test_what_was_not_measured_is_told(fine, truth, tmp_path):
    given = map_of()
    given["signals"]["phase_current"]["channels"][1] = None
    for name in ("bus_voltage", "rotor_speed"):
        del given["signals"][name]
    result = bring(tmp_path, given, log=log(fine).change(ic=np.negative))
    recording = result.recordings["one.nc"]
    # the phase that was not measured has the noise of two, the speed that of the angle
    errors = np.sqrt(np.mean((recording.phase_current - truth["phase_current"]) ** 2, axis=0))
    assert errors == pytest.approx([0.005, 0.0071, 0.005], rel=0.1)
    assert np.sqrt(np.mean((recording.rotor_speed - truth["rotor_speed"]) ** 2)) < 2e-4 / INTERVAL
    assert recording.bus_voltage is None and recording.known["phase_current"] == {"derived": "b"}
    told = " ".join(result.lost["one"])
    assert all(text in told for text in ("third current", "no end currents", "no bus voltage", "no rotor_speed"))


@pytest.mark.parametrize("wiring", ["abc", "cba"])
def test_hall_sensors_do_for_an_encoder(wiring, fine, truth, tmp_path):
    raw = log(fine)
    x = ACTUATOR.pole_pairs * fine["rotor_angle"] + 0.4
    halls = {f"h{'abc'[k]}": (np.sin(x - 2.0 * np.pi / 3.0 * k) > 0.0).astype(float) for k in range(3)}
    raw.channels |= halls
    raw.units |= dict.fromkeys(halls, "1")
    given = map_of()
    given["signals"]["rotor_angle"] = {"hall": [f"h{letter}" for letter in wiring]}
    result = bring(tmp_path, given, log=raw)
    recording = result.recordings["one.nc"]
    assert set(off(recording, truth)) <= {"rotor_angle"} and recording.known["rotor_angle"] == {"source": "hall"}
    turn = recording.rotor_angle - truth["rotor_angle"]
    turn = ACTUATOR.pole_pairs * (turn - ELECTRICAL * np.round(np.median(turn) / ELECTRICAL))
    moving = np.abs(truth["rotor_speed"]) > 50.0
    assert np.sqrt(np.mean(turn[moving] ** 2)) < np.deg2rad(3.0)
    assert any("hall edges" in text for text in result.lost["one"])


def test_pulse_uncertainty_is_that_of_edges_between_samples():
    # 48 V, 20 kHz at 100 kS/s and at 10 MS/s; and against pulses that keep step with the samples
    assert pulse_uncertainty(48.0, 20e3, 1e-5) == pytest.approx(3.9, abs=0.05)
    assert pulse_uncertainty(48.0, 20e3, 1e-7) == pytest.approx(0.039, abs=0.001)
    rng = np.random.default_rng(3)
    rise, width = rng.uniform(0.0, 5e-5, 2000), rng.uniform(1e-5, 4e-5, 2000)
    time = 1e-5 * np.arange(21)
    means = []
    for begin, long in zip(rise, width):
        pulses = 48.0 * (np.mod(time - begin, 5e-5) < long)
        means.append(Signal(time, pulses, False, "", "").means(np.array([0.0, 2e-4]))[0] - 48.0 * long / 5e-5)
    assert np.std(means) == pytest.approx(pulse_uncertainty(48.0, 20e3, 1e-5), rel=0.05)


def test_means_are_exact_for_any_edges():
    rng = np.random.default_rng(1)
    time = np.sort(rng.uniform(0.0, 1.0, 40))
    values = rng.standard_normal(40)
    edges = np.sort(rng.uniform(time[0], time[-1], 9))
    fine_time = np.linspace(edges[0], edges[-1], 400_001)
    line = np.interp(fine_time, time, values)
    total = np.concatenate([[0.0], np.cumsum(0.5 * (line[1:] + line[:-1]) * np.diff(fine_time))])
    expected = np.diff(np.interp(edges, fine_time, total)) / np.diff(edges)
    assert Signal(time, values, False, "", "").means(edges) == pytest.approx(expected, abs=1e-7)
    uniform = 0.1 * np.arange(1, 41)
    stepped = Signal(uniform, values, True, "", "")
    assert stepped.means(np.array([0.0, 0.1, 0.3])) == pytest.approx([values[0], values[1:3].mean()])
    assert stepped.means(np.array([0.05, 0.15])) == pytest.approx([0.5 * (values[0] + values[1])])

"""Benches that must be refused, set aside or limited, each in one line."""

from dataclasses import replace

import numpy as np
import pytest

from emafault.errors import InputError
from emafault.io.bench import check_bench, read_bench
from emafault.io.recording import write_recording
from emafault.io.sensors import clipped, cut_off, refuse_mistaken

SWAPPED = [1, 0, 2]
CYCLED = [1, 2, 0]
NAME = "recording_2.nc"


def _phases(recording, order, *variables):
    return replace(recording, **{v: getattr(recording, v)[:, order] for v in variables})


def _clip(recording, variable, share):
    values = getattr(recording, variable)
    level = share * np.max(np.abs(values))
    return replace(recording, **{variable: np.clip(values, -level, level)})


def _every(recording, step):
    names = ("time", "phase_voltage", "phase_current", "rotor_speed", "rotor_angle", "output_position")
    picked = {n: getattr(recording, n)[step - 1 :: step] for n in (*names, "commanded_position")}
    return replace(recording, **picked, phase_current_end=None, bus_voltage=None)


def _frozen(recording):
    angle = recording.rotor_angle.copy()
    fastest = int(np.argmax(np.abs(recording.rotor_speed)))
    angle[fastest - 50 : fastest + 50] = angle[fastest - 50]
    return replace(recording, rotor_angle=angle)


def _still(recording):
    values = {n: np.zeros_like(getattr(recording, n)) for n in ("commanded_position", "output_position")}
    rng = np.random.default_rng(0)
    count = len(recording.time)
    values |= {"rotor_angle": 1e-4 * rng.standard_normal(count), "rotor_speed": 0.3 * rng.standard_normal(count)}
    return replace(recording, **values)


CURRENTS = ("phase_current", "phase_current_end")
MISTAKEN = {
    "currents swapped": (lambda r: _phases(r, SWAPPED, *CURRENTS), "phase_current"),
    "mean currents swapped": (lambda r: _phases(r, SWAPPED, "phase_current"), "phase_current"),
    "voltages swapped": (lambda r: _phases(r, SWAPPED, "phase_voltage"), "phase_voltage"),
    "phases cycled": (lambda r: _phases(r, CYCLED, *CURRENTS, "phase_voltage"), "rotor_angle"),
    "currents negative": (lambda r: replace(r, **{n: -getattr(r, n) for n in CURRENTS}), "phase_current"),
    "speed negative": (lambda r: replace(r, rotor_speed=-r.rotor_speed), "rotor_speed"),
    "speed in rpm": (lambda r: replace(r, rotor_speed=r.rotor_speed * 30 / np.pi), "rotor_speed"),
    "degrees": (lambda r: replace(r, output_position=np.rad2deg(r.output_position)), "output_position"),
    "command for position": (
        lambda r: replace(r, output_position=r.commanded_position, commanded_position=r.output_position),
        "output_position",
    ),
    "command's sign": (
        lambda r: replace(r, commanded_position=-r.commanded_position),
        "commanded_position goes against",
    ),
    "command in degrees": (
        lambda r: replace(r, commanded_position=np.rad2deg(r.commanded_position)),
        "commanded_position is 57.3 times what output_position follows, as if in degrees",
    ),
    "command in turns": (
        lambda r: replace(r, commanded_position=r.commanded_position / (2.0 * np.pi)),
        "commanded_position is 0.159 times what output_position follows, as if in turns",
    ),
    "command dead": (
        lambda r: replace(r, commanded_position=0.0 * r.commanded_position),
        "commanded_position never changes while output_position moves",
    ),
    "command of another motion": (
        lambda r: replace(r, commanded_position=0.05 * np.sin(40.0 * r.time)),
        "output_position does not follow commanded_position",
    ),
    "kelvin": (lambda r: replace(r, ambient_temperature=r.ambient_temperature + 273.15), "ambient_temperature"),
}
USELESS = {
    "still": (_still, "commanded_position"),
    "current clips": (lambda r: _clip(r, "phase_current", 0.1), "phase_current"),
    "voltage clips": (lambda r: _clip(r, "phase_voltage", 0.1), "phase_voltage"),
    "speed clips": (lambda r: _clip(r, "rotor_speed", 0.6), "rotor_speed"),
    "angle frozen": (_frozen, "rotor_angle"),
    "slow": (lambda r: _every(r, 10), "time"),
    "cut": (lambda r: replace(r, output_position=r.output_position + 0.1), "output_position"),
}


@pytest.mark.parametrize("kind", MISTAKEN)
def test_mistaken_sensors_refuse_the_bench(plain, shop, kind):
    change, variable = MISTAKEN[kind]
    with pytest.raises(InputError) as refusal:
        check_bench("bench", plain | {NAME: change(plain[NAME])}, shop.actuator)
    text = str(refusal.value)
    assert text.startswith(f"{NAME}: {variable}") and "\n" not in text


@pytest.mark.parametrize("kind", USELESS)
def test_useless_recordings_are_set_aside_with_a_warning_or_refused_where_nothing_is_left(plain, shop, kind):
    change, variable = USELESS[kind]
    bench = check_bench("bench", plain | {NAME: change(plain[NAME])}, shop.actuator)
    assert NAME not in bench.recordings and len(bench.recordings) == 3
    (warning,) = [w for w in bench.warnings if w["kind"] == "set aside"]
    assert warning["file"] == NAME and warning["variable"] == variable
    with pytest.raises(InputError, match=NAME):
        check_bench("bench", {NAME: change(plain[NAME])}, shop.actuator)


@pytest.mark.parametrize("variable", ["phase_current", "phase_voltage"])
def test_a_recording_that_clips_here_and_there_is_kept_and_its_samples_are_known(plain, shop, variable):
    cut = _clip(plain[NAME], variable, 0.7)
    bench = check_bench("bench", plain | {NAME: cut}, shop.actuator)
    assert NAME in bench.recordings
    assert cut_off(plain[NAME]) == {}
    ((name, where),) = cut_off(cut).items()
    changed = getattr(cut, variable) != getattr(plain[NAME], variable)
    told = where.any(axis=0)  # of a phase that loses a few samples nothing is told
    assert name == variable and told.any() and np.array_equal(where[:, told], changed[:, told])
    assert changed[:, ~told].sum(axis=0).max(initial=0) < 20


def test_a_good_bench_passes_whole_with_strong_effects_too(plain, shop):
    assert not [w for w in check_bench("bench", plain, shop.actuator).warnings if w["kind"] == "set aside"]
    strong = {
        "angle_offset": {"offset": 5.0},
        "current_gain": {"g_a": 1.02, "g_b": 0.98, "g_c": 1.0},
        "speed_quantisation": {"step": 5.0},
        "virtual_neutral": {"on": 1.0},
        "load_constant": {"T": 10.0},
    }
    for effect, values in strong.items():
        found = check_bench("bench", shop.make_bench({effect: values}), shop.actuator)
        assert len(found.recordings) == 4, effect
    # without noise values repeat exactly, which must not count as clipping
    assert len(check_bench("bench", shop.make_bench(clean=True), shop.actuator).recordings) == 4


def test_a_coarsely_truncated_speed_is_no_mistaken_sensor_but_a_wrong_sign_or_unit_is(plain, shop):
    recording = plain[NAME]
    time = recording.interval * np.arange(1, len(recording.time) + 1)
    angle = 0.6 * (1.0 - np.cos(2.0 * np.pi * 1.7 * time))
    speed = np.gradient(angle, recording.interval)
    slow = replace(recording, rotor_angle=angle, output_position=angle / shop.actuator.gear_ratio)
    refuse_mistaken(NAME, replace(slow, rotor_speed=3.7 * np.floor(speed / 3.7)), shop.actuator)
    for wrong in (-speed, speed * 30.0 / np.pi):
        with pytest.raises(InputError, match="rotor_speed"):
            refuse_mistaken(NAME, replace(slow, rotor_speed=wrong), shop.actuator)


def test_a_coarse_speed_that_is_zero_in_a_slow_motion_does_not_clip(plain, shop):
    ramp = plain["recording_1.nc"]
    slow = replace(ramp, rotor_speed=np.minimum(5.0 * np.trunc((ramp.rotor_speed + 120.0) / 5.0), 0.0))
    assert (slow.rotor_speed == 0.0).sum() > 8
    assert not [rule for _, rule in clipped(slow) if "0 rad/s" in rule]


def _with(shop, **factors):
    """A bench under a controller whose settings are off by factors, in commands slow and fast."""
    actuator = replace(shop.actuator, **{n: f * getattr(shop.actuator, n) for n, f in factors.items()})
    plans = (
        ("step", {"amplitude": 0.05, "time": 0.0}, 20.0, "healthy"),
        ("ramp", {"speed": 1.5}, 20.0, "healthy"),
        ("sine", {"amplitude": 0.013, "frequency": 6.0}, 20.0, "healthy"),
        ("chirp", {"amplitude": 0.02, "frequency_start": 1.0, "frequency_end": 12.0}, 20.0, "healthy"),
    )
    return shop.make_bench({"speed_latency": {"tau": 0.005}}, plans, actuator=actuator)


@pytest.mark.parametrize(
    "factors",
    [
        {"position_gain": 0.2},
        {"position_gain": 3.0},
        {"position_gain": 3.0, "speed_gain": 0.3, "speed_integral_gain": 0.3},
        {"speed_limit": 0.3},
        {"current_limit": 0.3},
    ],
    ids=str,
)
def test_a_controller_off_by_far_is_no_mistaken_command(shop, factors):
    for name, recording in _with(shop, **factors).items():
        refuse_mistaken(name, recording, shop.actuator)


def test_a_command_beyond_the_end_stop_is_no_other_unit(shop):
    """The output waits there while the command runs on, to thirty times as far."""
    plan = ("parabolic", {"acceleration": 0.3}, 20.0, "healthy")
    for name, recording in shop.make_bench({}, (plan,), duration=10.0).items():
        assert np.ptp(recording.commanded_position) > 25.0 * np.ptp(recording.output_position)
        refuse_mistaken(name, recording, shop.actuator)


def test_a_ramp_in_degrees_is_told_from_one_too_fast(plain, shop):
    """The nominal actuator cannot follow either, but what it does at a quarter of its speed is no limit."""
    ramp = plain["recording_1.nc"]
    with pytest.raises(InputError, match="as if in degrees"):
        refuse_mistaken("r.nc", replace(ramp, commanded_position=np.rad2deg(ramp.commanded_position)), shop.actuator)


def test_two_units_copies_and_broken_files(plain, shop, tmp_path):
    other = replace(plain[NAME], attributes=plain[NAME].attributes | {"unit": "unit 8"})
    with pytest.raises(InputError, match=r"recording_2\.nc: unit is 'unit 8'"):
        check_bench("bench", plain | {NAME: other}, shop.actuator)
    copied = check_bench("bench", plain | {"zz.nc": plain[NAME]}, shop.actuator)
    assert "zz.nc" not in copied.recordings and "same data as recording_2.nc" in copied.warnings[0]["message"]
    for name, recording in plain.items():
        write_recording(tmp_path / name, recording)
    assert list(read_bench(tmp_path, shop.actuator).recordings) == sorted(plain)
    (tmp_path / NAME).write_bytes((tmp_path / NAME).read_bytes()[:5000])
    with pytest.raises(InputError, match=NAME):
        read_bench(tmp_path, shop.actuator)


def test_what_recordings_cannot_tell_is_said(plain, shop):
    one = check_bench("bench", {NAME: plain[NAME]}, shop.actuator).warnings
    said = " ".join(w["message"] for w in one)
    assert "single recording" in said and "temperature" in said and "no recording is called healthy" in said
    forward = check_bench("bench", {"recording_0.nc": plain["recording_0.nc"]}, shop.actuator).warnings
    assert any("one direction" in w["message"] for w in forward)
    bare = {n: replace(r, phase_current_end=None, bus_voltage=None) for n, r in plain.items()}
    messages = [w["variable"] for w in check_bench("bench", bare, shop.actuator).warnings]
    assert "phase_current_end" in messages and "bus_voltage" in messages

"""What a form does to what is recorded: each is what it says, and what lies in the machine is none of its business."""

import numpy as np
import pytest

from emafault.actuator.chain import Chain
from emafault.actuator.commands import command_positions
from emafault.actuator.grammar import FACTORS, OF_CHANNELS
from emafault.actuator.parameters import make_runs
from emafault.actuator.sensors import SensorNoise, measure
from emafault.actuator.simulate import simulate
from emafault.config import reference_actuator

ACTUATOR, STEP = reference_actuator(), 2e-4
RUNS = make_runs(ACTUATOR, np.zeros((1, 6)), theta_0=0.7)
COMMAND = command_positions("reversal", {"amplitude": 0.02, "speed": 0.25}, 0.2, ACTUATOR.control_period)
SILENT = SensorNoise(*[0.0] * 8)


@pytest.fixture(scope="module")
def true():
    return simulate(RUNS, COMMAND, 0.2, STEP)


def changed(true, **entry):
    """What an entry changes of the signals of the one run."""
    out = measure(true, RUNS, SILENT, 1, unlisted=[entry], interval=STEP)
    return {name: out[name][0] - x[0] for name, x in true.items() if not np.array_equal(out[name][0], x[0])}


def test_shapes_are_added_where_the_interval_is(true):
    n, end = np.arange(1000), STEP * (np.arange(1000) + 1)
    got = changed(true, place="current_b", form="frequency", amplitude=0.1, frequency=50.0, phase=0.3)
    assert set(got) == {"phase_current", "phase_current_end"}
    wave = 0.1 * np.cos(100.0 * np.pi * STEP * (n + 0.5) + 0.3)
    np.testing.assert_allclose(got["phase_current"], np.outer(wave, [0, 1, 0]), atol=1e-12)
    np.testing.assert_allclose(got["phase_current_end"][:, 1], 0.1 * np.cos(100.0 * np.pi * end + 0.3), atol=1e-12)
    (angle,) = changed(true, place="angle", form="order", amplitude=0.01, order=1.0, phase=0.5).values()
    np.testing.assert_allclose(angle, 0.01 * np.cos(true["rotor_angle"][0] + 0.5), atol=1e-12)
    (jump,) = changed(true, place="voltage", form="step_change", jump=0.4, time=0.1).values()
    np.testing.assert_allclose(jump, np.outer(n >= 500, [0.4] * 3), atol=1e-12)


def test_factors_multiply(true):
    always = {"form": "step_change", "jump": 0.02, "time": 0.0}
    speed, i = true["rotor_speed"][0], true["phase_current"][0]
    np.testing.assert_allclose(changed(true, place="speed_scale", **always)["rotor_speed"], 0.02 * speed, atol=1e-9)
    gained = changed(true, place="current_gain_c", **always)["phase_current"]
    np.testing.assert_allclose(gained, 0.02 * i * [0, 0, 1], atol=1e-12)
    played = changed(true, place="output_play", **always)["output_position"]
    np.testing.assert_allclose(played, 0.02 * np.sign(speed), atol=1e-12)
    twisted = changed(true, place="output_twist", **always)["output_position"]
    np.testing.assert_allclose(twisted, 0.02 * np.gradient(speed, STEP), atol=1e-9)
    back = changed(true, place="voltage_per_speed_a", **always)["phase_voltage"][:, 0]
    flat = np.abs(np.cos(4.0 * true["rotor_angle"][0] - np.pi / 2)) > 0.8  # well within the plateau
    np.testing.assert_allclose(np.abs(back[flat]), 0.02 * np.abs(speed[flat]), rtol=1e-9, atol=1e-9)
    assert set(FACTORS) == {"speed_scale", "output_play", "output_twist"} | {
        f"{quantity}_{j}" for quantity in ("current_gain", "voltage_per_speed") for j in "abc"
    }


def test_channels_faults(true):
    i, v = true["phase_current"][0], true["phase_voltage"][0]
    talk = changed(true, place="current_a", form="crosstalk", source="b", gain=0.1)
    np.testing.assert_allclose(talk["phase_current"], 0.1 * np.outer(i[:, 1], [1, 0, 0]), atol=1e-12)
    np.testing.assert_allclose(talk["phase_current_end"][:, 0], 0.1 * true["phase_current_end"][0, :, 1], atol=1e-12)
    talk = changed(true, place="voltage_c", form="crosstalk", source="b", gain=0.1)["phase_voltage"]
    np.testing.assert_allclose(talk, 0.1 * np.outer(v[:, 1], [0, 0, 1]), atol=1e-12)
    picked = changed(true, place="current", form="pickup", gain=1e-3)
    np.testing.assert_allclose(picked["phase_current_end"], 1e-3 * v, atol=1e-12)
    one = changed(true, place="current_b", form="pickup", gain=1e-3)["phase_current"]
    np.testing.assert_allclose(one, 1e-3 * v * [0.0, 1.0, 0.0], atol=1e-12)
    late = changed(true, place="voltage", form="lag", lag=0.3)["phase_voltage"]
    np.testing.assert_allclose(late[1:], 0.3 * (v[:-1] - v[1:]), atol=1e-12)
    early = changed(true, place="output", form="lag", lag=-1.0)["output_position"]
    np.testing.assert_allclose(early[:-1], np.diff(true["output_position"][0]), atol=1e-12)
    smooth = changed(true, place="current", form="smoothing", delay=0.4)["phase_current_end"]
    smooth = smooth + true["phase_current_end"][0]
    back = smooth[1:] + 0.4 * np.diff(smooth, axis=0)
    np.testing.assert_allclose(back, true["phase_current_end"][0, 1:], atol=1e-12)
    passed = changed(true, place="speed", form="low_pass", delay=3.0)["rotor_speed"] + true["rotor_speed"][0]
    at = slice(500, 900)  # of a steady acceleration: late by the time constant
    rate = np.gradient(true["rotor_speed"][0])
    np.testing.assert_allclose((true["rotor_speed"][0] - passed)[at].mean(), 3.0 * rate[at].mean(), rtol=0.1)
    mean = changed(true, place="speed", form="averaging", samples=5.0)["rotor_speed"] + true["rotor_speed"][0]
    np.testing.assert_allclose(mean[4:], np.convolve(true["rotor_speed"][0], np.full(5, 0.2), "valid"), atol=1e-9)
    bent = changed(true, place="voltage", form="sensor_curve", bend=0.05)["phase_voltage"]
    np.testing.assert_allclose(bent, -0.05 * v * (v / 24.0) ** 2, atol=1e-12)
    halves = changed(true, place="current_a", form="sensor_curve", halves=0.01)["phase_current"]
    np.testing.assert_allclose(halves, 0.01 * np.outer(np.abs(i[:, 0]), [1, 0, 0]), atol=1e-12)
    dead = changed(true, place="current", form="sensor_curve", dead=0.05)["phase_current"] + i
    np.testing.assert_allclose(dead, np.sign(i) * np.maximum(np.abs(i) - 0.05, 0.0), atol=1e-12)
    less = changed(true, place="voltage", form="drop", drop=0.7, turn=0.05)["phase_voltage"]
    np.testing.assert_allclose(less, 0.7 * np.tanh(i / 0.05), atol=1e-12)
    one = changed(true, place="voltage_b", form="drop", drop=0.7, turn=0.05)["phase_voltage"]
    np.testing.assert_allclose(one, less * [0.0, 1.0, 0.0], atol=1e-12)
    drift = changed(true, place="current_c", form="drift", at_end=0.2)["phase_current"][:, 2]
    np.testing.assert_allclose(drift, 0.2 * (np.arange(1000) + 0.5) / 1000, atol=1e-12)
    level = changed(true, place="current_c", form="drift", at_start=0.1, at_end=0.2)["phase_current"][:, 2]
    np.testing.assert_allclose(level, 0.1 + 0.1 * (np.arange(1000) + 0.5) / 1000, atol=1e-12)
    gained = changed(true, place="voltage", form="gain", gain=0.02)["phase_voltage"]
    np.testing.assert_allclose(gained, 0.02 * v, atol=1e-12)
    share = (np.arange(1000) + 0.5) / 1000
    growing = changed(true, place="current", form="gain", gain=0.02, growth=0.01)["phase_current"]
    np.testing.assert_allclose(growing, (0.02 + 0.01 * share)[:, None] * i, atol=1e-12)
    scaled = changed(true, place="output", form="gain", gain=0.01)["output_position"]
    np.testing.assert_allclose(scaled, 0.01 * true["output_position"][0], atol=1e-12)
    growing = changed(true, place="voltage_b", form="gain", gain=0.0, growth=0.01)["phase_voltage"]
    np.testing.assert_allclose(growing, np.outer(0.01 * share * v[:, 1], [0, 1, 0]), atol=1e-12)


def test_a_logger_has_a_clock_of_its_own(true):
    """Late by an amount that grows with time, all that it records alike; instants that scatter by themselves."""
    n = np.arange(1000)
    got = changed(true, place="positions", form="clock", late=0.5, rate=2e-3)
    assert set(got) == {"rotor_angle", "output_position"}
    angle = true["rotor_angle"][0]
    wanted = np.interp(n - 0.5 - 2e-3 * (n + 1.0), n, angle)
    np.testing.assert_allclose((angle + got["rotor_angle"])[1:], wanted[1:], atol=2e-4)
    scattered = changed(true, place="angle", form="clock", scatter=2e-5)["rotor_angle"]
    fast = np.abs(true["rotor_speed"][0]) > 50.0
    assert np.std(scattered[fast] / true["rotor_speed"][0, fast]) == pytest.approx(2e-5, rel=0.1)
    assert set(changed(true, place="motion", form="clock", rate=1e-3)) == {"rotor_speed", *got}


def test_samples(true):
    i = true["phase_current"][0]
    cut = changed(true, place="current_a", form="clipping", level=0.5)["phase_current"]
    np.testing.assert_allclose(cut[:, 0], np.clip(i[:, 0], -0.5, 0.5) - i[:, 0], atol=1e-12)
    stepped = changed(true, place="current", form="adc_step", step=0.1)["phase_current"] + i
    np.testing.assert_allclose(stepped, 0.1 * np.round(stepped / 0.1), atol=1e-12)
    held = changed(true, place="current", form="held", share=0.05)["phase_current"] + i
    assert 30 <= (np.diff(held, axis=0) == 0.0).all(axis=1).sum() <= 60  # hits next to one another count once more
    spikes = changed(true, place="current_b", form="spikes", share=0.02, level=2.0)["phase_current"]
    assert (spikes != 0.0).sum() == 20 and 1.0 < np.std(spikes[spikes != 0.0]) < 3.0
    assert set(OF_CHANNELS) == {
        "crosstalk", "pickup", "lag", "smoothing", "low_pass", "butterworth", "averaging", "sensor_curve", "gain",
        "drop", "drift", "clipping", "adc_step", "held", "hold", "spikes", "clock",
    }  # fmt: skip


def test_noise_is_the_same_and_what_lies_in_the_machine_is_not_recorded(true):
    noise = SensorNoise(0.05, 0.01, 0.01, 0.1, 1e-4, 1e-5, 0.05, 0.5)
    plain = measure(true, RUNS, noise, 7)
    drifting = [{"place": "current_c", "form": "drift", "at_end": 0.2}]
    torque = [{"place": "torque", "form": "step_change", "jump": 0.1, "time": 0.0}]
    with_drift = measure(true, RUNS, noise, 7, unlisted=[*torque, *drifting], interval=STEP)
    np.testing.assert_array_equal(with_drift["phase_voltage"], plain["phase_voltage"])
    off = with_drift["phase_current"] - plain["phase_current"]
    np.testing.assert_allclose(off[0, -1], [0.0, 0.0, 0.2 * 999.5 / 1000], atol=1e-9)


def test_a_recording_has_values_of_its_own_and_a_phase_left_out_is_another_in_each_run(true):
    entry = {"place": "current_a", "form": "frequency", "amplitude": 0.1, "frequency": 50.0}
    own = entry | {"recordings": {"one.nc": {"phase": 1.0}}}

    def mean(number, recording=""):
        signals = {name: x[0].copy() for name, x in true.items()}
        Chain([own], RUNS[0], STEP, 1, number, recording).before_noise(signals)
        return signals["phase_current"][:, 0] - true["phase_current"][0, :, 0]

    wave = 0.1 * np.cos(100.0 * np.pi * STEP * (np.arange(1000) + 0.5) + 1.0)
    np.testing.assert_allclose(mean(0, "one.nc"), wave, atol=1e-12)
    assert not np.allclose(mean(0), mean(1)) and np.allclose(np.abs(mean(0)).max(), 0.1, rtol=1e-2)

"""Low-pass filters of recordings: half of the power at the cutoff, what is digital passes, other datasets stay."""

import numpy as np
import pytest
from scipy.signal import freqz

from emafault import config
from emafault.dataset import simulate_blocks
from emafault.errors import InputError
from emafault.filters import coefficients, low_passed, undone


def first_order(cutoff, before_noise=False):
    return {"kind": "first_order", "cutoff": cutoff, "before_noise": before_noise}


@pytest.mark.parametrize("kind", ["first_order", "moving_average"])
@pytest.mark.parametrize("before_noise", [False, True])
def test_half_of_the_power_passes_at_the_cutoff(kind, before_noise):
    interval, settings = 1e-5, {"kind": kind, "cutoff": 300.0, "before_noise": before_noise}
    _, response = freqz(*coefficients(interval, settings), worN=[0.0, 300.0, 9000.0], fs=1.0 / interval)
    power = np.abs(response) ** 2
    assert power[0] == pytest.approx(1.0) and power[1] == pytest.approx(0.5, abs=0.02) and power[2] < 2e-3


@pytest.mark.parametrize("cutoff", [200.0, 20_000.0])
def test_a_sensors_filter_is_late_by_its_time_constant(cutoff):
    time = 2e-4 * np.arange(1, 301)
    out = low_passed({"rotor_speed": time[None]}, 2e-4, first_order(cutoff, before_noise=True))["rotor_speed"][0]
    np.testing.assert_allclose(time[-10:] - out[-10:], 1.0 / (2.0 * np.pi * cutoff), rtol=1e-6)


@pytest.mark.parametrize("before_noise", [False, True])
def test_a_known_filter_is_undone(before_noise):
    values = np.random.default_rng(0).normal(size=(2, 400, 3))
    settings = first_order(1000.0, before_noise)
    late = low_passed({"phase_current": values}, 2e-4, settings)
    np.testing.assert_allclose(undone(late, 2e-4, settings)["phase_current"], values, atol=1e-9)
    with pytest.raises(InputError, match=r"recording\.filter\.undone"):
        config.compose("paper", ["recording.filter.kind=moving_average", "recording.filter.undone=true"])


def test_angles_pass_and_the_rest_is_averaged():
    x = np.arange(12.0).reshape(1, 12)
    signals = {"rotor_speed": x, "rotor_angle": x, "phase_current": np.repeat(x[..., None], 3, axis=2)}
    out = low_passed(signals, 2e-4, {"kind": "moving_average", "cutoff": 0.443 / (2 * 2e-4)})
    np.testing.assert_allclose(out["rotor_speed"][0, 1:], x[0, 1:] - 0.5)
    np.testing.assert_allclose(out["phase_current"][0, 1:, 2], x[0, 1:] - 0.5)
    assert out["rotor_angle"] is x
    np.testing.assert_array_equal(low_passed(signals, 2e-4, {"kind": "none"})["rotor_speed"], x)


def test_noise_is_filtered_by_the_logger_alone():
    few = ["sampling.fresh=10", "recording.duration=0.3"]
    made = {}
    for name, more in {
        "none": [],
        "sensor": ["recording.filter.kind=moving_average", "recording.filter.before_noise=true"],
        "logger": ["recording.filter.kind=moving_average"],
    }.items():
        spec = config.dataset_spec(config.compose("paper", [*few, *more, "recording.filter.cutoff=443"]), "fresh")
        assert ("filter" in spec["recording"]) == (name != "none")  # datasets without are those that they were
        (made[name],) = (block.signals for block in simulate_blocks(spec, 0, 2))
    rough = {name: np.std(np.diff(s["rotor_speed"], axis=1)) for name, s in made.items()}
    assert rough["sensor"] == pytest.approx(rough["none"], rel=0.05)
    assert rough["logger"] < 0.35 * rough["none"]
    np.testing.assert_array_equal(made["none"]["rotor_angle"], made["logger"]["rotor_angle"])
    assert np.std(np.diff(made["sensor"]["phase_voltage"])) < np.std(np.diff(made["none"]["phase_voltage"]))

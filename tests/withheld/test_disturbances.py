"""Disturbances of mixed cases: each changes what it says and nothing else, the same for the same seed."""

import numpy as np
import pytest

from emafault.errors import InputError
from emafault.recording import Recording
from emafault.withheld.disturbances import DISTURBANCES, disturbed, draw_controller


@pytest.fixture(scope="module")
def recording():
    rng = np.random.default_rng(1)
    size = 500
    return Recording(
        time=(np.arange(size) + 1) * 2e-4, phase_voltage=rng.normal(0.0, 5.0, (size, 3)),
        phase_current=rng.normal(0.0, 2.0, (size, 3)), phase_current_end=rng.normal(0.0, 2.0, (size, 3)),
        rotor_speed=rng.normal(size=size), rotor_angle=rng.normal(size=size), output_position=rng.normal(size=size),
        commanded_position=rng.normal(size=size), bus_voltage=rng.normal(size=size), ambient_temperature=20.0,
        attributes={},
    )  # fmt: skip


@pytest.mark.parametrize("name", DISTURBANCES)
def test_only_the_channel_named_changes(recording, name):
    other = disturbed({"a.nc": recording}, name, 3)["a.nc"]
    channel = f"phase_{name.rsplit('_', 1)[1]}"
    changed = {
        c
        for c in ("phase_voltage", "phase_current", "rotor_speed", "rotor_angle", "output_position", "bus_voltage")
        if not np.array_equal(getattr(other, c), getattr(recording, c))
    }
    assert changed == {channel}
    again = disturbed({"a.nc": recording}, name, 3)["a.nc"]
    np.testing.assert_array_equal(getattr(again, channel), getattr(other, channel))


def test_another_controller_is_at_most_half_off():
    factors = [draw_controller(seed) for seed in range(50)]
    values = np.array([list(f.values()) for f in factors])
    assert values.min() >= 0.5 and values.max() <= 1.5 and np.ptp(values) > 0.8


def test_an_unknown_disturbance_is_refused(recording):
    with pytest.raises(InputError, match="gremlin"):
        disturbed({"a.nc": recording}, "gremlin", 0)

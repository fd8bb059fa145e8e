"""Noise of channels: estimated, or as recordings state it."""

from dataclasses import asdict, replace

import pytest

from emafault.actuator.sensors import SensorNoise
from emafault.equations.signals import estimated_noise

from .conftest import NOISE, recorded


def test_stated_noise_is_taken_where_every_recording_states_it():
    plain = recorded()
    stating = [replace(plain, known={"phase_voltage": {"noise": sigma}}) for sigma in (0.3, 0.4)]
    own = estimated_noise([plain, plain], NOISE)
    assert estimated_noise([stating[0], plain], NOISE) == own and own.voltage == NOISE.voltage
    stated = estimated_noise(stating, NOISE)
    assert stated.voltage == pytest.approx((0.5 * (0.09 + 0.16)) ** 0.5) and stated.current == own.current


@pytest.mark.parametrize("offset", [0.0, 0.05, 0.5])
def test_the_currents_noise_is_found_whatever_their_offsets(offset):
    of_unit = {"current_offset": {"o_a": offset, "o_b": -0.6 * offset, "o_c": 0.3 * offset}}
    recordings = [recorded(effects=of_unit, seed=seed) for seed in range(3)]
    found = estimated_noise(recordings, SensorNoise(**{**asdict(NOISE), "current": 0.02, "current_end": 0.05}))
    assert found.current == pytest.approx(NOISE.current, rel=0.08)
    assert found.current_end == pytest.approx(NOISE.current_end, rel=0.08)

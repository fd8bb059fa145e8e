"""Noise of channels: estimated, or as recordings state it."""

from dataclasses import replace

import pytest

from emafault.equations.signals import estimated_noise

from .conftest import NOISE, recorded


def test_stated_noise_is_taken_where_every_recording_states_it():
    plain = recorded()
    stating = [replace(plain, known={"phase_voltage": {"noise": sigma}}) for sigma in (0.3, 0.4)]
    own = estimated_noise([plain, plain], NOISE)
    assert estimated_noise([stating[0], plain], NOISE) == own and own.voltage == NOISE.voltage
    stated = estimated_noise(stating, NOISE)
    assert stated.voltage == pytest.approx((0.5 * (0.09 + 0.16)) ** 0.5) and stated.current == own.current

"""What recordings show of their measuring chain by themselves."""

from dataclasses import replace

import numpy as np
import pytest

from emafault.equations.quality import seen, told

from .conftest import in_steps, recorded


def test_what_a_range_cuts_off_is_clipped_and_neither_held_nor_a_spike():
    plain = recorded()
    highest = np.sort(plain.phase_current[:, 0])
    for samples in (5, 300):
        current = plain.phase_current.copy()
        current[:, 0] = np.minimum(current[:, 0], highest[-samples])
        channel = seen(replace(plain, phase_current=current))["phase_current"]
        assert channel.clipped > 0.0 and channel.level == highest[-samples]
        assert channel.held == channel.spikes == 0.0
        assert [t["form"] for t in told({"a.nc": {"phase_current": channel}})] == ["clipping"]


def test_samples_that_repeat_within_the_range_are_held():
    plain = recorded()
    current = plain.phase_current.copy()
    rows = np.arange(500, 2500, 100)
    current[rows] = current[rows - 1]
    channel = seen(replace(plain, phase_current=current))["phase_current"]
    assert channel.held > 0.0 and channel.clipped == 0.0


@pytest.mark.parametrize("late", [0.0, 0.5, 1.0])
def test_commutations_that_a_channels_gain_or_lag_shows_in_the_sum_are_no_spikes(late):
    plain = recorded("reversal")
    current = plain.phase_current * [1.08, 1.0, 1.0]
    at = np.arange(len(current))
    current[:, 0] = np.interp(at - late, at, current[:, 0])
    assert seen(replace(plain, phase_current=current))["phase_current"].spikes == 0.0
    rows = np.random.default_rng(2).choice(np.arange(2, len(current) - 2, 4), 30, replace=False)
    current[rows, 0] += 5.0
    assert seen(replace(plain, phase_current=current))["phase_current"].spikes == 30 / len(current)


def test_a_limit_that_a_coarse_converter_shows_again_and_again_is_no_clipping():
    """A current that its regulator holds at the limit for some samples is the same value in each of them."""
    coarse = in_steps(recorded(), {"phase_current": 0.05, "phase_current_end": 0.05})
    current = coarse.phase_current.copy()
    current[400:406, 0] = current.max() + 2.0
    current[[390, 392, 394], 0] = current.max() - np.array([0.05, 0.1, 0.15])  # on the way there
    assert [t["form"] for t in told({"a.nc": seen(replace(coarse, phase_current=current))})] == ["adc_step"]


def test_steps_of_the_speed_are_told_where_the_library_has_no_effect_for_them():
    coarse = in_steps(recorded(), {"rotor_speed": 0.5})
    assert told({"a.nc": seen(coarse)}) == []
    (entry,) = told({"a.nc": seen(coarse, ("cogging", "speed_quantisation"))})
    assert (entry["equation"], entry["form"]) == ("sensor_speed", "adc_step")
    assert entry["parameters"]["step"]["value"] == pytest.approx(0.5)

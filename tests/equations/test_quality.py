"""What recordings show of their measuring chain by themselves."""

from dataclasses import replace

import numpy as np
import pytest

from emafault.equations.quality import seen, told
from emafault.io.motion import calm_motion, slips, without_outliers
from emafault.schema import check_unlisted

from .conftest import NOISE, in_steps, recorded


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


COUNTS = 4 * 2.0 * np.pi / 4096


def test_counts_that_an_angle_loses_are_told_and_added():
    plain = recorded("reversal")
    angle = plain.rotor_angle + COUNTS * (plain.time > 0.2) - COUNTS * (plain.time > 0.35)
    lost = replace(plain, rotor_angle=angle)
    channel = seen(lost)["rotor_angle"]
    assert abs(channel.jump) == pytest.approx(COUNTS, abs=4e-4) and channel.spikes == 0.0
    assert min(abs(channel.at - t) for t in (0.2, 0.35)) < 1.5 * plain.interval
    (entry,) = told({"a.nc": {"rotor_angle": channel}, "b.nc": seen(plain)})
    assert (entry["equation"], entry["form"], entry["recordings"]) == ("sensor_angle", "step_change", ["a.nc"])
    assert entry["term"]["recordings"] == {"a.nc": {"jump": channel.jump, "time": channel.at}}
    check_unlisted([entry["term"]])
    np.testing.assert_allclose(calm_motion(lost).rotor_angle, calm_motion(plain).rotor_angle, atol=5e-4)


def no_more(plain):
    return plain


def new_in_one_sample_of_five(plain):
    return replace(plain, rotor_angle=plain.rotor_angle[np.arange(len(plain.time)) // 5 * 5])


def standing_still(plain):
    angle = plain.rotor_angle.copy()
    angle[2000:2025] = angle[2000]
    return replace(plain, rotor_angle=angle)


def without_a_row(plain):
    kept = np.delete(np.arange(len(plain.time)), 2000)
    angle, speed = plain.rotor_angle[kept], plain.rotor_speed[kept]
    command = plain.commanded_position[kept]
    return replace(plain, rotor_angle=angle, rotor_speed=speed, commanded_position=command, time=plain.time[:-1])


def sampled_at_instants_that_scatter(plain):
    late = 1e-5 * np.random.default_rng(1).standard_normal(len(plain.time))
    return replace(plain, rotor_angle=plain.rotor_angle + late * plain.rotor_speed)


@pytest.mark.parametrize(
    "change",
    [no_more, new_in_one_sample_of_five, standing_still, without_a_row, sampled_at_instants_that_scatter],
)
def test_an_angle_that_goes_its_own_way_has_lost_no_counts(change):
    assert len(slips(change(recorded("reversal")))[0]) == 0


def test_a_filter_of_the_speed_loses_no_counts_of_the_angle():
    assert len(slips(recorded("step", effects={"speed_latency": {"tau": 2e-3}}))[0]) == 0


@pytest.mark.parametrize("spike", [0.03, -0.05])
def test_spikes_of_an_angle_that_turns_fast_are_found(spike):
    """From one neighbour of a spike to the other it turns by more than the spike."""
    plain = recorded("reversal")
    fast = np.flatnonzero(np.abs(np.diff(plain.rotor_angle)) > 0.02)[20::40]
    assert len(fast) > 10 and not len(without_outliers(plain.rotor_angle)[1])
    angle = plain.rotor_angle.copy()
    angle[fast] += spike
    calm, rows = without_outliers(angle)
    assert rows.tolist() == fast.tolist()
    np.testing.assert_allclose(calm, plain.rotor_angle, atol=6.0 * NOISE.angle)


@pytest.mark.parametrize("per_sample", [0.03, 4.98, 13.03])
def test_counts_of_an_encoder_at_an_even_speed_are_no_spikes(per_sample):
    """All differences but few are the same then, and a count more stands out of them."""
    counts = np.floor(per_sample * np.arange(3000))
    assert not len(without_outliers(1.534e-3 * counts)[1])
    counts[1000] += 40.0
    assert without_outliers(1.534e-3 * counts)[1].tolist() == [1000]


def test_two_spikes_beside_each_other_are_no_lost_counts():
    plain = recorded("reversal")
    angle = plain.rotor_angle.copy()
    angle[1500] += 0.0272
    angle[1503] -= 0.0157
    assert len(slips(replace(plain, rotor_angle=angle))[0]) == 0

"""Recordings that are faster than their angle."""

from dataclasses import replace

import numpy as np
import pytest

from emafault.io.bench import check_bench
from emafault.io.joined import joined

from .conftest import ACTUATOR, EVERY, held, lines, recorded


@pytest.mark.parametrize("how", [held, lines])
def test_intervals_end_where_the_angle_is_new(how):
    plain = recorded("sine")
    slow = replace(plain, rotor_angle=how(plain.rotor_angle), rotor_speed=held(plain.rotor_speed))
    found, period = joined(slow)
    assert period == EVERY and found.interval == pytest.approx(EVERY * plain.interval)
    ends = np.arange(EVERY, len(plain.time), EVERY)
    assert found.rotor_angle == pytest.approx(plain.rotor_angle[ends])
    assert found.output_position == pytest.approx(plain.output_position[ends])
    assert found.phase_current_end == pytest.approx(plain.phase_current_end[ends])
    assert found.rotor_speed == pytest.approx(plain.rotor_speed[ends])
    means = [plain.phase_voltage[n - EVERY + 1 : n + 1].mean(axis=0) for n in ends]
    assert found.phase_voltage == pytest.approx(np.array(means))


def test_a_recording_as_fast_as_its_angle_stays_as_it_is():
    plain = recorded("sine")
    assert joined(plain) == (plain, 1)


def test_a_bench_says_so():
    plain = recorded("sine")
    bench = check_bench("bench", {"a.nc": replace(plain, rotor_angle=held(plain.rotor_angle))}, ACTUATOR)
    assert len(bench.recordings["a.nc"].time) == len(plain.time) // EVERY - 1
    said = [w["message"] for w in bench.warnings if w["kind"] == "samples"]
    assert said == ["a.nc: rotor_angle is new in one sample of 5 only; intervals are joined to 1 ms"]


def test_what_is_joined_is_checked_as_it_is_then():
    plain, other = recorded("sine"), recorded("reversal")
    slow = replace(plain, rotor_angle=held(plain.rotor_angle))
    bench = check_bench("bench", {"a.nc": slow, "b.nc": slow}, ACTUATOR)
    assert list(bench.recordings) == ["a.nc"]
    ten = replace(other, rotor_angle=other.rotor_angle[np.arange(len(other.time)) // 10 * 10])
    bench = check_bench("bench", {"a.nc": plain, "b.nc": ten}, ACTUATOR)
    assert list(bench.recordings) == ["a.nc"]
    assert any("interval of 2 ms" in w["message"] for w in bench.warnings)

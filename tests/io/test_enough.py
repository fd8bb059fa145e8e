"""Large benches: which recordings a diagnosis takes, and how much of them."""

from dataclasses import replace

import numpy as np
import pytest

from emafault.errors import InputError
from emafault.io.bench import Bench
from emafault.io.enough import FEWEST, within
from emafault.io.recording import VARIABLES, Recording

INTERVAL = 1e-3


def recording(seconds, command="sine", ambient=20.0, rest=0.0):
    size = round(seconds / INTERVAL)
    time = INTERVAL * np.arange(1, size + 1)
    values = {n: np.outer(time, np.ones(3)) if spec[0] else time.copy() for n, spec in VARIABLES.items()}
    values["rotor_angle"] = np.maximum(time - rest, 0.0) * 50.0
    return Recording(time, ambient_temperature=ambient, attributes={"command": command}, name=f"{command}.nc", **values)


def bench(*recordings):
    return Bench("bench", {f"{n:03d}.nc": r for n, r in enumerate(recordings)}, [])


def sizes(kept):
    return {n: len(r.time) for n, r in kept.recordings.items()}


def test_a_bench_within_is_taken_as_it_is():
    whole = bench(*(recording(2.0) for _ in range(10)))
    assert within(whole, 20_000) is whole


def test_long_recordings_are_cut_and_one_is_longer():
    kept = within(bench(*(recording(10.0) for _ in range(6))), 24_000)
    assert len(kept.recordings) == 6 and sum(sizes(kept).values()) <= 24_000
    assert sorted(sizes(kept).values()) == [3200] * 5 + [8000]
    assert "6 of 6 recordings are taken, 6 of them in part: 24000 of 60000 samples" in kept.warnings[-1]["message"]


def test_short_ones_leave_their_share_to_others():
    kept = within(bench(recording(9.0), *(recording(1.0) for _ in range(4)), recording(6.0)), 12_000)
    assert sorted(sizes(kept).values()) == [1000] * 4 + [4000, 4000]


def test_of_many_recordings_every_condition_is_left():
    many = [recording(1.0, c, t) for t in (-30.0, 20.0, 60.0) for c in ("ramp", "sine", "step") for _ in range(20)]
    many[3] = replace(many[3], attributes={"command": "ramp", "health": "healthy"})  # the others do not say
    kept = within(bench(*many), 40_000)
    taken = {(r.attributes["command"], r.ambient_temperature) for r in kept.recordings.values()}
    assert len(taken) == 9 and 36 <= len(kept.recordings) <= 40
    assert list(kept.recordings) == sorted(kept.recordings) and set(sizes(kept).values()) == {1000}


def test_few_recordings_sampled_fast_stay():
    kept = within(bench(*(recording(3.0) for _ in range(8))), 1000)
    assert len(kept.recordings) == FEWEST and set(sizes(kept).values()) == {1000}


def test_a_cut_recording_begins_at_rest_before_its_motion():
    late = recording(20.0, rest=7.0)
    kept = within(bench(late, *(recording(10.0) for _ in range(5))), 12_000)
    (cut,) = (r for r in kept.recordings.values() if r.rotor_angle[0] == 0.0 and r.rotor_angle[40] == 0.0)
    assert cut.time[0] == pytest.approx(INTERVAL) and cut.interval == pytest.approx(INTERVAL)
    first = np.argmax(cut.rotor_angle > 0.0)
    assert 40 <= first <= 52 and cut.rotor_angle[-1] > 100.0
    at = len(late.time) - len(late.time[late.time > 7.0]) - first
    assert np.array_equal(cut.phase_voltage, late.phase_voltage[at : at + len(cut.time)])
    assert cut.attributes == late.attributes


def test_too_few_are_refused():
    with pytest.raises(InputError, match="samples: got 12, accepted is 1000 or more"):
        within(bench(replace(recording(2.0))), 12)

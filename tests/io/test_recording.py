"""What the reader of recordings refuses, each in one line that names the file and the rule."""

from dataclasses import replace

import numpy as np
import pytest

from emafault.errors import InputError
from emafault.io.recording import Recording, read_recording, write_recording

SAMPLES = {"phase_voltage": 3, "phase_current": 3, "rotor_speed": 0, "rotor_angle": 0, "output_position": 0,
           "commanded_position": 0}  # fmt: skip


def recording(size=1200, interval=2e-4):
    rng = np.random.default_rng(1)
    values = {n: rng.standard_normal((size, phases) if phases else size) for n, phases in SAMPLES.items()}
    return Recording(time=interval * (np.arange(size) + 1), ambient_temperature=20.0, **values)


def with_nan(name):
    def damage(good):
        values = getattr(good, name).copy()
        values[7] = np.nan
        return replace(good, **{name: values})

    return damage


def one_late(good):
    time = good.time.copy()
    time[600:] += 0.5 * good.interval
    return replace(good, time=time)


BROKEN = {
    "NaN in the voltage": (with_nan("phase_voltage"), "phase_voltage holds NaN"),
    "NaN in the speed": (with_nan("rotor_speed"), "rotor_speed holds NaN"),
    "NaN in time": (with_nan("time"), "time holds NaN"),
    "time not uniform": (one_late, "time is not uniform"),
    "time backwards": (lambda r: replace(r, time=r.time[::-1].copy()), "time does not increase"),
    "0.1 s": (lambda r: recording(500), "at least 0.2 s are needed"),
    "never in motion": (lambda r: replace(r, rotor_speed=np.zeros(1200)), "never leaves zero"),
    "line voltages": (
        lambda r: replace(r, known={"phase_voltage": {"reference": "line_to_line"}}),
        "'line_to_line', read",
    ),
    "noise in words": (
        lambda r: replace(r, known={"rotor_speed": {"noise": "small"}}),
        "rotor_speed has noise 'small'",
    ),
    "no noise": (lambda r: replace(r, known={"rotor_speed": {"noise": 0.0}}), "accepted is a positive number"),
    "a zero without error": (
        lambda r: replace(r, known={"rotor_angle": {"zero_error": -0.1}}),
        "rotor_angle has zero_error '-0.1', accepted is a positive number in electrical rad",
    ),
    "unknown health": (lambda r: replace(r, attributes={"health": "fine"}), "health is 'fine'"),
}


def test_a_whole_recording_comes_back_as_it_was(tmp_path):
    good = recording()
    write_recording(tmp_path / "a.nc", good)
    back = read_recording(tmp_path / "a.nc")
    for name in (*SAMPLES, "time"):
        np.testing.assert_array_equal(getattr(back, name), getattr(good, name))
    assert back.phase_current_end is None and back.fault is None and back.health == "unknown" and back.known == {}


def test_what_is_known_of_a_variable_comes_back(tmp_path):
    known = {
        "phase_voltage": {"reference": "modelled_star", "noise": 0.7}, "phase_current": {"derived": "c"},
        "rotor_angle": {"source": "hall"}, "rotor_speed": {"noise": 0.4},
    }  # fmt: skip
    write_recording(tmp_path / "a.nc", replace(recording(), known=known))
    assert read_recording(tmp_path / "a.nc").known == known


@pytest.mark.parametrize("kind", BROKEN)
def test_what_is_not_in_the_format_is_refused(tmp_path, kind):
    damage, said = BROKEN[kind]
    write_recording(tmp_path / "a.nc", damage(recording()))
    with pytest.raises(InputError, match=said) as refused:
        read_recording(tmp_path / "a.nc")
    assert "a.nc" in str(refused.value) and "\n" not in str(refused.value)


def test_just_long_enough_is_accepted(tmp_path):
    write_recording(tmp_path / "a.nc", recording(1000))
    assert len(read_recording(tmp_path / "a.nc").time) == 1000

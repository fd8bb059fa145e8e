"""What was not measured: accepted, and what is lost said."""

import numpy as np
import pytest

from .checks import ELECTRICAL, bring, off
from .measured import ACTUATOR, INTERVAL, log, map_of


def test_what_was_not_measured_is_told(fine, truth, tmp_path):
    given = map_of()
    given["signals"]["phase_current"]["channels"][1] = None
    for name in ("bus_voltage", "rotor_speed"):
        del given["signals"][name]
    result = bring(tmp_path, given, log=log(fine).change(ic=np.negative))
    recording = result.recordings["one.nc"]
    # the phase that was not measured has the noise of two, the speed that of the angle
    errors = np.sqrt(np.mean((recording.phase_current - truth["phase_current"]) ** 2, axis=0))
    assert errors == pytest.approx([0.005, 0.0071, 0.005], rel=0.1)
    assert np.sqrt(np.mean((recording.rotor_speed - truth["rotor_speed"]) ** 2)) < 2e-4 / INTERVAL
    assert recording.bus_voltage is None and recording.known["phase_current"] == {"derived": "b"}
    told = " ".join(result.lost["one"])
    assert all(text in told for text in ("third current", "no end currents", "no bus voltage", "no rotor_speed"))


@pytest.mark.parametrize("wiring", ["abc", "cba"])
def test_hall_sensors_do_for_an_encoder(wiring, fine, truth, tmp_path):
    raw = log(fine)
    x = ACTUATOR.pole_pairs * fine["rotor_angle"] + 0.4
    halls = {f"h{'abc'[k]}": (np.sin(x - 2.0 * np.pi / 3.0 * k) > 0.0).astype(float) for k in range(3)}
    raw.channels |= halls
    raw.units |= dict.fromkeys(halls, "1")
    given = map_of()
    given["signals"]["rotor_angle"] = {"hall": [f"h{letter}" for letter in wiring]}
    result = bring(tmp_path, given, log=raw)
    recording = result.recordings["one.nc"]
    known = recording.known["rotor_angle"]
    assert set(off(recording, truth)) <= {"rotor_angle"} and set(known) == {"source", "zero_error"}
    assert known["source"] == "hall" and known["zero_error"] > 0.0
    turn = recording.rotor_angle - truth["rotor_angle"]
    turn = ACTUATOR.pole_pairs * (turn - ELECTRICAL * np.round(np.median(turn) / ELECTRICAL))
    moving = np.abs(truth["rotor_speed"]) > 50.0
    assert np.sqrt(np.mean(turn[moving] ** 2)) < np.deg2rad(3.0)
    assert any("hall edges" in text for text in result.lost["one"])


def test_end_currents_are_put_right_with_their_currents(fine, truth, tmp_path):
    raw = log(fine)
    ends = {f"e{'abc'[k]}": -fine["phase_current_end"][:, k] for k in range(3)}
    raw.channels |= ends
    raw.units |= dict.fromkeys(ends, "A")
    given = map_of()
    given["signals"]["phase_current_end"] = {"channels": list(ends)}
    raw = raw.change(ia=np.negative, ib=np.negative, ic=np.negative).swap("ib", "ic").swap("eb", "ec")
    result = bring(tmp_path, given, log=raw)
    recording = result.recordings["one.nc"]
    assert off(recording, truth) == [] and not any("end currents" in text for text in result.lost["one"])
    assert recording.phase_current_end == pytest.approx(truth["phase_current_end"], abs=1e-9)


def test_an_electrical_angle_is_divided_by_the_pole_pairs(fine, truth, tmp_path):
    given = map_of()
    given["signals"]["rotor_angle"] |= {"source": "electrical", "unit": "deg"}
    turned = log(fine).change(angle=lambda v: np.rad2deg(ACTUATOR.pole_pairs * v) % 360.0)
    result = bring(tmp_path, given, log=turned)
    assert off(result.recordings["one.nc"], truth) == []
    known = result.recordings["one.nc"].known["rotor_angle"]
    assert set(known) == {"source", "zero_error"} and known["source"] == "electrical" and known["zero_error"] > 0.0

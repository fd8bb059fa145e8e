"""What a recorder that stands still leaves out of the equations."""

from dataclasses import asdict, replace

import numpy as np
import pytest

from emafault.actuator.sensors import SensorNoise
from emafault.io.rows import stalled

from .conftest import NOISE, machine_of, recorded
from .test_residuals import mean_squares, truth

SIGNALS = ("phase_voltage", "phase_current", "phase_current_end", "rotor_speed", "rotor_angle", "output_position")


def standing_still(recording, at, length):
    """The recording with one sample of every channel repeated."""
    out = {n: getattr(recording, n).copy() for n in SIGNALS}
    for x in out.values():
        x[at : at + length + 1] = x[at]
    return replace(recording, **out)


@pytest.mark.parametrize("length", [3, 25])
def test_a_recorder_that_stands_still_is_seen_and_leaves_nothing(length):
    recording = standing_still(recorded("parabolic"), 2000, length)
    assert np.flatnonzero(stalled(recording)).tolist() == list(range(2001, 2001 + length))
    machine = machine_of({"a.nc": recording})
    assert max(mean_squares(machine, truth(machine, recording)).values()) < 1.5


@pytest.mark.parametrize("command", ["step", "parabolic"])
def test_a_rotor_that_stands_still_is_no_stall(command):
    exact = recorded(command, noise=SensorNoise(**dict.fromkeys(asdict(NOISE), 0.0)))
    assert np.all(exact.rotor_angle[:50] == exact.rotor_angle[0])
    assert not stalled(exact).any() and not stalled(recorded(command)).any()

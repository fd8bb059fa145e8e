"""The shaft behind its play and stiffness, along the motion of a rotor that is recorded without noise."""

from dataclasses import asdict

import numpy as np
import pytest

from emafault.actuator.sensors import SensorNoise
from emafault.equations.flexible import flexible_shaft

from .conftest import NOISE, machine_of, recorded
from .test_residuals import truth

EXACT = SensorNoise(**dict.fromkeys(asdict(NOISE), 0.0))


@pytest.mark.parametrize("damping", [300.0, 400.0])
@pytest.mark.parametrize("amplitude", [-0.03, 0.044])
def test_a_shaft_that_leaves_its_contact_is_where_the_simulator_has_it(amplitude, damping):
    given = {"compliance": {"K": 13000.0, "C": damping}}
    recording = recorded("step", effects=given, settings={"amplitude": amplitude, "time": 0.02}, noise=EXACT)
    machine = machine_of({"a.nc": recording})
    block = next(b for b in machine.blocks(truth(machine, recording, given), "a.nc") if b.equation == "position")
    assert np.std(block.residual) < 1.5e-6  # rad, of a sensor's noise of 1e-5


@pytest.mark.parametrize("interval", [1e-4, 1e-3])
def test_where_it_ends_does_not_hang_on_the_steps_of_the_integration(interval):
    time = np.arange(0.0, 0.6, 1e-5)
    gear = 0.02 * np.sin(np.clip(2.0 * np.pi * time / 0.3, 0.0, 1.5 * np.pi)) ** 3
    fine, _ = flexible_shaft(gear, 1e-5, 1.3e4, 400.0, 1.875, 2.0, 1e-4)
    every = round(interval / 1e-5)
    shaft, _ = flexible_shaft(gear[::every], interval, 1.3e4, 400.0, 1.875, 2.0, 1e-4)
    assert np.abs(shaft - fine[::every]).max() < 2e-6

"""Limit and band of the current regulator, where recordings show them."""

from dataclasses import replace

import pytest

from emafault.equations import regulator
from emafault.equations.machine import ReferenceActuator
from emafault.equations.signals import Signals, estimated_noise

from .conftest import ACTUATOR, NOISE, in_steps, machine_of, recorded

QUICK = (("sine", {"amplitude": 0.1, "frequency": 4.0}), ("step", {"amplitude": 0.1, "time": 0.05}))
SLOW = (("parabolic", {"acceleration": 0.3}), ("reversal", {"amplitude": 0.04, "speed": 0.25}))


def shown(commands, steps=None, **settings):
    """What recordings, in coarse steps or not, show of a controller with other settings than the nominal one."""
    unit = replace(ACTUATOR, **settings)
    recordings = {
        f"{n}.nc": in_steps(recorded(c, seed=n, actuator=unit, settings=of), steps or {})
        for n, (c, of) in enumerate(commands)
    }
    noise = estimated_noise(list(recordings.values()), NOISE)
    return of_machine(
        ReferenceActuator(ACTUATOR, {n: Signals.of(n, r, ACTUATOR, noise) for n, r in recordings.items()})
    )


def of_machine(machine):
    return regulator.settings(machine, list(machine.recordings), {n: p.off for n, p in machine.parameters.items()})


@pytest.mark.parametrize("limit", [10.0, 15.0])
def test_a_limit_that_is_reached_shows(limit):
    value, sd = shown(QUICK, current_limit=limit)["current_limit"]
    assert value == pytest.approx(limit, rel=2e-3) and sd < 1e-3 * limit


@pytest.mark.parametrize("commands", [SLOW, SLOW[1:]])
def test_a_current_that_is_the_same_for_long_is_no_limit(commands):
    assert "current_limit" not in shown(commands)


def test_a_limit_that_is_not_reached_does_not_show():
    assert "current_limit" not in shown(QUICK, current_limit=40.0)


@pytest.mark.parametrize("commands", [QUICK, SLOW])
@pytest.mark.parametrize("half_band", [0.2, 0.4, 0.6])
def test_the_band_shows_in_currents_at_the_ends_of_intervals(half_band, commands):
    value, sd = shown(commands, hysteresis=half_band)["hysteresis"]
    assert value == pytest.approx(half_band, rel=0.04) and 0.04 < sd / value < 0.06


def test_without_currents_at_the_ends_of_intervals_no_band_shows():
    assert of_machine(machine_of({"a.nc": replace(recorded(), phase_current_end=None)})) == {}


def test_currents_in_coarse_steps_show_the_same():
    found = shown(QUICK, {"phase_current": 0.05, "phase_current_end": 0.05}, current_limit=15.0)
    assert found["current_limit"][0] == pytest.approx(15.0, rel=2e-3)
    assert found["hysteresis"][0] == pytest.approx(0.4, rel=0.06)

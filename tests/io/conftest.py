"""Small benches of the actuator, simulated once."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from emafault.actuator.commands import command_positions
from emafault.actuator.parameters import ActuatorParameters, make_runs
from emafault.actuator.sensors import SensorNoise, measure
from emafault.actuator.simulate import simulate, time_axis
from emafault.config import compose
from emafault.io.recording import Recording

_CONFIG = compose()
ACTUATOR = ActuatorParameters(**_CONFIG["actuator"])
NOISE = SensorNoise(**_CONFIG["sensors"])
#: command, settings, ambient (degC), health
PLANS = (
    ("parabolic", {"acceleration": 0.4}, 18.0, "healthy"),
    ("ramp", {"speed": -0.25}, 70.0, "healthy"),
    ("sine", {"amplitude": 0.03, "frequency": 2.0}, -25.0, "unknown"),
    ("reversal", {"amplitude": 0.02, "speed": 0.2}, 45.0, "unknown"),
)
FAULT = (0.03, 0.0, 0.06, 0.05, -0.02)


def record(
    command, settings, ambient, health, effects=None, seed=0, duration=0.5, interval=2e-4, clean=False, fault=FAULT,
    theta_0=0.7, actuator=ACTUATOR,
):  # fmt: skip
    """One simulated recording, with noise unless ``clean``."""
    fault = np.array([*(fault if health == "unknown" else np.zeros(5)), ambient - 20.0])
    runs = make_runs(actuator, fault[None], effects=effects or {}, theta_0=theta_0)
    positions = command_positions(command, settings, duration, actuator.control_period)
    signals = simulate(runs, positions, duration, interval)
    signals = signals if clean else measure(signals, runs, NOISE, 100 + seed)
    measured = float(signals.pop("ambient_temperature", [ambient])[0])
    return Recording(
        time=time_axis(duration, interval),
        ambient_temperature=measured,
        fault=fault,
        attributes={"health": health, "command": command, "unit": "unit 7"},
        **{name: values[0] for name, values in signals.items()},
    )


def make_bench(effects=None, plans=PLANS, **options):
    """Recordings by file name."""
    named = {f"recording_{n}.nc": record(*plan, effects, seed=n, **options) for n, plan in enumerate(plans)}
    return {name: replace(recording, name=name) for name, recording in named.items()}


@dataclass(frozen=True)
class Shop:
    """What the tests of this folder use."""

    actuator = ACTUATOR
    noise = NOISE
    record = staticmethod(record)
    make_bench = staticmethod(make_bench)


@pytest.fixture(scope="session")
def shop():
    return Shop()


@pytest.fixture(scope="session")
def plain():
    """A bench without effect; tests change copies."""
    return make_bench()

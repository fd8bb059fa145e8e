"""Recordings simulated with known parameters, and the point at which their equations must hold."""

from dataclasses import replace

import numpy as np
import pytest

from emafault import config
from emafault.actuator.commands import command_positions
from emafault.actuator.parameters import ActuatorParameters, make_runs
from emafault.actuator.sensors import SensorNoise
from emafault.actuator.simulate import time_axis
from emafault.dataset import simulate_and_measure
from emafault.effects import EFFECTS
from emafault.equations.diagnose import diagnose
from emafault.equations.machine import ReferenceActuator
from emafault.equations.signals import Signals
from emafault.io.recording import Recording

SPEC = config.diagnosis_spec(config.compose())
ACTUATOR = ActuatorParameters(**SPEC["actuator"])
NOISE = SensorNoise(**SPEC["sensors"])
COMMANDS = {
    "parabolic": {"acceleration": 0.3},
    "reversal": {"amplitude": 0.04, "speed": 0.25},
    "sine": {"amplitude": 0.02, "frequency": 2.0},
}
EVERY = 5  # samples, of which one is new on a channel slower than the recording
STEP = {"step": {"amplitude": 0.012, "time": 0.02}}
PLANS = (("parabolic", 30.0, 0.3), ("reversal", 30.0, 1.1), ("sine", -20.0, 2.0), ("parabolic", -20.0, 4.0))
COGGING = {"cogging": {"a": 0.004}}


def recorded(
    command="parabolic",
    effects=None,
    fault=(0.0,) * 6,
    seed=0,
    actuator=ACTUATOR,
    interval=2e-4,
    theta_0=0.7,
    health="healthy",
    noise=NOISE,
    settings=None,
    unlisted=(),
):
    """A recording of a unit with these effects and faults, by entries of ``unlisted`` of the measuring chain and of the
    controller."""
    runs = make_runs(actuator, np.array([fault]), effects=effects or {}, theta_0=theta_0)
    position = command_positions(command, settings or (COMMANDS | STEP)[command], 0.8, actuator.control_period)
    spec = {"seed": seed, "unlisted": unlisted, "sensors": vars(noise)}
    out = simulate_and_measure(spec, runs, position, 0.8, interval)
    ambient = float(out.pop("ambient_temperature")[0])
    return Recording(
        time=time_axis(0.8, interval), ambient_temperature=ambient, attributes={"health": health, "command": command},
        **{k: v[0] for k, v in out.items()},
    )  # fmt: skip


def all_but(*effects):
    """Effects that the library is to lack, so that few are left to choose: a diagnosis is quicker then."""
    return sorted(set(EFFECTS).difference(effects))


def in_steps(recording, steps):
    """The same where channels come in coarse steps, by variable."""
    return replace(recording, **{n: step * np.round(getattr(recording, n) / step) for n, step in steps.items()})


def held(x):
    """A channel of which one sample in ``EVERY`` is new, held in between."""
    return x[np.arange(len(x)) // EVERY * EVERY]


def lines(x):
    """The same with straight lines in between."""
    at = np.arange(len(x))
    return np.interp(at, at[::EVERY], x[::EVERY])


def machine_of(recordings, exclude=()):
    """The diagnosis' view of recordings by name."""
    return ReferenceActuator(ACTUATOR, {n: Signals.of(n, r, ACTUATOR, NOISE) for n, r in recordings.items()}, exclude)


def bench(effects=None, actuator=ACTUATOR):
    """Four healthy recordings of one unit."""
    return {
        f"r{n}.nc": recorded(command, effects, (0.0,) * 5 + (dT,), seed=n, actuator=actuator, theta_0=theta_0)
        for n, (command, dT, theta_0) in enumerate(PLANS)
    }


def verdict_of(recordings, **options):
    """Verdict on recordings, the fourth of which confirms."""
    names = list(recordings)
    return diagnose("bench", recordings, (names[:3], names[3:]), ACTUATOR, NOISE, **options).verdict


@pytest.fixture(scope="session")
def cogging():
    """Verdict on a unit with cogging."""
    return verdict_of(bench(COGGING))


@pytest.fixture
def nominal():
    """A machine with one nominal recording."""
    return machine_of({"a.nc": recorded()})

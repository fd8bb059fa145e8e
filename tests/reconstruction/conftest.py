"""Simulated recordings that the reconstruction tests share."""

import functools

import numpy as np

from emafault.actuator.commands import command_positions
from emafault.actuator.parameters import make_runs
from emafault.actuator.sensors import SensorNoise, measure
from emafault.actuator.simulate import simulate
from emafault.config import reference_actuator
from emafault.faults import sample_faults

ACTUATOR = reference_actuator()
NOISE = SensorNoise(0.05, 0.005, 0.02, 0.3, 1e-4, 1e-5, 0.05, 0.5)
LEVELS = {"voltage": 0.05, "current": 0.005, "current_end": 0.02, "speed": 0.3}
COMMANDS = {
    "parabolic": {"acceleration": 0.3},
    "ramp": {"speed": 0.2},
    "step": {"amplitude": 0.02, "time": 0.01},
    "sine": {"amplitude": 0.05, "frequency": 2.0},
    "chirp": {"amplitude": 0.02, "frequency_start": 1.0, "frequency_end": 6.0},
    "reversal": {"amplitude": 0.02, "speed": 0.1},
}


@functools.cache
def recordings(runs=4, command="parabolic", duration=1.0, interval=2e-4, seed=1, law="stator_fixed"):
    """Fault vectors, run records and noise-free signals of a batch over the default ranges."""
    faults = sample_faults(runs, shorted_turns=(0, 0.1), eccentricity=(0, 0.2), temperature=(-50, 70), seed=seed)
    records = make_runs(ACTUATOR, faults, eccentricity_law=law)
    positions = command_positions(command, COMMANDS[command], duration, ACTUATOR.control_period)
    return faults, records, simulate(records, positions, duration, interval)


def noisy(batch, seed=0):
    """The batch's signals with sensor noise."""
    return measure(batch[2], batch[1], NOISE, seed)


def repeated(fault, repeats, seed, interval=2e-4, command="parabolic"):
    """One simulated run measured many times with fresh noise."""
    record = make_runs(ACTUATOR, np.atleast_2d(fault))
    positions = command_positions(command, COMMANDS[command], 1.0, ACTUATOR.control_period)
    clean = simulate(record, positions, 1.0, interval)
    every = {name: np.repeat(values, repeats, axis=0) for name, values in clean.items()}
    return clean, measure(every, np.repeat(record, repeats), NOISE, seed)

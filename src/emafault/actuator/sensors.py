"""Sensor noise and rounding on recorded values; control and regulator never see them."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class SensorNoise:
    """Standard deviation of each recorded value, whatever the interval (SI; ambient temperature in K)."""

    voltage: float
    current: float
    current_end: float
    speed: float
    angle: float
    position: float
    bus_voltage: float
    ambient: float


#: recorded variable -> its field of ``SensorNoise``
CHANNEL = {
    "phase_voltage": "voltage",
    "phase_current": "current",
    "phase_current_end": "current_end",
    "rotor_speed": "speed",
    "rotor_angle": "angle",
    "output_position": "position",
    "bus_voltage": "bus_voltage",
}


def measure(
    signals: Mapping[str, np.ndarray], runs: np.ndarray, noise: SensorNoise, seed: int, first_run: int = 0
) -> dict[str, np.ndarray]:
    """Add noise, then rounding, to simulated signals and measure the ambient temperature.

    Each run has a generator of its own seeded by (seed, first_run + row), so that the result does not depend on how
    runs are shared out. Order of the sensing chain after the simulation: noise, rounding.

    Returns
    -------
    the signals with noise, and ``ambient_temperature`` (run,) in degC
    """
    out = {name: np.array(values, copy=True) for name, values in signals.items()}
    out["ambient_temperature"] = runs["reference_temperature"] + runs["dT"]
    for r in range(len(runs)):
        rng = np.random.Generator(np.random.SFC64([seed, first_run + r]))
        out["ambient_temperature"][r] += noise.ambient * rng.standard_normal()
        for name, channel in CHANNEL.items():
            if name in out:
                values = out[name][r]
                values += getattr(noise, channel) * rng.standard_normal(values.shape)
        step = runs["speed_quantisation_step"][r]
        if step > 0.0:
            out["rotor_speed"][r] = step * np.round(out["rotor_speed"][r] / step)
    return out

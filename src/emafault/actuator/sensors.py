"""Sensor noise and rounding on recorded values; control and regulator never see them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .grammar import IN_RUN, MACHINE


@dataclass(frozen=True)
class SensorNoise:
    """Standard deviation of each recorded value, whatever the interval (SI; ambient temperature in K).

    ``angle_timing`` is that of the instants (s) at which the angle is sampled, by which it is off in proportion to the
    speed: none in simulations, where it is the form ``clock`` of the measuring chain.
    """

    voltage: float
    current: float
    current_end: float
    speed: float
    angle: float
    position: float
    bus_voltage: float
    ambient: float
    angle_timing: float = 0.0


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
    signals: Mapping[str, np.ndarray],
    runs: np.ndarray,
    noise: SensorNoise,
    seed: int,
    first_run: int = 0,
    unlisted: Sequence[Mapping[str, Any]] = (),
    interval: float = 0.0,
    recording: str = "",
) -> dict[str, np.ndarray]:
    """Add noise, then rounding, to simulated signals and measure the ambient temperature.

    Each run has a generator of its own seeded by (seed, first_run + row), so that the result does not depend on how
    runs are shared out. Order of the sensing chain after the simulation: noise, rounding.

    Parameters
    ----------
    unlisted, interval, recording : entries of a configuration, what lies in the measuring chain among them, with the
        recording interval (s) and the name of the recording that is replayed, if any (see ``chain.Chain``)

    Returns
    -------
    the signals with noise, and ``ambient_temperature`` (run,) in degC
    """
    out = {name: np.array(values, copy=True) for name, values in signals.items()}
    changed = any(entry["place"] not in MACHINE | IN_RUN for entry in unlisted)
    if changed:
        from .chain import Chain
    out["ambient_temperature"] = runs["reference_temperature"] + runs["dT"]
    for r in range(len(runs)):
        rng = np.random.Generator(np.random.SFC64([seed, first_run + r]))
        own = {name: out[name][r] for name in CHANNEL if name in out}
        chain = Chain(unlisted, runs[r], interval, seed, first_run + r, recording) if changed else None
        if chain:
            chain.before_noise(own)
        out["ambient_temperature"][r] += noise.ambient * rng.standard_normal()
        for name, channel in CHANNEL.items():
            if name in out:
                values = out[name][r]
                values += getattr(noise, channel) * rng.standard_normal(values.shape)
        step = runs["speed_quantisation_step"][r]
        if step > 0.0:
            out["rotor_speed"][r] = step * np.round(out["rotor_speed"][r] / step)
        if chain:
            chain.after_noise(own)
    return out

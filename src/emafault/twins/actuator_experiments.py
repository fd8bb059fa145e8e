"""Recordings of the reference actuator that could be made next, and what they would look like."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..actuator.commands import command_positions
from ..actuator.parameters import make_runs
from ..actuator.sensors import SensorNoise, measure
from ..actuator.simulate import simulate, time_axis
from ..effects import EFFECTS
from ..recording import Recording
from .actuator import ActuatorTwin

AMBIENTS = (-40.0, 20.0, 80.0)  # degC
INTERVAL = 2e-4  # s
#: command, its settings, length (s)
_COMMANDS: tuple[tuple[str, Mapping[str, float], float], ...] = (
    ("parabolic", {"acceleration": 0.6}, 0.6),
    ("ramp", {"speed": 0.03}, 1.0),
    ("ramp", {"speed": -0.4}, 0.6),
    ("reversal", {"amplitude": 0.01, "speed": 0.1}, 0.6),
    ("sine", {"amplitude": 0.04, "frequency": 2.0}, 0.6),
    ("chirp", {"amplitude": 0.01, "frequency_start": 1.0, "frequency_end": 12.0}, 0.6),
    ("reversal", {"amplitude": 0.1, "speed": 0.4}, 3.0),
)
_UNITS = {"acceleration": "rad/s2", "speed": "rad/s", "amplitude": "rad", "time": "s"}


@dataclass(frozen=True)
class Experiment:
    """One recording that could be made: command, soak temperature (degC), length (s)."""

    command: str
    settings: Mapping[str, float] = field(default_factory=dict)
    ambient_temperature: float = 20.0
    duration: float = 1.0

    @property
    def text(self) -> str:
        """The command as one would set it."""
        words = [f"{k.replace('_', ' ')} {v:g} {_UNITS.get(k, 'Hz')}" for k, v in self.settings.items()]
        return f"{self.command}, {', '.join(words)}, {self.duration:g} s"


def menu() -> list[Experiment]:
    """Every command at every temperature; the long record at room temperature only."""
    out = []
    for command, settings, duration in _COMMANDS:
        for ambient in AMBIENTS if duration <= 1.0 else (20.0,):
            out.append(Experiment(command, settings, ambient, duration))
    return out


def catalogue_effects(twin: ActuatorTwin, values: np.ndarray, effects: Sequence[str]) -> dict[str, dict[str, float]]:
    """The unit's tolerances and these effects as parameters of the catalogue: effect -> parameter -> value."""
    out: dict[str, dict[str, float]] = {}
    for m, p in enumerate(twin.parameters):
        if p.effect is None and p.recordings is None and p.fault is None:
            effect, name = p.name.split(".", 1)
            out.setdefault(effect, {})[name] = float(values[m])
    for effect in effects:
        own = {p.name: float(values[m]) for m, p in enumerate(twin.parameters) if p.effect == effect}
        reported = twin.report(effect, own, dict.fromkeys(own, 0.0)) if own else {}
        known = {name: entry[0] for name, entry in reported.items() if name in EFFECTS[effect].parameters}
        out[effect] = out.get(effect, {}) | known
    return out


def imagine(
    twin: ActuatorTwin, values: np.ndarray, effects: Sequence[str], experiments: Sequence[Experiment]
) -> ActuatorTwin:
    """A twin of recordings that have not been made, as a fitted set of effects says that they would be.

    The unit is in its present state: the unknown fault if the bench has one, else healthy.
    """
    groups = {p.name.split(".", 1)[0] for p in twin.parameters if p.fault not in (None, "dT")}
    health = "unknown" if "unknown" in groups else "healthy"
    fault = np.zeros(6)
    for c, component in enumerate(("Na", "Nb", "Nc", "xi_x", "xi_y")):
        if f"{health}.{component}" in twin.index:
            fault[c] = values[twin.index[f"{health}.{component}"]]
    told = catalogue_effects(twin, values, effects)
    noise = observed_noise(twin)
    recordings = {}
    for n, experiment in enumerate(experiments):
        fault[5] = experiment.ambient_temperature - twin.actuator.reference_temperature
        runs = make_runs(twin.actuator, fault[None], effects=told, theta_0=1.0)
        command = command_positions(
            experiment.command, experiment.settings, experiment.duration, twin.actuator.control_period
        )
        signals = measure(simulate(runs, command, experiment.duration, INTERVAL), runs, noise, 7, n)
        signals.pop("ambient_temperature")
        recordings[str(n)] = Recording(
            time=time_axis(experiment.duration, INTERVAL),
            ambient_temperature=experiment.ambient_temperature,
            attributes={"health": health, "command": experiment.command},
            name=str(n),
            **{name: array[0] for name, array in signals.items()},  # type: ignore[arg-type]
        )
    left_out = [e for e in EFFECTS if e not in twin.effects]
    return ActuatorTwin(twin.actuator, recordings, noise, left_out, twin.threads)


def observed_noise(twin: ActuatorTwin) -> SensorNoise:
    """Noise of the channels as the bench showed it, the stated one where it did not."""
    found = next((b.noise for b in twin._brought.values() if b.noise), {})
    stated = dict(vars(twin.sensor_noise))
    return SensorNoise(**(stated | {channel: value for channel, value in found.items() if channel in stated}))

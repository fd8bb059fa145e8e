"""One's own actuator identified in healthy recordings, by the equations that a diagnosis puts them into.

The equation errors of all recordings are made least, weighted by their noise (Gauss-Newton, as a diagnosis fits a
unit's tolerances), over the numbers of the machine and its controller, with priors so wide that the recordings alone
tell; a number that they leave open stays that of the file.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from math import log
from pathlib import Path

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..actuator.sensors import SensorNoise
from ..diagnosis import wandering
from ..diagnosis.fit import NOTHING, Bench
from ..diagnosis.model import SETTINGS
from ..diagnosis.naming import read
from ..effects.scaling import scaled
from ..equations.machine import ReferenceActuator
from ..equations.signals import Signals, estimated_noise
from ..equations.verdict import covariance_of
from ..errors import InputError, shown
from ..io.bench import read_bench
from ..io.recording import Recording, read_recording, recordings_in
from ..reconstruction.calibration import calibrate_recordings
from .compose import TOLERANCE, Composed, Machine, Z

WIDE = 0.5  # standard deviation over the value of the prior of every number, about where the last round left it
ROUNDS, LAST_ROUNDS = 6, 2  # with nothing beside the numbers, then with what else the recordings show
STILL = 0.01  # relative change of every number, or a tenth of its standard error, that ends the rounds
TOLD = 0.5  # of the prior's width; what is left wider than that the recordings do not tell
LARGEST_MISFIT = 30.0  # root mean square of an equation's errors over their noise; beyond it the machine is another one
POOR = 1.5  # the same, from which intervals are widened and it is said
#: parameter of the actuator -> that of the controller in the equations
CONTROLLER = {n: f"controller.{n}" for n in ("position_gain", "speed_gain", "speed_integral_gain")}
OFF = {n: f"{effect}.{parameter}" for n, (effect, parameter) in TOLERANCE.items()}


@dataclass(frozen=True)
class Identified:
    """A ``machine`` with its identified numbers; ``notes``: what contradicts the file or fits poorly."""

    machine: Machine
    notes: tuple[str, ...]
    kept: tuple[str, ...]  # numbers that the recordings do not tell
    misfit: Mapping[str, float]  # equation -> root mean square of its errors over their noise


def identify_actuator(machine: Machine, files: Sequence[str | Path], noise: SensorNoise) -> Identified:
    """Fit a machine to healthy recordings.

    Parameters
    ----------
    files : recordings, or folders of them
    noise : of the sensors, where the recordings do not tell it

    Raises
    ------
    InputError : recordings that cannot be used, are not healthy, or are of another machine
    """
    recordings = _healthy(files, machine.actuator)
    own = estimated_noise(list(recordings.values()), noise)
    actuator = _electrical(recordings, machine.actuator)
    told, causes = _Told({}, {}), tuple[str, ...]()
    for rounds, beside in ((ROUNDS, False), (LAST_ROUNDS, True)):
        for _ in range(rounds):
            bench = _bench(recordings, actuator, own)
            told, causes = _beside_causes(bench) if beside else (_alone(bench), ())
            actuator = _moved(actuator, told.factor)
            if all(abs(log(f)) < max(STILL, 0.1 * told.error[n]) for n, f in told.factor.items()):
                break
    return _compared(machine, actuator, told.error, causes, _misfit(bench))


def _healthy(files: Sequence[str | Path], actuator: ActuatorParameters) -> dict[str, Recording]:
    paths = recordings_in(list(files))
    out: dict[str, Recording] = {}
    for path in paths:
        bench = read_bench(path, actuator)
        if read_recording(path).health != "healthy":
            raise InputError(f"{shown(path)}: is not called healthy; an actuator is identified in healthy recordings")
        if path.name in out:
            raise InputError(f"{shown(path)}: two recordings have this name, accepted are different ones")
        out |= bench.recordings
    return out


def _electrical(recordings: Mapping[str, Recording], actuator: ActuatorParameters) -> ActuatorParameters:
    """R, k and L as voltages and currents alone have them: a start from which everything else is near."""
    found = calibrate_recordings(list(recordings.values()), actuator, "weighted")
    return found.actuator(actuator)


def _bench(recordings: Mapping[str, Recording], actuator: ActuatorParameters, noise: SensorNoise) -> Bench:
    """The recordings at an actuator, every number of it free."""
    signals = {n: Signals.of(n, r, actuator, noise) for n, r in recordings.items()}
    machine = ReferenceActuator(actuator, signals, (), scaled(actuator))
    for full in (*OFF.values(), *CONTROLLER.values()):
        p = machine.parameters[full]
        # a gain multiplies, so that no step can turn it round
        machine.parameters[full] = replace(p, sd=WIDE * abs(p.off), vanishes=0.0)
    bench = Bench(machine, list(recordings))
    bench.linearise(renew=True)
    return bench


@dataclass(frozen=True)
class _Told:
    """Factor on each number of the actuator that the recordings tell, and its relative standard error."""

    factor: dict[str, float]
    error: dict[str, float]


def _alone(bench: Bench) -> _Told:
    """What the numbers are where nothing else acts."""
    bench.settle(NOTHING)
    normal = bench.normal(bench.linearise(NOTHING), NOTHING)
    return _told(bench, bench.values(), *covariance_of(bench, normal, NOTHING))


def _beside_causes(bench: Bench) -> tuple[_Told, tuple[str, ...]]:
    """What they are beside the effects and forms that the recordings show, and these in words."""
    fit = bench.fit()
    reading = read(fit.models, fit.search.units.values(), wandering=wandering.log_odds(bench))
    likely = bool(reading.named or reading.groups) and bool(reading.sets)
    leading = reading.sets[0][2] if likely else fit.models[0]
    values = bench.inserted(leading, fit.normal).values
    # a remainder of the controller's own equations is none of the machine
    left = [r.split(":", 1)[1] for r in reading.left if r.split(":", 1)[1] not in SETTINGS]
    words = [*reading.named, *(" or ".join(g) for g in reading.groups), *reading.forms]
    words += [f"more than noise in the {equation} equation" for equation in left]
    return _told(bench, values, *covariance_of(bench, fit.normal, leading)), tuple(words)


def _told(bench: Bench, values: Mapping[str, float], index: Mapping[str, int], spread: np.ndarray) -> _Told:
    out = _Told({}, {})
    for name, full in {**OFF, **CONTROLLER}.items():
        if full not in index:
            continue
        relative = float(np.sqrt(spread[index[full], index[full]]) / abs(values[full]))
        if relative < TOLD * WIDE:
            out.factor[name] = float(values[full] / bench.parameters[full].off)
            out.error[name] = relative
    return out


def _moved(actuator: ActuatorParameters, factors: Mapping[str, float]) -> ActuatorParameters:
    return replace(actuator, **{n: getattr(actuator, n) * f for n, f in factors.items()})


def _misfit(bench: Bench) -> dict[str, float]:
    """Root mean square of each equation's errors over their noise, all recordings together."""
    total: dict[str, list[float]] = {}
    for name in bench.recordings:
        for block in bench.machine.blocks(bench.values(), name, wanted=()):
            if not np.any(block.usable):
                continue
            square = (
                np.asarray(block.residual)[block.usable] ** 2
                / np.broadcast_to(block.bands[0], block.usable.shape)[block.usable]
            )
            entry = total.setdefault(block.equation, [0.0, 0.0])
            entry[0] += float(square.sum())
            entry[1] += float(len(square))
    return {equation: float(np.sqrt(s / count)) for equation, (s, count) in total.items()}


#: numbers -> equation whose misfit widens their intervals
OF = {
    "resistance": "electrical", "back_emf": "electrical", "inductance": "electrical", "inertia": "torque",
    "viscous_friction": "torque", "coulomb_friction": "torque", "backlash": "position", "bus_voltage": "bus",
    **dict.fromkeys(CONTROLLER, "control"),
}  # fmt: skip


def _compared(
    machine: Machine,
    actuator: ActuatorParameters,
    error: Mapping[str, float],
    causes: Sequence[str],
    misfit: Mapping[str, float],
) -> Identified:
    """The machine with what was told of it, and where that contradicts the file by more than both intervals.

    Raises
    ------
    InputError : an equation that leaves so much that the recordings are of another machine
    """
    worst = max(misfit, key=lambda e: misfit[e])
    if misfit[worst] > LARGEST_MISFIT:
        raise InputError(
            f"{worst} equation: leaves {misfit[worst]:.3g} times its noise at best; the recordings are of another "
            "actuator, their sensors are off, or an effect is large that emafault diagnose names"
        )
    parameters, notes, kept = dict(machine.parameters), [], []
    for f in fields(ActuatorParameters):
        name, before = f.name, machine.parameters[f.name]
        if name not in OF:
            continue
        if name not in error:
            kept.append(name)
            continue
        wide = 1.0 if causes else max([1.0, *(m for e, m in misfit.items() if e.startswith(OF[name]))])
        now = getattr(actuator, name)
        tolerance = Z * wide * error[name]
        parameters[name] = Composed(now, tolerance, "identified", before.of)
        if before.source != "assumed" and abs(log(now / before.value)) > before.tolerance + tolerance:
            notes.append(
                f"{name}: {now:.4g} in the recordings contradicts {before.value:.4g} of the file ({before.of}), "
                f"a factor of {now / before.value:.3g}"
            )
    if causes:
        notes.append(
            f"these recordings show {', '.join(causes)} as well: the numbers are those beside it; emafault diagnose "
            "says more"
        )
    for equation, m in misfit.items():
        if m > POOR and not causes:
            notes.append(f"{equation} equation: leaves {m:.2g} times its noise, by which intervals are widened")
    return Identified(replace(machine, parameters=parameters), tuple(notes), tuple(kept), misfit)

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
from ..diagnosis.evidence import Definite
from ..diagnosis.fit import NOTHING, Bench
from ..effects.scaling import scaled
from ..equations.machine import ReferenceActuator
from ..equations.signals import Signals, estimated_noise
from ..errors import InputError, shown
from ..io.bench import read_bench
from ..io.recording import Recording, read_recording, recordings_in
from ..reconstruction.calibration import calibrate_recordings
from .compose import TOLERANCE, Composed, Machine, Z

WIDE = 0.5  # standard deviation over the value of the prior of every number, about where the last round left it
ROUNDS = 6
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
    for _ in range(ROUNDS):
        bench = _bench(recordings, actuator, own)
        bench.settle(NOTHING)
        found, error = _told(bench)
        before, actuator = actuator, _moved(actuator, found)
        change = {n: abs(log(getattr(actuator, n) / getattr(before, n))) for n in found}
        if all(c < max(STILL, 0.1 * error[n]) for n, c in change.items()):
            break
    misfit = _misfit(bench)
    worst = max(misfit, key=lambda e: misfit[e])
    if misfit[worst] > LARGEST_MISFIT:
        raise InputError(
            f"{worst} equation: leaves {misfit[worst]:.3g} times its noise at best; the recordings are of another "
            "actuator, or their sensors are off"
        )
    return _compared(machine, actuator, error, misfit)


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


def _told(bench: Bench) -> tuple[dict[str, float], dict[str, float]]:
    """Factor on each number of the actuator, and its relative standard error, of what the recordings tell."""
    normal = bench.normal(bench.linearise(NOTHING), NOTHING)
    names = [n for n in bench.nuisances if n in normal.index]
    k = np.array([normal.index[n] for n in names])
    sd = np.array([bench.prior(n)[1] for n in names])
    A = normal.H[np.ix_(k, k)] * np.outer(sd, sd) + np.eye(len(k))
    spread = sd * np.sqrt(np.diag(Definite(A).solve(np.eye(len(k)))))
    error = dict(zip(names, spread, strict=True))
    out, errors = {}, {}
    for name, full in {**OFF, **CONTROLLER}.items():
        if full not in error:
            continue
        value, off = bench.point[full], bench.parameters[full].off
        relative = float(error[full] / abs(value))
        if relative < TOLD * WIDE:
            out[name], errors[name] = float(value / off), relative
    return out, errors


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
    machine: Machine, actuator: ActuatorParameters, error: Mapping[str, float], misfit: Mapping[str, float]
) -> Identified:
    """The machine with what was told of it, and where that contradicts the file by more than both intervals."""
    parameters, notes, kept = dict(machine.parameters), [], []
    for f in fields(ActuatorParameters):
        name, before = f.name, machine.parameters[f.name]
        if name not in OF:
            continue
        if name not in error:
            kept.append(name)
            continue
        wide = max([1.0, *(m for e, m in misfit.items() if e.startswith(OF[name]))])
        now = getattr(actuator, name)
        tolerance = Z * wide * error[name]
        parameters[name] = Composed(now, tolerance, "identified", before.of)
        if before.source != "assumed" and abs(log(now / before.value)) > before.tolerance + tolerance:
            notes.append(
                f"{name}: {now:.4g} in the recordings contradicts {before.value:.4g} of the file ({before.of}), "
                f"a factor of {now / before.value:.3g}"
            )
    for equation, m in misfit.items():
        if m > POOR:
            notes.append(
                f"{equation} equation: leaves {m:.2g} times its noise, by which intervals are widened; emafault "
                "diagnose says what it lacks"
            )
    return Identified(replace(machine, parameters=parameters), tuple(notes), tuple(kept), misfit)

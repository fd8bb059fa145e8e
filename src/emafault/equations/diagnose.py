"""Diagnosis of a bench of the reference actuator by equation errors: from recordings to the verdict."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..actuator.sensors import SensorNoise
from ..diagnosis import wandering
from ..diagnosis.closure import Ladder
from ..diagnosis.fit import Bench, Fit
from ..diagnosis.naming import Reading, read
from ..diagnosis.sets import Model
from ..effects import EFFECTS
from ..effects.scaling import scaled
from ..errors import InputError
from ..io.enough import FEWEST, spread
from ..io.recording import Recording
from .held_out import held_to_account, misfits
from .machine import ReferenceActuator
from .next_recording import LIKELY, RIVALS, next_recordings
from .predicted import Explored
from .quality import seen, told
from .signals import Signals, estimated_noise
from .unconfirmed import unconfirmed
from .verdict import Fitted, verdict_of

ENOUGH = 50_000  # samples that a search begins with; what it leads to is fitted to all


@dataclass(frozen=True)
class Diagnosed:
    """A verdict with the fit that it rests on."""

    verdict: dict[str, Any]
    bench: Bench
    fit: Fit
    reading: Reading
    leading: Model
    before: Mapping[str, float]  # all parameters of the recalibrated nominal model
    values: Mapping[str, float]  # of all parameters at the leading set's fit
    noise: SensorNoise

    @classmethod
    def of(cls, fitted: Fitted, verdict: dict[str, Any], noise: SensorNoise) -> "Diagnosed":
        """What a verdict rests on."""
        f = fitted
        return cls(verdict, f.bench, f.fit, f.reading, f.leading, f.before, f.values, noise)

    def next_experiments(self) -> list[dict[str, Any]]:
        """What to record next: see ``next_recordings``."""
        listed = {u.id for u in self.bench.units if u.kind in ("structural", "calibration")}
        mine = {u for u in self.leading.units if u in listed}
        rivals: dict[tuple[str, ...], Model] = {}
        for model in self.fit.models:
            names = tuple(sorted(u for u in model.units if u in listed))
            if set(names) != mine:
                rivals.setdefault(names, model)
        mass = {s: p for s, p, _ in self.reading.sets} | {(): self.reading.empty + self.reading.unknown}
        likely = [(n, m) for n, m in rivals.items() if mass.get(n, 0.0) > LIKELY]
        kept = (likely or list(rivals.items()))[:RIVALS]
        effects = self.verdict["simulator"]["after"]
        return next_recordings(self.bench, self.fit, self.leading, kept, self.values, effects, self.noise)


def diagnose(
    name: str,
    recordings: Mapping[str, Recording],
    split: tuple[Sequence[str], Sequence[str]],
    actuator: ActuatorParameters,
    noise: SensorNoise,
    exclude: Sequence[str] = (),
    processes: int = 1,
    tolerances: Mapping[str, Mapping[str, float]] | None = None,
) -> "Diagnosed":
    """Diagnose a bench: its verdict, in the format of ``diagnosis.json``, and the fit that it rests on.

    Parameters
    ----------
    recordings : by name, read and checked
    split : names of those that explore and of those that confirm
    noise : of the sensors, where the recordings do not tell it
    exclude : effects that the library is to lack
    processes : in which recordings are linearised side by side
    tolerances : of this actuator, see ``effects.scaling.scaled``

    Raises
    ------
    InputError : an effect that does not exist
    """
    for effect in exclude:
        if effect not in EFFECTS:
            raise InputError(f"exclude: '{effect}' is not an effect, accepted are {', '.join(EFFECTS)}")
    explore, confirm = split
    own = estimated_noise([recordings[n] for n in explore], noise)
    library = exclude, scaled(actuator, tolerances)
    machine = ReferenceActuator(actuator, {n: Signals.of(n, recordings[n], actuator, own) for n in explore}, *library)
    bench = Bench(machine, list(explore), processes)
    enough = int(len(explore) * ENOUGH / sum(len(recordings[n].time) for n in explore))
    first = spread(recordings, explore, min(len(explore), max(FEWEST, enough)))
    if len(first) < len(explore):
        begun = Bench(machine, first, processes)
        fit = bench.fit((begun, begun.fit()))
    else:
        fit = bench.fit()
    quality = {n: seen(recordings[n], exclude, own.angle_timing) for n in explore}
    counted = bool(told(quality))
    reading = read(
        fit.models, fit.search.units.values(), tuple(machine.observed()), counted=counted,
        wandering=wandering.log_odds(bench),
    )  # fmt: skip
    sealed = _seal(reading)
    if not confirm:
        fitted = Fitted(machine, bench, fit, reading, None)
        return Diagnosed.of(fitted, verdict_of(name, split, fitted, sealed, recordings, quality), own)
    # from here on the confirm recordings are open
    known = machine.recordings
    signals = {n: known[n] if n in known else Signals.of(n, r, actuator, own) for n, r in recordings.items()}
    whole = ReferenceActuator(actuator, signals, *library, machine.reference)
    every = Bench(whole, list(recordings), processes)
    all_fit = every.fit((bench, fit))
    units, observed = all_fit.search.units.values(), tuple(whole.observed())
    named = read(all_fit.models, units, observed).named
    wanders = wandering.log_odds(every, confirm)
    explored = Explored(bench, fit, Ladder(every, confirm, bench.described))
    models, held_out = held_to_account(every, all_fit, named, explored, wanders)
    all_fit = replace(all_fit, models=models)
    quality |= {n: seen(r, exclude, own.angle_timing) for n, r in recordings.items() if n not in quality}
    beyond = {e: max(odds, wanders.get(e, -np.inf)) for e, odds in misfits(held_out).items()}
    final = read(models, units, observed, counted=bool(told(quality)), wandering=wanders | beyond)
    fitted = Fitted(whole, every, all_fit, final, held_out)
    verdict = verdict_of(name, split, fitted, sealed, recordings, quality)
    return Diagnosed.of(fitted, verdict | {"warnings": unconfirmed(fitted)}, own)


def _seal(reading: Reading) -> dict[str, Any]:
    """What the explored recordings say, with a digest that anyone can recompute."""
    out: dict[str, Any] = {
        "verdict": reading.verdict,
        "which": [{"effects": list(s), "probability": round(p, 5)} for s, p, _ in reading.sets[:8]],
        "discovered": list(reading.forms),
    }
    text = json.dumps(out, sort_keys=True, separators=(",", ":"))
    return out | {"digest": hashlib.sha256(text.encode()).hexdigest()}

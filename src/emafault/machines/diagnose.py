"""Diagnosis of a measured machine: the exploring recordings, the seal, then all recordings and what was held out."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from ..diagnosis.evidence import Normal
from ..diagnosis.fit import NOTHING, Fit
from ..diagnosis.linear import OwnForms
from ..diagnosis.naming import Reading, read
from ..diagnosis.point import is_parameter
from ..diagnosis.sets import Choice, Model
from . import held_out, verdict
from .adapter import Recorded
from .bench import SETTLING, MeasuredBench
from .next_recording import next_recordings
from .statement import Machine


@dataclass(frozen=True)
class Settled:
    """A set at its own optimum: all parameters, sizes of the functions of remainders and own forms, and of the units
    that carry the latter."""

    values: Mapping[str, float]
    functions: Mapping[str, float]
    own: OwnForms


@dataclass(frozen=True)
class Fitted:
    """Some recordings of a machine, fitted: where the search ended and what its posterior says."""

    recorded: Recorded
    bench: MeasuredBench
    fit: Fit
    reading: Reading

    @property
    def leading(self) -> Model:
        """The set that the verdict rests on: the most probable one, or the most probable with what is named."""
        named = self.reading.named or self.reading.groups
        return self.reading.sets[0][2] if named and self.reading.sets else self.fit.models[0]

    @property
    def tells(self) -> bool:
        """Whether anything is named or a remainder is there."""
        return bool(self.reading.named or self.reading.groups or self.reading.remainders)

    @cached_property
    def settled(self) -> Settled:
        """The leading set at its own optimum."""
        kept = dict(self.bench.point), set(self.bench.on)
        model = self.bench.settle(self.leading, self.fit.normal, SETTLING)
        functions = {n: d for n, d in model.deviations.items() if not is_parameter(n)}
        out = Settled(self.bench.values(), functions, self.bench.own_forms())
        self.bench.point, self.bench.on = kept
        return out

    @cached_property
    def null(self) -> MeasuredBench:
        """The recalibrated base model: its own parameters alone, on the same recordings."""
        null = MeasuredBench(self.recorded, self.bench.recordings)
        null.settle(NOTHING, steps=SETTLING)
        return null

    def log_evidence(self, choices: tuple[Choice, ...]) -> float:
        """Log evidence of a set at its own optimum, up to a constant of the recordings."""
        bench = MeasuredBench(self.recorded, self.bench.recordings)
        if choices:
            bench.point, bench.on, bench.sizes = dict(self.bench.point), set(self.bench.on), dict(self.bench.sizes)
        return bench.settle(Model(choices), steps=SETTLING).log_likelihood

    def base(self) -> dict[str, float]:
        """Parameters of the recalibrated base model."""
        return self.null.values()

    @property
    def at_base(self) -> Normal:
        """Normal equations there."""
        return self.null.normal(self.null.linearise())

    def from_off(self, model: Model) -> dict[str, float]:
        """A set's own parameters and remainders as deviations from off, by column."""
        kept = {n: d for n, d in model.deviations.items() if is_parameter(n) or n.startswith("remainder.")}
        return {n: d - self.bench.prior(n)[2] for n, d in kept.items()}


@dataclass(frozen=True)
class Diagnosed:
    """A verdict with the fits that it rests on: of the exploring recordings, and of all."""

    machine: Machine
    verdict: dict[str, Any]
    explored: Fitted
    whole: Fitted


def fitted(recorded: Recorded, machine: Machine) -> Fitted:
    """Fit the recordings that are open."""
    bench = MeasuredBench(recorded, list(recorded.rows))
    fit = bench.fit()
    return Fitted(recorded, bench, fit, read(fit.models, fit.search.units.values(), tuple(machine.observed), False))


def diagnose(machine: Machine, experiments: bool = True) -> Diagnosed:
    """The verdict of one machine, in the format of ``diagnosis.json``, and the fits that it rests on.

    Parameters
    ----------
    experiments : whether to look for what to record next
    """
    explored = fitted(Recorded(machine, machine.explore), machine)
    sealed = seal(explored.reading)
    # from here on the recordings that confirm are open
    whole = explored
    if machine.confirm:
        every = (*machine.explore, *machine.confirm)
        whole = fitted(Recorded(machine, every), machine)
    out = verdict.build(machine, whole, sealed)
    if machine.confirm:
        opened = Recorded(machine, every, explored.recorded)
        out["shrinks"]["signal"] = held_out.ladder(explored, opened, machine.confirm)
        out["held_out"] = held_out.outcome(explored, whole)
    for entry in out["discovered"]:
        entry["closed"] = held_out.closed_by(out["shrinks"]["signal"])
    if experiments:
        out["next_experiment"] = next_recordings(machine, whole)
    return Diagnosed(machine, out, explored, whole)


def seal(reading: Reading) -> dict[str, Any]:
    """What the explored recordings say, with a digest that anyone can recompute."""
    out: dict[str, Any] = {
        "verdict": reading.verdict,
        "which": [{"effects": list(s), "probability": round(p, 5)} for s, p, _ in reading.sets[:8]],
        "groups": [list(g) for g in reading.groups],
        "discovered": list(reading.remainders),
    }
    text = json.dumps(out, sort_keys=True, separators=(",", ":"))
    return out | {"digest": hashlib.sha256(text.encode()).hexdigest()}

"""Whether a recording that a diagnosis recommends decides what it promises, and how many are needed until one reading
is left."""

import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..actuator.sensors import SensorNoise
from ..equations.diagnose import diagnose
from ..equations.next_recording import INTERVAL, MENU
from ..equations.sentences import decides
from ..io.bench import read_bench
from ..io.split import split_bench
from ..withheld.benches import write_bench
from ..withheld.cases import Case, RecordingPlan

DECIDED = 3.0  # log odds that decide between two readings
NAMED = 0.9  # probability of one set, or of no gap, from which one reading is left
LEAST = 1e-6  # probability of a set that a verdict does not list
MOST = 4  # recordings that are added to a bench

Choose = Callable[[Sequence[Mapping[str, Any]]], Mapping[str, Any]]


@dataclass(frozen=True)
class Step:
    """One recording that was recommended, made and diagnosed with the others.

    ``promised``: expected log Bayes factor between the leading set and its ``rival``; ``before``, ``after``: log odds
    of the two; ``acts``: 1 where the leading set is what acts, -1 where its rival is, 0 where neither is.
    """

    leading: str
    rival: str
    promised: float
    before: float
    after: float
    acts: int

    @property
    def kept(self) -> bool:
        """Whether what was promised is decided, and not wrongly."""
        return (self.acts * self.after if self.acts else abs(self.after)) >= DECIDED

    @property
    def achieved(self) -> float | None:
        """Log Bayes factor for what acts; None where neither does."""
        return self.acts * (self.after - self.before) if self.acts else None


@dataclass(frozen=True)
class Sequential:
    """A bench to which recordings are added until one reading is left.

    ``needed``: how many were; None where more than ``MOST`` would be, or nothing more was recommended. ``steps`` are
    those of recommended recordings.
    """

    needed: int | None
    steps: tuple[Step, ...]


def sequence(case: Case, choose: Choose, actuator: ActuatorParameters, noise: SensorNoise) -> Sequential:
    """Diagnose a case, add the recording that ``choose`` takes of those recommended, and so on."""
    steps: list[Step] = []
    verdict, recommended = _diagnosed(case, actuator, noise)
    for number in range(MOST + 1):
        if _one_left(verdict):
            return Sequential(number, tuple(steps))
        if not recommended or number == MOST:
            break
        entry = choose(recommended)
        case = with_recording(case, entry)
        then, after = _diagnosed(case, actuator, noise)
        if "separates" in entry:
            steps.append(_step(case, entry, verdict, then))
        verdict, recommended = then, after
    return Sequential(None, tuple(steps))


def recommended_first(entries: Sequence[Mapping[str, Any]]) -> Mapping[str, Any]:
    """The recording with the largest expected Bayes factor."""
    return entries[0]


def at_random(rng: np.random.Generator) -> Choose:
    """Any recording of the menu, whatever is recommended."""

    def choose(_: Sequence[Mapping[str, Any]]) -> Mapping[str, Any]:
        command, settings, duration, ambients = MENU[rng.integers(len(MENU))]
        motion = {"name": command, "duration": duration, "settings": dict(settings)}
        return {"motion": motion, "ambient_temperature": float(rng.choice(ambients))}

    return choose


def with_recording(case: Case, entry: Mapping[str, Any]) -> Case:
    """The case with a recording more: the unit in its present state, as ``next_recordings`` imagines it."""
    motion = entry["motion"]
    state = next((p for p in case.recordings if p.health == "unknown"), None)
    fault = state.fault[:5] if state is not None else (0.0,) * 5
    plan = RecordingPlan(
        motion["name"], motion["settings"], motion["duration"], INTERVAL,
        "unknown" if state is not None else "healthy", (*fault, entry["ambient_temperature"] - 20.0), 1.0,
    )  # fmt: skip
    return replace(case, recordings=(*case.recordings, plan))


def _diagnosed(
    case: Case, actuator: ActuatorParameters, noise: SensorNoise
) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    with tempfile.TemporaryDirectory() as folder:
        bench = Path(folder) / "bench"
        write_bench(case, bench, actuator, noise)
        brought = read_bench(bench, actuator)
    found = diagnose(brought.name, brought.recordings, split_bench(brought.recordings), actuator, noise)
    return found.verdict, [e for e in found.next_experiments() if decides(e)]


def _one_left(verdict: Mapping[str, Any]) -> bool:
    return max(w["probability"] for w in verdict["which"] if w["effects"] != ["unknown"]) >= NAMED


def _step(case: Case, entry: Mapping[str, Any], before: Mapping[str, Any], after: Mapping[str, Any]) -> Step:
    leading, rival = (_set(name) for name in entry["separates"])
    truth = tuple(sorted(case.effects))
    return Step(
        entry["separates"][0], entry["separates"][1], float(np.log(entry["expected_odds"])),
        log_odds(before, leading, rival), log_odds(after, leading, rival), (truth == leading) - (truth == rival),
    )  # fmt: skip


def _set(name: str) -> tuple[str, ...]:
    return () if name == "no_gap" else tuple(sorted(name.split("+")))


def log_odds(verdict: Mapping[str, Any], one: tuple[str, ...], other: tuple[str, ...]) -> float:
    """Log odds of two sets of listed effects in a verdict."""
    p = {tuple(sorted(w["effects"])): w["probability"] for w in verdict["which"]}
    return float(np.log(max(p.get(one, 0.0), LEAST)) - np.log(max(p.get(other, 0.0), LEAST)))

"""What to record next: of a menu of recordings, those that tell rival readings of a bench apart, or show what it hides.

Each recording is imagined under the first reading. A rival's prediction differs from it by d. With C the noise of the
statistics, J the derivatives by all that the rival may still adjust and S what the bench says of that, the squared
distance is d' (C + J S J')^-1 d, and exp(distance/2) the odds that the recording is expected to bring.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from .diagnose import Diagnosis
from .gaussian import Point
from .inference import Candidate, Problem
from .twin import Twin

SHORTLIST = 3
PROPOSED = 3
LARGEST_ODDS = 1e6
SOAK_VARIANCE_FLOOR = 1e-12
HIDDEN = 4  # effects that a clear verdict's next recording should show, those that the bench shows least
SHOWN = 25.0  # squared distance from which an effect is shown
LIKELY = 0.02  # probability below which a reading is no rival


class Laboratory(Protocol):
    """A machine's menu, and twins of recordings that have not been made."""

    def menu(self) -> Sequence[Any]:
        """What could be recorded: entries with ``text``, ``ambient_temperature`` (degC), ``duration`` (s)."""

    def imagine(self, twin: Any, values: np.ndarray, effects: Sequence[str], experiments: Any) -> Any:
        """A twin of these recordings, named 0, 1, ..., under a fitted set of effects."""


@dataclass(frozen=True)
class _Reading:
    """One reading of the bench: name, effects, fitted point."""

    names: tuple[str, ...]
    point: Point


def next_experiments(diagnosis: Diagnosis, laboratory: Laboratory) -> list[dict]:
    """The best three experiments as the verdict file lists them; empty where nothing is left to tell apart."""
    menu = list(laboratory.menu())
    first, rivals = _readings(diagnosis)
    if not rivals:
        return []
    twin = diagnosis.twin
    imagined = laboratory.imagine(twin, first.point.values, _effects(first), menu)
    every = [str(n) for n in range(len(menu))]
    problem = Problem(imagined, every)
    points = [_carry(diagnosis, reading.point, problem) for reading in (first, *rivals)]
    predictions = problem.predict(np.array(points))
    chosen = _shortlist(diagnosis, problem, predictions, every)
    found = []
    for name in chosen:
        found.append((name, *_compare(diagnosis, imagined, name, first, rivals)))
    return _propose(diagnosis, menu, first, rivals, found)


def _effects(reading: _Reading) -> tuple[str, ...]:
    return tuple(n for n in reading.names if n not in ("no_gap", "unknown"))


def _readings(diagnosis: Diagnosis) -> tuple[_Reading, list[_Reading]]:
    """The first reading and its rivals; where it has none, itself with each effect that the bench would hardly show."""
    found, decision = diagnosis.found, diagnosis.decision
    named = decision.verdict in ("explained", "group", "partly")
    sets: list[tuple[Candidate, float]] = decision.sets
    if named:
        first = _Reading(sets[0][0].effects, sets[0][0].point)
    elif decision.verdict == "unknown" and found.candidates:
        first = _Reading(found.candidates[0].effects, found.candidates[0].point)
    else:
        first = _Reading(("no_gap",), found.null)
    rivals = [_Reading(c.effects, c.point) for c, p in sets if p > LIKELY and c.effects != first.names]
    if decision.verdict == "unknown":
        rivals += [_Reading(c.effects, c.point) for c in found.candidates[1:4]]
    if decision.empty > LIKELY and first.names != ("no_gap",):
        rivals.append(_Reading(("no_gap",), found.null))
    unique = {r.names: r for r in rivals}
    if unique:
        return first, list(unique.values())[:4]
    return first, [_with(diagnosis, first, effect) for effect in _hidden(diagnosis, first)]


def _hidden(diagnosis: Diagnosis, first: _Reading) -> list[str]:
    """Effects that the bench would have shown only at the largest sizes, against their priors' widths."""
    problem = diagnosis.explore
    by_id = {h.effect: h for h in diagnosis.twin.hypotheses}
    out = []
    for effect, entry in diagnosis.verdict["detectable_from"].items():
        if effect not in first.names and by_id[effect].kind != "calibration":
            m = problem.effect_parameters(by_id[effect])[0]
            out.append((entry["size"] / problem.parameters[m].sd, effect))
    return [effect for _, effect in sorted(out, reverse=True)[:HIDDEN]]


def _with(diagnosis: Diagnosis, first: _Reading, effect: str) -> _Reading:
    """The first reading with one effect more, of half the size that the bench would have shown."""
    problem = diagnosis.explore
    hypothesis = next(h for h in diagnosis.twin.hypotheses if h.effect == effect)
    values = first.point.values.copy()
    own = problem.effect_parameters(hypothesis)
    p, start = problem.parameters[own[0]], hypothesis.starts[0]
    size = min(0.5 * diagnosis.verdict["detectable_from"][effect]["size"], 2.0 * p.sd)
    share = size / max(abs(start[0] - p.off), 1e-300)
    for m, value in zip(own, start, strict=True):
        q = problem.parameters[m]
        values[m] = np.clip(q.off + share * (value - q.off), q.low, q.high)
    return _Reading((effect,), replace(first.point, values=values))


def _carry(diagnosis: Diagnosis, point: Point, problem: Problem) -> np.ndarray:
    """Values of a fit on the bench as values of the imagined twin's parameters; new ones at their means."""
    values = np.array([p.off if p.effect else p.mean for p in problem.parameters])
    for name, m in problem.names.items():
        old = diagnosis.explore.names.get(name)
        if old is not None and problem.parameters[m].fault != "dT":
            values[m] = point.values[old]
    return values


def _shortlist(diagnosis: Diagnosis, problem: Problem, predictions: np.ndarray, every: list[str]) -> list[str]:
    """Recordings in which the readings differ most, by the noise that each kind of statistic has on the bench."""
    usual: dict[tuple[str, str], list[float]] = {}
    for cell, deviation in zip(diagnosis.explore.cells, diagnosis.explore.deviations(), strict=True):
        usual.setdefault((cell.equation, cell.label), []).append(float(deviation))
    deviation = np.array(
        [np.median(usual.get((c.equation, c.label), [np.inf])) if c.label else np.inf for c in problem.cells]
    )
    z = (predictions[1:] - predictions[0]) / deviation
    scores = {name: np.minimum((z[:, problem.rows[name]] ** 2).sum(1), 1e4) for name in every}
    total = {name: float(np.log1p(s).sum()) for name, s in scores.items()}
    order = sorted(every, key=lambda name: (-total[name], int(name)))
    best_each = [max(every, key=lambda name: scores[name][r]) for r in range(len(predictions) - 1)]
    return list(dict.fromkeys([*best_each[:3], *order]))[:SHORTLIST]


def _compare(
    diagnosis: Diagnosis, imagined: Twin, name: str, first: _Reading, rivals: Sequence[_Reading]
) -> tuple[list[float], dict | None]:
    """Squared distance of every rival from the first reading in one imagined recording, and what it would tighten."""
    problem = Problem(imagined, [name])
    at_first = _carry(diagnosis, first.point, problem)
    settle = getattr(imagined, "settle", None)
    if settle is not None:
        settle(at_first, [name])
    problem.set_covariance(at_first)
    points = [_carry(diagnosis, r.point, problem) for r in rivals]
    predictions = problem.predict(np.array([at_first, *points]))
    nuisances = problem.nuisance_jacobian(at_first, predictions[0], problem.nuisances)
    out = []
    for reading, values, prediction in zip(rivals, points, predictions[1:], strict=True):
        own = _own_parameters(diagnosis, problem, reading)
        columns = [nuisances]
        if own:
            columns.append(problem.nuisance_jacobian(values, prediction, own))
        J = problem.whiten(np.concatenate(columns, axis=1))
        S = _known(diagnosis, problem, reading.point, [*problem.nuisances, *own])
        d = problem.whiten(prediction - predictions[0])
        out.append(float(d @ np.linalg.solve(np.eye(len(d)) + J @ S @ J.T, d)))
    own = _own_parameters(diagnosis, problem, first)
    if not own:
        return out, None
    jacobian = problem.nuisance_jacobian(at_first, predictions[0], own)
    J = problem.whiten(np.concatenate([nuisances, jacobian], axis=1))
    S = _known(diagnosis, problem, first.point, [*problem.nuisances, *own])
    after = S - S @ J.T @ np.linalg.solve(np.eye(len(J)) + J @ S @ J.T, J @ S)
    gains = np.sqrt(np.diag(S) / np.maximum(np.diag(after), 1e-300))[-len(own) :]
    best = int(np.argmax(gains))
    return out, {"parameter": problem.parameters[own[best]].name, "factor": round(float(gains[best]), 2)}


def _own_parameters(diagnosis: Diagnosis, problem: Problem, reading: _Reading) -> list[int]:
    """Effect parameters that the bench has fitted in a reading."""
    fitted = {diagnosis.explore.parameters[m].name for m in reading.point.free}
    return [m for m, p in enumerate(problem.parameters) if p.effect is not None and p.name in fitted]


def _known(diagnosis: Diagnosis, problem: Problem, point: Point, parameters: Sequence[int]) -> np.ndarray:
    """(parameter, parameter) covariance of what the bench says of these parameters; new ones have their priors."""
    place = {diagnosis.explore.parameters[m].name: c for c, m in enumerate(point.free)}
    out = np.diag([max(problem.sd[m] ** 2, SOAK_VARIANCE_FLOOR) for m in parameters])
    known = [
        (c, place[problem.parameters[m].name])
        for c, m in enumerate(parameters)
        if problem.parameters[m].name in place and problem.parameters[m].fault != "dT"
    ]
    for c, old in known:
        for d, other in known:
            out[c, d] = point.covariance[old, other]
    return out


def _propose(
    diagnosis: Diagnosis,
    menu: Sequence[Any],
    first: _Reading,
    rivals: Sequence[_Reading],
    found: Sequence[tuple[str, list[float], dict | None]],
) -> list[dict]:
    """The best experiments, each for what the ones before it leave open."""
    left = set(range(len(rivals)))
    pending = list(found)
    out: list[dict] = []
    while pending and len(out) < PROPOSED:
        name, distances, tightens = max(pending, key=lambda item: (_worth(item[1], left), -int(item[0])))
        pending = [item for item in pending if item[0] != name]
        candidates = sorted(left) or list(range(len(rivals)))
        target = max(candidates, key=lambda r: distances[r])
        experiment, distance = menu[int(name)], distances[target]
        shown = [r for r, d in enumerate(distances) if d >= SHOWN]
        out.append(
            {
                "command": experiment.text,
                "ambient_temperature": experiment.ambient_temperature,
                "duration": experiment.duration,
                "separates": _separated(first, rivals[target]),
                "expected_odds": float(f"{np.exp(min(distance / 2.0, np.log(LARGEST_ODDS))):.3g}"),
                "shows": sorted({"+".join(rivals[r].names) for r in shown}),
                "tightens": tightens,
            }
        )
        left.difference_update(shown)
    return out


def _worth(distances: Sequence[float], left: set[int]) -> float:
    """What an experiment shows, each reading up to where it is plain; one that is shown already counts little."""
    return sum((1.0 if r in left else 0.01) * min(d, 2 * SHOWN) for r, d in enumerate(distances))


def _separated(first: _Reading, rival: _Reading) -> list[str]:
    """The two readings by what they do not share."""
    a, b = set(first.names), set(rival.names)
    if not a & b:
        return ["+".join(first.names), "+".join(rival.names)]
    return ["+".join(sorted(a - b)) or "no_gap", "+".join(sorted(b - a)) or "no_gap"]

"""How a search ends: its leading candidates fitted to the end, compared without luck, each against its parts."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from .gaussian import Point
from .inference import Candidate, Problem
from .sizes import admissible, outside, sound
from .twin import Hypothesis

LARGEST = 3  # effects of a set
HOPELESS = 2.0  # gain below which a linearised candidate is not refitted
CLOSE = 1000.0  # gain below which the empty set is fitted a second time: it may have stopped on its way
NEARLY = 0.01  # of the first one's gain, within which a rival may only lack convergence
COMPARED = 4  # candidates that are compared without it
LUCK = 6.0  # of the gain of a fit on single predictions, by which it may be off where they scatter
WITHIN_LUCK = 60.0  # gain that separates candidates beyond what the scatter of their predictions may do
DESERVED = 0.3  # share of what a set leaves that one more effect must take up


def concluded(
    problem: Problem, null: Point, candidates: list[Candidate], by_id: dict[str, Hypothesis], addition: float
) -> tuple[Point, list[Candidate]]:
    """The leading candidates fitted to the end and compared without luck, and the null given the same chances."""
    null, candidates = null_again(problem, null, candidates, by_id)
    least = -LUCK if problem.scatters else HOPELESS
    if candidates and candidates[0].gain > least:
        candidates = fitted_alike(problem, null, candidates, by_id, addition)
        candidates = with_outside(problem, null, candidates, by_id, addition)
        null, candidates = null_again(problem, null, candidates, by_id)
    if candidates and candidates[0].gain > least:
        null, candidates = without_luck(problem, null, candidates, by_id, addition)
        candidates = [c for c in candidates if sound(problem, c, by_id)]
    if candidates:
        candidates = deserved(problem, null, candidates, by_id, addition)
        null, candidates = null_again(problem, null, candidates, by_id, candidates[0].gain < WITHIN_LUCK)
        candidates = [c for c in candidates if sound(problem, c, by_id)]
    return null, candidates


def ranked_by_worth(candidates: Iterable[Candidate], addition: float) -> list[Candidate]:
    """Best first; an effect more must be worth it: ``addition`` is the prior odds against each further member."""
    return sorted(candidates, key=lambda c: addition * (len(c.effects) - 1) - c.gain)


def null_again(
    problem: Problem,
    null: Point,
    candidates: list[Candidate],
    by_id: dict[str, Hypothesis],
    averaged: bool = False,
) -> tuple[Point, list[Candidate]]:
    """The null begun once more where the first candidate's nuisances ended, for it may have stopped on its way; where
    that helped, the candidate from there in turn.

    ``averaged`` says that null and candidate are predictions averaged over their scatter.
    """
    if not candidates or not 0.0 < candidates[0].gain < CLOSE:
        return null, candidates
    again = problem.refit_null(candidates[0].point)
    if averaged and problem.scatters:
        again = problem.averaged(again)
    better = again.log_evidence - null.log_evidence
    if better <= 0.0 or again.objective >= null.objective:
        return null, candidates
    first, *rest = (replace(c, gain=c.gain - better) for c in candidates)
    chosen = [by_id[e] for e in first.effects]
    own, widened = problem.freed(chosen)
    values = again.values.copy()
    values[own] = first.point.values[own]
    point = problem.resumed(first.point, values, widened)
    if averaged and problem.scatters:
        point = _averaged_point(problem, again, point, chosen)
    if point.objective < first.point.objective:
        first = replace(first, point=point, gain=point.log_evidence - again.log_evidence)
    return again, [first, *rest]


def fitted_alike(
    problem: Problem, null: Point, ranked: list[Candidate], by_id: dict[str, Hypothesis], addition: float
) -> list[Candidate]:
    """The first candidate and those that come near it, fitted to the end: of a strong gap, what two fits lack in
    convergence is more than what tells them apart."""

    def fitted(candidate: Candidate) -> Candidate | None:
        done = problem.polish(null, candidate, by_id)
        return done if sound(problem, done, by_id) else None

    first = None
    while ranked and first is None:
        first, ranked = fitted(ranked[0]), ranked[1:]
    if first is None:
        return []
    members, near = set(first.effects), max(WITHIN_LUCK, NEARLY * first.gain)
    rivals = [
        c for c in ranked if first.gain - c.gain < near and not (set(c.effects) > members or set(c.effects) < members)
    ][: COMPARED - 1]
    done = [first, *(c for c in map(fitted, rivals) if c is not None)]
    return ranked_by_worth([*done, *(c for c in ranked if not any(c is r for r in rivals))], addition)


def with_outside(
    problem: Problem, null: Point, ranked: list[Candidate], by_id: dict[str, Hypothesis], addition: float
) -> list[Candidate]:
    """The candidates, and the first one together with what it has far outside the unit's tolerances.

    That is a cause as well. While a set was still on its way it could not be told from what the fit lacked.
    """
    if not ranked:
        return ranked
    first = ranked[0]
    far = [e for e in outside(problem, first.point, by_id) if e not in first.effects]
    if not 0 < len(far) <= LARGEST - len(first.effects):
        return ranked
    effects = (*first.effects, *far)
    _, widened = problem.freed([by_id[e] for e in effects])
    point = problem.resumed(first.point, first.point.values, widened)
    whole = replace(first, effects=effects, point=point, gain=point.log_evidence - null.log_evidence)
    if not admissible(problem, whole, by_id):
        return ranked
    others = [c for c in ranked if set(c.effects) != set(effects)]
    same = [c for c in ranked if set(c.effects) == set(effects)]
    return ranked_by_worth([max([whole, *same], key=lambda c: c.gain), *others], addition)


def without_luck(
    problem: Problem, null: Point, candidates: list[Candidate], by_id: dict[str, Hypothesis], addition: float
) -> tuple[Point, list[Candidate]]:
    """The leading candidates, and the null where it is near, compared on predictions averaged over their scatter.

    A fit goes on where a single prediction happens to fall well, which is luck and not evidence.
    """
    if not problem.scatters:
        return null, candidates
    top = candidates[0].gain
    leading = [c for c in candidates if c.gain > top - WITHIN_LUCK][:COMPARED]
    if top < WITHIN_LUCK:
        again = problem.averaged(null)
        shift = again.log_evidence - null.log_evidence
        null, candidates = again, [replace(c, gain=c.gain - shift) for c in candidates]
        leading = candidates[: len(leading)]
    elif len(leading) == 1:
        return null, candidates
    rest = candidates[len(leading) :]
    ranked = ranked_by_worth([*(averaged_fit(problem, null, c, by_id) for c in leading), *rest], addition)
    if not ranked[0].polished:
        ranked[0] = _finished(problem, null, ranked[0], by_id)
        ranked = ranked_by_worth(ranked, addition)
    return null, ranked


def deserved(
    problem: Problem, null: Point, ranked: list[Candidate], by_id: dict[str, Hypothesis], addition: float
) -> list[Candidate]:
    """Give way to a part of the first set, fitted again from where the set ended, where what the whole adds is little
    of what the part leaves, or less evidence than one more effect must bring (``addition``).

    A cause written in another form leaves a remainder, and some other effect always takes a little of it up.
    """

    def idle(part: Candidate, whole: Candidate) -> bool:
        before, after = problem.excess(part.point), problem.excess(whole.point)
        return before - after < DESERVED * before

    while ranked[0].polished and len(ranked[0].effects) > 1:
        whole = ranked[0]
        # of a part that was left behind early nobody knows how well it fits
        again = problem.refine_all(null, [(part, 2) for part in parts_of(problem, null, whole, by_id)], by_id)
        if problem.scatters:
            again = [averaged_fit(problem, null, c, by_id) if c.gain > whole.gain - WITHIN_LUCK else c for c in again]
        parts = [c for c in ranked[1:] if set(c.effects) < set(whole.effects)]
        parts += [c for c in again if admissible(problem, c, by_id)]
        found = [c for c in sorted(parts, key=lambda c: -c.gain) if idle(c, whole) or whole.gain < c.gain + addition]
        if not found:
            break
        first = _finished(problem, null, found[0], by_id)
        ranked = [first, *(c for c in ranked if set(c.effects) != set(first.effects))]
    return ranked


def parts_of(problem: Problem, null: Point, whole: Candidate, by_id: dict[str, Hypothesis]) -> list[Candidate]:
    """A set without each of its members, linearised about where it ended."""
    out = []
    for effect in whole.effects:
        kept = tuple(e for e in whole.effects if e != effect)
        chosen = [by_id[e] for e in kept]
        own, _ = problem.freed(chosen)
        begin = whole.point.values.copy()
        for m in problem.effect_parameters(by_id[effect]):
            begin[m] = problem.mean[m] if by_id[effect].kind == "calibration" else problem.parameters[m].off
        signature = whole.point.jacobian[:, [whole.point.free.index(m) for m in own]]
        out.append(problem.linear(null, chosen, begin, problem.predict(begin)[0], signature))
    return out


def _finished(problem: Problem, null: Point, candidate: Candidate, by_id: dict[str, Hypothesis]) -> Candidate:
    """The candidate fitted to the end, its prediction averaged where single ones scatter."""
    done = problem.polish(null, candidate, by_id)
    return averaged_fit(problem, null, done, by_id) if problem.scatters else done


def averaged_fit(problem: Problem, null: Point, candidate: Candidate, by_id: dict[str, Hypothesis]) -> Candidate:
    """The candidate with its prediction averaged over the scatter of single ones."""
    chosen = [by_id[e] for e in candidate.effects]
    fallen = candidate.gain - LUCK if candidate.gain < WITHIN_LUCK else -np.inf
    point = _averaged_point(problem, null, candidate.point, chosen, fallen)
    return replace(candidate, point=point, gain=point.log_evidence - null.log_evidence)


def _averaged_point(
    problem: Problem, null: Point, point: Point, chosen: Sequence[Hypothesis], least: float = -np.inf
) -> Point:
    """A set's fit averaged over the scatter; begun at the null's once more where it ends above that, or with less than
    ``least`` gain: the set contains the null, and a single prediction may have led astray."""
    found = problem.averaged(point, chosen)
    if found.objective > null.objective or found.log_evidence - null.log_evidence < least:
        nested = problem.averaged_from(null, found, chosen)
        found = nested if nested.objective < found.objective else found
    return found

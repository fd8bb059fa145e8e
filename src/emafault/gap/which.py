"""Which effect: evidence of the empty set, of every effect, of pairs and triples by beam."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .gaussian import Point
from .inference import Candidate, Problem
from .misfit import MOST, SPECIFICATION, Family, families, unexplained
from .sizes import far_outside, held, of_size, outside, sound
from .twin import Hypothesis

REFINED_SINGLES = 5
REFINED_PAIRS = 3
LARGEST = 3  # effects of a set
STRONG = 30.0  # gain above which covariance and derivatives are taken anew at the best single effect
REBASES = 3
CLOSE = 1000.0  # gain below which the empty set is fitted a second time: it may have stopped on its way
DESERVED = 0.3  # share of what a set leaves that one more effect must take up
WITHIN_LUCK = 60.0  # gain that separates candidates beyond what the scatter of their predictions may do
NEARLY = 0.01  # of the first one's gain, within which a rival may only lack convergence
COMPARED = 4  # candidates that are compared without it
HOPELESS = 2.0  # gain below which a linearised candidate is not refitted
LUCK = 6.0  # of the gain of a fit on single predictions, by which it may be off where they scatter


@dataclass(frozen=True)
class Search:
    """Everything the decision needs: the null fit, candidates by decreasing gain, misfit by family before and after."""

    null: Point
    candidates: list[Candidate]
    singles: list[Candidate]  # linearised, one per effect, for what the data could have shown
    families: list[Family]  # of the best structural candidate (of the null where there is none)
    null_families: list[Family]
    #: the null with the first candidate's calibration effects at their specification, from where these count
    within: Point

    @property
    def regions(self) -> list[Family]:
        """What the null fit misses along a coordinate, largest first."""
        return [f for f in self.null_families if f.along != SPECIFICATION]


def search(problem: Problem, hypotheses: Sequence[Hypothesis], addition: float) -> Search:
    """Fit the empty set and candidate sets; ``addition`` is the gain in log evidence one more effect must bring."""
    null = problem.fit_null()
    by_id = {h.effect: h for h in hypotheses}
    screened = problem.screen(null, hypotheses)
    best_of: dict[str, Candidate] = {}
    for candidate in screened:
        effect = candidate.effects[0]
        if effect not in best_of or candidate.gain > best_of[effect].gain:
            best_of[effect] = candidate
    singles = sorted(best_of.values(), key=lambda c: -c.gain)
    tried: dict[tuple[str, ...], Candidate] = {}

    def accept(candidates: Iterable[Candidate]) -> None:
        for candidate in candidates:
            key = tuple(sorted(candidate.effects))
            if not _admissible(problem, candidate, by_id):
                continue
            if key not in tried or candidate.gain > tried[key].gain:
                tried[key] = candidate

    count, promising = 0, []
    for candidate in sorted(screened, key=lambda c: -c.gain):
        if candidate.gain < HOPELESS or count >= REFINED_SINGLES + 3:
            break
        effect = candidate.effects[0]
        if count >= REFINED_SINGLES and candidate.gain < 0.5 * singles[0].gain:
            break
        promising.append((candidate, 3 if candidate.gain > 0.5 * singles[0].gain else 2))
        # every start of the leading effect is followed: a linearised gain does not tell a good start from a bad one
        count += effect != singles[0].effects[0]
    accept(problem.refine_all(null, promising, by_id))
    beam = _best(tried, 1)[:2]
    for round_ in range(REBASES):
        if not beam or beam[0].gain < STRONG:
            break
        before = beam[0].point.misfit
        null = problem.rebase(null, beam[0])
        kept, tried = _best(tried, 1), {}
        again = [(kept[0], 4)]
        for candidate in kept[1:4]:
            if candidate.gain > 0.2 * kept[0].gain or (candidate is kept[1] and round_ == 0):
                again.append((candidate, 2))
        accept(problem.refine_all(null, again, by_id))
        beam = _best(tried, 1)[:2]
        if not beam or beam[0].point.misfit > 0.8 * before or beam[0].point.misfit < 1.2 * len(problem.cells):
            break
    for size in range(2, LARGEST + 1):
        grown = _grow(problem, null, beam, singles, by_id, addition)
        if not grown:
            break
        known = set(tried)
        accept(problem.refine_all(null, [(candidate, 3) for candidate in grown], by_id))
        new = [c for k, c in tried.items() if k not in known]
        if not new:
            break
        top = max(new, key=lambda c: c.gain)
        if beam and top.gain > beam[0].gain + addition and not beam[0].polished:
            # what a set lacks in convergence is not to be had by one more effect
            accept([problem.polish(null, beam[0], by_id)])
            beam = _best(tried, size - 1)[:2]
        if beam and top.gain < beam[0].gain + addition:
            break
        beam = _best(tried, size)[:2]
    _prune(problem, null, tried, by_id, accept)
    null, candidates = _concluded(problem, null, _ranked(tried.values(), addition), by_id, addition)
    unfitted = families(problem, null)
    left, within = unfitted, null
    if candidates:
        within = held(problem, null, candidates[0], by_id)
    if unexplained(problem, within, candidates[0].point if candidates else null) > MOST:
        unit = _outside(problem, null, by_id)
        if unit is not None:
            within = held(problem, null, unit, by_id)
            candidates = [unit, *(c for c in candidates if set(c.effects) != set(unit.effects))]
    if candidates:
        chosen = [by_id[e] for e in candidates[0].effects]
        _, widened = problem.freed(chosen)
        left = families(problem, candidates[0].point, widened)
    return Search(null, candidates, singles, left, unfitted, within)


def _admissible(problem: Problem, candidate: Candidate, by_id: dict[str, Hypothesis]) -> bool:
    """Whether each member of a set is there at all: no effect negligible, a calibration effect far outside."""
    units = [by_id[e] for e in candidate.effects if by_id[e].kind == "calibration"]
    return all(far_outside(problem, h, candidate.point) for h in units) and of_size(problem, candidate, by_id)


def _concluded(
    problem: Problem, null: Point, candidates: list[Candidate], by_id: dict[str, Hypothesis], addition: float
) -> tuple[Point, list[Candidate]]:
    """The leading candidates fitted to the end and compared without luck, and the null given the same chances."""
    null, candidates = _null_again(problem, null, candidates, by_id)
    least = -LUCK if problem.scatters else HOPELESS
    if candidates and candidates[0].gain > least:
        candidates = _fitted_alike(problem, null, candidates, by_id, addition)
        candidates = _with_outside(problem, null, candidates, by_id, addition)
        null, candidates = _null_again(problem, null, candidates, by_id)
    if candidates and candidates[0].gain > least:
        null, candidates = _without_luck(problem, null, candidates, by_id, addition)
        candidates = [c for c in candidates if sound(problem, c, by_id)]
    if candidates:
        candidates = _deserved(problem, null, candidates, by_id, addition)
        null, candidates = _null_again(problem, null, candidates, by_id, candidates[0].gain < WITHIN_LUCK)
        candidates = [c for c in candidates if sound(problem, c, by_id)]
    return null, candidates


def _with_outside(
    problem: Problem, null: Point, ranked: list[Candidate], by_id: dict[str, Hypothesis], addition: float
) -> list[Candidate]:
    """The candidates, and the first one together with what it has far outside the unit's tolerances.

    That is a cause as well. While a set was still on its way it could not be told from what the fit lacked.
    """
    first = ranked[0] if ranked else None
    far = [e for e in outside(problem, first.point, by_id) if e not in first.effects] if first else []
    if first is None or not 0 < len(far) <= LARGEST - len(first.effects):
        return ranked
    effects = (*first.effects, *far)
    _, widened = problem.freed([by_id[e] for e in effects])
    point = problem.resumed(first.point, first.point.values, widened)
    whole = replace(first, effects=effects, point=point, gain=point.log_evidence - null.log_evidence)
    if not _admissible(problem, whole, by_id):
        return ranked
    others = [c for c in ranked if set(c.effects) != set(effects)]
    same = [c for c in ranked if set(c.effects) == set(effects)]
    return _ranked([max([whole, *same], key=lambda c: c.gain), *others], addition)


def _outside(problem: Problem, null: Point, by_id: dict[str, Hypothesis]) -> Candidate | None:
    """The calibration effects that the null has far outside their tolerance, of which each is most of the gap that
    there is with it at its specification.

    The null takes such an effect up but for the pull of the specification. Where it has another form than the model's
    it leaves a remainder, which other sets then compete for though the cause is found.
    """

    def set_of(*effects: str) -> Candidate:
        _, own = problem.freed([by_id[e] for e in effects])
        columns = null.jacobian[:, [null.free.index(m) for m in own]]
        return Candidate(effects, null, 0.0, True, null.values, columns)

    far = [set_of(e) for e in outside(problem, null, by_id)]
    most = [c.effects[0] for c in far if unexplained(problem, held(problem, null, c, by_id), null) < MOST]
    if not most:
        return None
    _, widened = problem.freed([by_id[e] for e in most])
    point = problem.resumed(null, null.values, widened)
    return problem.polish(null, replace(set_of(*most), point=point), by_id)


def _ranked(candidates: Iterable[Candidate], addition: float) -> list[Candidate]:
    """Best first; an effect more must be worth it: ``addition`` is the prior odds against each further member."""
    return sorted(candidates, key=lambda c: addition * (len(c.effects) - 1) - c.gain)


def _null_again(
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


def _fitted_alike(
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
    return _ranked([*done, *(c for c in ranked if not any(c is r for r in rivals))], addition)


def _deserved(
    problem: Problem, null: Point, ranked: list[Candidate], by_id: dict[str, Hypothesis], addition: float
) -> list[Candidate]:
    """Give way to a smaller set where what the larger one adds is little of what the smaller one leaves.

    A cause written in another form leaves a remainder, and some other effect always takes a little of it up.
    """

    def idle(part: Candidate, whole: Candidate) -> bool:
        before, after = problem.excess(part.point), problem.excess(whole.point)
        return before - after < DESERVED * before

    while ranked[0].polished and len(ranked[0].effects) > 1:
        whole = ranked[0]
        # of a part that was left behind early nobody knows how well it fits
        again = problem.refine_all(null, [(part, 2) for part in _parts(problem, null, whole, by_id)], by_id)
        if problem.scatters:
            near = [c for c in again if c.gain > whole.gain - WITHIN_LUCK]
            again = [_averaged(problem, null, c, by_id) if any(c is n for n in near) else c for c in again]
        parts = [c for c in ranked[1:] if set(c.effects) < set(whole.effects)]
        parts += [c for c in again if _admissible(problem, c, by_id)]
        found = [c for c in sorted(parts, key=lambda c: -c.gain) if idle(c, whole) or whole.gain < c.gain + addition]
        if not found:
            break
        first = _finished(problem, null, found[0], by_id)
        ranked = [first, *(c for c in ranked if set(c.effects) != set(first.effects))]
    return ranked


def _finished(problem: Problem, null: Point, candidate: Candidate, by_id: dict[str, Hypothesis]) -> Candidate:
    """The candidate fitted to the end, its prediction averaged where single ones scatter."""
    done = problem.polish(null, candidate, by_id)
    return _averaged(problem, null, done, by_id) if problem.scatters else done


def _averaged(problem: Problem, null: Point, candidate: Candidate, by_id: dict[str, Hypothesis]) -> Candidate:
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


def _without_luck(
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
    ranked = _ranked([*(_averaged(problem, null, c, by_id) for c in leading), *rest], addition)
    if not ranked[0].polished:
        ranked[0] = _finished(problem, null, ranked[0], by_id)
        ranked = _ranked(ranked, addition)
    return null, ranked


def _best(tried: dict[tuple[str, ...], Candidate], size: int) -> list[Candidate]:
    chosen = [c for k, c in tried.items() if len(k) == size]
    return sorted(chosen, key=lambda c: -c.gain)


def _grow(
    problem: Problem,
    null: Point,
    beam: Sequence[Candidate],
    singles: Sequence[Candidate],
    by_id: dict[str, Hypothesis],
    addition: float,
) -> list[Candidate]:
    """The most promising sets with one effect more than those of the beam, linearised about the beam's fits."""
    grown: dict[tuple[str, ...], Candidate] = {}
    for base in beam:
        for single in singles:
            effect = single.effects[0]
            if effect in base.effects:
                continue
            chosen = [by_id[e] for e in (*base.effects, effect)]
            own, _ = problem.freed([by_id[e] for e in base.effects])
            inherited = base.point.jacobian[:, [base.point.free.index(m) for m in own]]
            if by_id[effect].kind == "calibration":
                signature, begin = inherited, base.point.values
            else:
                signature = np.concatenate([inherited, single.signature], axis=1)
                begin = base.point.values.copy()
                new = problem.effect_parameters(by_id[effect])
                # secondary parameters (a Stribeck speed, a damping) keep the start's value: alone they do nothing
                quiet = [c for c in range(len(new)) if not np.any(single.signature[:, c])]
                for c in quiet:
                    begin[new[c]] = single.start[new[c]]
            candidate = problem.linear(null, chosen, begin, base.point.prediction, signature)
            if candidate.gain > base.gain + addition:
                # the beam is in order of gain: what is linearised about the better fit is the better linearisation
                grown.setdefault(tuple(sorted(candidate.effects)), candidate)
    return sorted(grown.values(), key=lambda c: -c.gain)[:REFINED_PAIRS]


def _parts(problem: Problem, null: Point, whole: Candidate, by_id: dict[str, Hypothesis]) -> list[Candidate]:
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


def _prune(problem: Problem, null: Point, tried: dict, by_id: dict[str, Hypothesis], accept) -> None:
    """Refit the best set without each of its members from where it ended: a member may be idle, or have only helped
    the others on their way."""
    best = max(tried.values(), key=lambda c: c.gain, default=None)
    while best is not None and len(best.effects) > 1:
        smaller = [(part, 2) for part in _parts(problem, null, best, by_id)]
        accept(problem.refine_all(null, smaller, by_id))
        top = max(tried.values(), key=lambda c: c.gain)
        if top is best:
            return
        best = top

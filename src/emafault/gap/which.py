"""Which effect: evidence of the empty set, of every effect, of pairs and triples by beam."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .conclude import HOPELESS, LARGEST, concluded, parts_of, ranked_by_worth
from .gaussian import Point
from .inference import Candidate, Problem
from .misfit import MOST, SPECIFICATION, Family, families, unexplained
from .sizes import admissible, held, outside
from .twin import Hypothesis

REFINED_SINGLES = 5
REFINED_PAIRS = 3
STRONG = 30.0  # gain above which covariance and derivatives are taken anew at the best single effect
REBASES = 3


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
            if not admissible(problem, candidate, by_id):
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
    null, candidates = concluded(problem, null, ranked_by_worth(tried.values(), addition), by_id, addition)
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


def _prune(problem: Problem, null: Point, tried: dict, by_id: dict[str, Hypothesis], accept) -> None:
    """Refit the best set without each of its members from where it ended: a member may be idle, or have only helped
    the others on their way."""
    best = max(tried.values(), key=lambda c: c.gain, default=None)
    while best is not None and len(best.effects) > 1:
        smaller = [(part, 2) for part in parts_of(problem, null, best, by_id)]
        accept(problem.refine_all(null, smaller, by_id))
        top = max(tried.values(), key=lambda c: c.gain)
        if top is best:
            return
        best = top

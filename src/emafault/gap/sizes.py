"""How large the members of a fitted set are: negligible, at the edge of their range, far outside a tolerance."""

from collections.abc import Mapping

from .gaussian import Point
from .inference import Candidate, Problem
from .twin import Hypothesis

FAR_OUTSIDE = 4.0  # tolerances (1 sigma) beyond which a calibration effect is named
OFF = 1e-6  # of the range of an amplitude, within which it is zero
EDGE = 0.01  # of the range of an amplitude, within which it is at the range's end


def far_outside(problem: Problem, hypothesis: Hypothesis, point: Point) -> bool:
    """Whether a calibration effect's parameter lies beyond ``FAR_OUTSIDE`` tolerances."""
    own = problem.effect_parameters(hypothesis)
    return any(abs(point.values[m] - problem.mean[m]) > FAR_OUTSIDE * problem.sd[m] for m in own)


def negligible(problem: Problem, hypothesis: Hypothesis, point: Point) -> bool:
    """Whether an effect is off, or smaller than it ever is where its realistic range does not begin at zero."""
    own = [problem.parameters[m] for m in problem.effect_parameters(hypothesis)]
    sizes = [
        (abs(point.values[problem.names[p.name]] - p.off), max(p.least, OFF * (p.high - p.low)))
        for p in own
        if p.amplitude or p.least > 0.0
    ]
    return bool(sizes) and all(size < least for size, least in sizes)


def at_edge(problem: Problem, hypothesis: Hypothesis, point: Point) -> bool:
    """Whether an amplitude of an effect ends where its range does, well beyond the largest that is realistic: its
    optimum lies elsewhere, so that the effect stands in for something else."""
    for m in problem.effect_parameters(hypothesis):
        p = problem.parameters[m]
        near = EDGE * (p.high - p.low)
        if p.amplitude and any(abs(point.values[m] - end) < near < abs(end - p.off) for end in (p.low, p.high)):
            return True
    return False


def held(problem: Problem, null: Point, candidate: Candidate, by_id: Mapping[str, Hypothesis]) -> Point:
    """The null with a candidate's calibration effects at their specification."""
    _, own = problem.freed([by_id[e] for e in candidate.effects])
    if not own:
        return null
    columns = [c for c, m in enumerate(null.free) if m not in own]
    values = null.values.copy()
    values[own] = problem.mean[own]
    start = problem.predict(values)[0]
    fit = problem.descend(problem.point(values, start, null.jacobian[:, columns], [null.free[c] for c in columns]))
    return problem.point(fit.values, fit.prediction, null.jacobian, null.free)


def outside(problem: Problem, point: Point, by_id: Mapping[str, Hypothesis]) -> list[str]:
    """The calibration effects that a fit has far outside their tolerance, named or not."""
    return [e for e, h in by_id.items() if h.kind == "calibration" and far_outside(problem, h, point)]


def of_size(problem: Problem, candidate: Candidate, by_id: Mapping[str, Hypothesis]) -> bool:
    """Whether no member of a candidate is negligible."""
    return not any(negligible(problem, by_id[e], candidate.point) for e in candidate.effects)


def sound(problem: Problem, candidate: Candidate, by_id: Mapping[str, Hypothesis]) -> bool:
    """Whether each member of a candidate is as large as it ever is, and no larger."""
    return of_size(problem, candidate, by_id) and not any(
        at_edge(problem, by_id[e], candidate.point) for e in candidate.effects
    )


def admissible(problem: Problem, candidate: Candidate, by_id: Mapping[str, Hypothesis]) -> bool:
    """Whether each member of a set is there at all: no effect negligible, a calibration effect far outside."""
    units = [by_id[e] for e in candidate.effects if by_id[e].kind == "calibration"]
    return all(far_outside(problem, h, candidate.point) for h in units) and of_size(problem, candidate, by_id)

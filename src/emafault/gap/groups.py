"""What these data cannot tell apart."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from .gaussian import Point
from .inference import Candidate, Problem

GROUP_DISTANCE = 6.0  # squared distance below which two causes leave the same trace


def groups(problem: Problem, null: Point, candidates: Sequence[Candidate]) -> list[list[Candidate]]:
    """The first candidate together with those that these data cannot tell from it.

    Predictions that differ by no more than they scatter do not differ, nor are their sets told apart by how well each
    happens to fall: a member's gain is that of the first one's prediction moved by what truly differs.
    """
    if not candidates:
        return []
    first = candidates[0]
    members = [first]
    for other in candidates[1:]:
        if any(set(other.effects) >= set(m.effects) or set(other.effects) <= set(m.effects) for m in members):
            continue
        apart = problem.seen(other.point.prediction - first.point.prediction)
        distance = problem.squared_distance(null, problem.whiten(apart))
        moved = problem.whiten(problem.observed - first.point.prediction - apart)
        gain = other.gain + 0.5 * (other.point.misfit - float(moved @ moved))
        # two predictions so far apart differ in log evidence by about as much from the noise of the data alone
        if distance < GROUP_DISTANCE and first.gain - gain < GROUP_DISTANCE / 2 + 2.0 * np.sqrt(distance):
            members.append(replace(other, gain=gain))
            continue
        # scatter puts predictions further apart than they are: the data do not prefer one of these either
        gain = max(gain, other.gain)
        if distance < 2.0 * GROUP_DISTANCE and first.gain - gain < GROUP_DISTANCE / 2:
            members.append(replace(other, gain=gain))
    return [members]


def confusability(problem: Problem, null: Point, singles: Sequence[Candidate]) -> dict[tuple[str, str], float]:
    """Cosine of the signatures of every two effects with the nuisances projected out, largest over their parameters."""
    bases = {}
    for c in singles:
        if c.signature.size and np.any(c.signature):
            signature = problem.whiten(c.signature)
            columns = problem.projected(null, signature)
            inner = signature.T @ columns
            values, vectors = np.linalg.eigh(0.5 * (inner + inner.T))
            keep = values > 1e-9 * max(values.max(), 1e-30)
            bases[c.effects[0]] = (signature @ vectors[:, keep], columns @ vectors[:, keep] / values[keep])
    out = {}
    for (a, (raw_a, dual_a)), (b, (raw_b, dual_b)) in combinations(bases.items(), 2):
        # squared canonical correlations of the two signature spaces under the marginal metric
        cross = (dual_a.T @ raw_b) @ (dual_b.T @ raw_a)
        out[a, b] = float(np.sqrt(np.clip(np.max(np.real(np.linalg.eigvals(cross))), 0.0, 1.0)))
    return out

"""From evidence to probabilities and a verdict, with coefficients calibrated on blind cases and then frozen.

Two logistic curves turn what a search has found into probabilities: that there is a gap at all, and, if so, that the
best set is its cause and not the least bad of a library that lacks the cause. Their coefficients live in a calibration
file.
"""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from .groups import groups
from .how_far import square_error
from .inference import Candidate, Problem
from .misfit import MOST, left_where_acting, unexplained
from .sizes import far_outside, outside
from .twin import Hypothesis
from .which import Search

DEFAULT = Path(__file__).with_name("calibration.json")
#: the prior of a calibration
UNCALIBRATED = Path(__file__).with_name("uncalibrated.json")
AMPLE = 1000.0  # of log evidence or excess: what is more says no more
WITHDRAWN = 0.2  # the most that is believed of a set that leaves more, or has no evidence over the empty one


@dataclass(frozen=True)
class Calibration:
    """Frozen coefficients: of the two curves (intercept first) and the gain that one more effect must bring."""

    gap: tuple[float, ...]
    right: tuple[float, ...]
    addition: float
    remainder: float  # largest family excess that an explained bench may leave
    most: float = 1.0  # probability that a set is given at most, as far as the development cases can support one
    source: str = ""

    @classmethod
    def load(cls, path: Path = DEFAULT) -> "Calibration":
        """Read a calibration file.

        Raises
        ------
        InputError : a file that is missing or is no calibration
        """
        try:
            raw = json.loads(path.read_text())
            values: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in raw.items()}
            return cls(**values)
        except (OSError, ValueError, TypeError) as error:
            raise InputError(f"{path}: not a calibration file ({error})") from error

    def save(self, path: Path) -> None:
        """Write the calibration as JSON."""
        path.write_text(json.dumps(asdict(self), indent=2) + "\n")


def saturating(x: float) -> float:
    """log(1 + x) of what is positive, up to ``AMPLE``."""
    return float(np.log1p(np.clip(x, 0.0, AMPLE)))


@dataclass(frozen=True)
class Evidence:
    """What the curves see of a search."""

    gain: float  # of the best set over the empty set, its calibration effects at their specification; log evidence
    null_excess: float  # largest family excess of the null fit
    excess: float  # largest family excess that the best set leaves
    unexplained: float  # share of that one's excess that the best set leaves
    acting: float  # share of the misfit left in the kinds of statistics that the best set acts on
    margin: float  # gain over the best rival outside the group
    dof: int

    def gap_features(self) -> np.ndarray:
        """(1, log gain, log null excess)."""
        return np.array([1.0, saturating(self.gain), saturating(self.null_excess)])

    def right_features(self) -> np.ndarray:
        """(1, log gain, log share left, log share left where the set acts, log margin)."""
        return np.array(
            [
                1.0,
                saturating(self.gain),
                np.log10(max(self.unexplained, 1e-5)),
                np.log10(max(self.acting, 1e-3)),
                saturating(self.margin),
            ]
        )


def evidence_of(problem: Problem, found: Search, hypotheses: Sequence[Hypothesis]) -> tuple[Evidence, list[Candidate]]:
    """Summary of a search and the group of its best set."""
    by_id = {h.effect: h for h in hypotheses}
    dof = len(problem.cells)
    null_excess = found.null_families[0].excess if found.null_families else 0.0
    if not found.candidates:
        return Evidence(0.0, null_excess, null_excess, 1.0, 1.0, 0.0, dof), []
    best = found.candidates[0]
    names = set(best.effects)
    # what holds the best set and more, named or not, is no alternative to it
    others = [c for c in found.candidates[1:] if not {*c.effects, *outside(problem, c.point, by_id)} > names]
    group = groups(problem, found.null, [best, *others])[0]
    inside = {c.effects for c in group}
    # all gains are over the null, in which a calibration effect is but for the pull of its specification
    pulled = found.null.log_evidence - found.within.log_evidence
    rivals = [c.gain + pulled for c in others if c.effects not in inside and not set(c.effects) < names]
    gain = best.gain + pulled
    margin = gain - max([*rivals, 0.0])
    share = unexplained(problem, found.within, best.point)
    _, widened = problem.freed([by_id[e] for e in best.effects])
    acting = left_where_acting(problem, found.null, best.point, widened)
    return Evidence(gain, null_excess, found.families[0].excess, share, acting, margin, dof), group


def share_left(recalibrated: float, after: float, size: int) -> float | None:
    """Share of the confirm recordings' excess misfit that the named set leaves; None where they show no gap.

    A gap that is not there before and there after the named set counts as seen. What is left counts as far as it is
    more than two standard errors, for of a gap hardly seen noise alone leaves a large share.
    """
    visible, left = recalibrated**2 - 1.0, after**2 - 1.0
    error, error_left = square_error(recalibrated, size), square_error(after, size)
    if visible < 4.0 * error and left < 4.0 * error_left:
        return None
    return max(left - 2.0 * error_left, 0.0) / max(visible, error)


def _sigmoid(x: float) -> float:
    return float(1.0 / (1.0 + np.exp(-np.clip(x, -30.0, 30.0))))


@dataclass(frozen=True)
class Decision:
    """Verdict, probabilities that sum to one (sets, the empty set, unknown) and the group of the first set."""

    verdict: str
    sets: list[tuple[Candidate, float]]
    empty: float
    unknown: float
    group: list[Candidate]
    evidence: Evidence


def decide(
    problem: Problem,
    found: Search,
    hypotheses: Sequence[Hypothesis],
    calibration: Calibration,
    left: float | None = None,
) -> Decision:
    """Turn a search into a verdict by the frozen curves; ``left`` is what ``share_left`` says of it."""
    evidence, group = evidence_of(problem, found, hypotheses)
    p_gap = _sigmoid(float(np.dot(calibration.gap, evidence.gap_features())))
    if not found.candidates:
        unknown = p_gap
        return Decision("unknown" if unknown > 0.5 else "no_gap", [], 1.0 - p_gap, unknown, [], evidence)
    odds = float(np.dot(calibration.right, evidence.right_features()))
    p_right = calibration.most * _sigmoid(odds)
    if evidence.gain <= 0.0 or max(evidence.unexplained, evidence.acting, left or 0.0) > MOST:
        p_right = min(p_right, WITHDRAWN)
    weights = np.array([np.exp(min(0.0, c.gain - group[0].gain)) for c in group])
    weights /= weights.sum()
    sets = [(c, float(p_gap * p_right * w)) for c, w in zip(group, weights, strict=True)]
    inside = {c.effects for c in group}
    rivals = [c for c in found.candidates if c.effects not in inside][:6]
    rest = p_gap * (1.0 - p_right)
    if rivals:
        # what is not believed of the first set goes to its rivals by their evidence and, at least half, to the unknown
        odds = np.exp(np.clip([c.gain - group[0].gain for c in rivals], -30.0, 0.0))
        share = 0.5 * odds / max(1.0, odds.sum())
        sets += [(c, float(rest * s)) for c, s in zip(rivals, share, strict=True)]
        rest -= rest * float(share.sum())
    empty = 1.0 - p_gap
    named = p_gap * p_right
    if empty >= max(named, rest):
        verdict = "no_gap"
    elif rest > named:
        verdict = "unknown"
    elif len(group) > 1:
        verdict = "group"
    elif evidence.excess > calibration.remainder:
        verdict = "partly"
    else:
        verdict = "explained"
    return Decision(verdict, sets, empty, rest, group, evidence)


def is_named(problem: Problem, hypothesis, candidate: Candidate) -> bool:
    """Whether a member of a set is far enough from its off value to be named (calibration effects by tolerance)."""
    return hypothesis.kind != "calibration" or far_outside(problem, hypothesis, candidate.point)

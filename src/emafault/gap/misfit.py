"""What a fit leaves: by kind of statistic, as a share of the gap, and where a set acts."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .gaussian import Point
from .inference import Problem

MOST = 0.5  # share that a named set may leave of the gap, where it acts, and of the gap on the confirm recordings
SPECIFICATION = "specification"  # where the misfit of a parameter with its specification lies


@dataclass(frozen=True)
class Family:
    """All statistics of one kind over the recordings: how far they are from a prediction, in standard deviations."""

    equation: str
    label: str
    along: str
    excess: float
    size: int


def families(problem: Problem, point: Point, widened: Sequence[int] = ()) -> list[Family]:
    """Misfit by kind of statistic, whitened one statistic at a time; largest first.

    ``excess`` is (chi2 - n)/sqrt(2 n) of the family's n statistics. How far a fit has moved what is specified or
    measured of the unit (but for the ``widened`` parameters) is a misfit like any other.
    """
    groups = _by_family(problem, problem.observed - point.prediction, point.values - problem.mean, widened)
    out = [
        Family(e, label, along, float((np.square(v).sum() - len(v)) / np.sqrt(2.0 * len(v))), len(v))
        for (e, label, along), v in groups.items()
    ]
    return sorted(out, key=lambda f: -f.excess)


def _by_family(
    problem: Problem, difference: np.ndarray, shift: np.ndarray, widened: Sequence[int]
) -> dict[tuple[str, str, str], np.ndarray]:
    """Differences of the judging recordings' statistics, and of what is specified, in standard deviations by kind."""
    groups: dict[tuple[str, str, str], list[float]] = {}
    judging = problem.judging
    for cell, value in zip(problem.cells, difference / problem.deviations(), strict=True):
        if cell.recording in judging:
            groups.setdefault((cell.equation, cell.label, cell.along), []).append(float(value))
    for m in problem.nuisances:
        p = problem.parameters[m]
        if p.specified and m not in widened:
            label = p.name if p.recordings is None else p.name.rsplit(".", 1)[-1]
            groups.setdefault((p.specified, label, SPECIFICATION), []).append(float(shift[m] / p.sd))
    return {kind: np.array(values) for kind, values in groups.items()}


def left_where_acting(problem: Problem, null: Point, fit: Point, widened: Sequence[int] = ()) -> float:
    """Share of the misfit that a fitted set leaves in the kinds of statistics it acts on, by how much it moves each.

    A cause written in another form leaves a remainder, often elsewhere; a stand-in for a cause that the library lacks
    leaves some of the gap in the very statistics that it takes up. ``widened`` are the set's calibration parameters,
    which the null has too: they count from their specification.
    """
    before = null.prediction
    for m in widened:
        before = before - null.jacobian[:, null.free.index(m)] * (null.values[m] - problem.mean[m])
    moved = _by_family(problem, fit.prediction - before, fit.values - null.values, widened)
    left = _by_family(problem, problem.observed - fit.prediction, fit.values - problem.mean, widened)
    total = shared = 0.0
    for kind, values in moved.items():
        size, power = len(values), float(np.square(values).sum())
        excess = max(float(np.square(left[kind]).sum()) - size - 2.0 * np.sqrt(2.0 * size), 0.0)
        total += power
        shared += power * excess / max(power + excess, 1e-12)
    return float(shared / total) if total > 0.0 else 1.0


def unexplained(problem: Problem, before: Point, after: Point) -> float:
    """Share of a fit's excess that another leaves."""
    return float(np.clip(max(problem.excess(after), 0.0) / max(problem.excess(before), 1.0), 0.0, 1.0))

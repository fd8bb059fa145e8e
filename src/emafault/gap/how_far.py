"""How far the gap shrinks on recordings that took no part in fitting or choosing."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from .gaussian import Point
from .inference import Candidate, Problem
from .twin import Twin

PLACEBOS = 20
ROUNDS = 4  # of a refit on the confirm recordings
NEAR = 0.7  # of what a round began with: where less is left, it has moved so far that derivatives are taken anew


@dataclass(frozen=True)
class Rung:
    """One model on the confirm recordings: root mean square of the whitened residual and where it stands."""

    rms: float
    values: np.ndarray
    residual: np.ndarray  # (statistic,) whitened
    deviations: Mapping[int, float] = field(default_factory=dict)  # of the parameters refitted here, all else known


def own_nuisances(problem: Problem) -> list[int]:
    """Parameters refitted on the confirm recordings: each one's soak temperature and, if seeded, its fault."""
    out = []
    for m in problem.nuisances:
        p = problem.parameters[m]
        if p.recordings is not None and len(p.recordings) == 1 and (p.fault in (None, "dT") or "seeded" in p.name):
            out.append(m)
    return out


def refit(problem: Problem, values: np.ndarray, free: Sequence[int]) -> Rung:
    """Refit only ``free`` on the problem's recordings and return the residual; all else stays as it is."""
    prediction = problem.predict(values)[0]
    deviations: dict[int, float] = {}
    if free:
        for _ in range(ROUNDS):
            jacobian = problem.nuisance_jacobian(values, prediction, free, exact=False)
            start = problem.point(values, prediction, jacobian, free)
            best = problem.descend(start, iterations=2)
            values, prediction = best.values, best.prediction
            deviations = dict(zip(free, np.sqrt(np.diag(best.covariance)).tolist(), strict=True))
            if best.objective > NEAR * start.objective:
                break
    residual = problem.whiten(problem.observed - prediction)
    return Rung(float(np.sqrt(np.mean(residual**2))), values, residual, deviations)


def without_tolerance(explore: Problem, null: Point) -> np.ndarray:
    """The null fit with every parameter that belongs to the unit held at its nominal value."""
    unit = [m for m in explore.nuisances if explore.parameters[m].recordings is None]
    free = [m for m in explore.nuisances if m not in unit]
    values = null.values.copy()
    values[unit] = explore.mean[unit]
    columns = [explore.nuisances.index(m) for m in free]
    prediction = explore.predict(values)[0]
    for _ in range(2):
        moved = explore.solve(values, prediction, null.jacobian[:, columns], free)
        trial = explore.predict(moved)[0]
        old, new = (float(np.square(explore.whiten(explore.observed - q)).sum()) for q in (prediction, trial))
        if new >= old:
            break
        values, prediction = moved, trial
    return values


def placebo(
    explore: Problem, confirm: Problem, null: Point, recalibrated: Rung, free: Sequence[int], count: int
) -> float:
    """Median over random signatures with ``count`` parameters of the confirm residual's root mean square.

    A random signature has one random number per kind of statistic, the same in all recordings, in units of its noise.
    Its amplitude is fitted on the explore recordings, nuisances marginalised, and carried over.
    """
    rng = np.random.default_rng(20)
    kinds = sorted({(c.equation, c.label) for c in (*explore.cells, *confirm.cells)})
    index = {kind: m for m, kind in enumerate(kinds)}
    of_explore = np.array([index[c.equation, c.label] for c in explore.cells])
    of_confirm = np.array([index[c.equation, c.label] for c in confirm.cells])
    residual = explore.whiten(explore.observed - null.prediction)
    out = []
    for _ in range(PLACEBOS):
        drawn = rng.standard_normal((len(kinds), max(count, 1)))
        here = explore.whiten(drawn[of_explore] * explore.deviations()[:, None])
        there = confirm.whiten(drawn[of_confirm] * confirm.deviations()[:, None])
        marginal = explore.projected(null, here)
        amplitude = np.linalg.solve(here.T @ marginal + 1e-9 * np.eye(here.shape[1]), marginal.T @ residual)
        out.append(float(np.sqrt(np.mean((recalibrated.residual - there @ amplitude) ** 2))))
    return float(np.median(out))


def square_error(rms: float, size: int) -> float:
    """Standard error of the mean square of ``size`` residuals of unit noise about what a wrong model leaves.

    Of the non-central chi-square distribution: sqrt((4 rms^2 - 2)/n), or sqrt(2/n) where nothing is left.
    """
    return float(np.sqrt((4.0 * max(rms, 1.0) ** 2 - 2.0) / max(size, 1)))


def closed(recalibrated: float, after: float, floor: float, size: int) -> float | None:
    """Share of the closable gap that is closed; None where the closable gap is below twice its standard error."""
    closable = recalibrated**2 - floor**2
    if closable < 2.0 * square_error(recalibrated, size):
        return None
    return float((recalibrated**2 - after**2) / closable)


@dataclass(frozen=True)
class Ladder:
    """The rungs on the confirm recordings, with the values each model ended at."""

    problem: Problem
    nominal: Rung
    recalibrated: Rung
    placebo: float
    after: Rung
    open: np.ndarray  # (statistic, direction) whitened; see ``left_open``

    def misfit(self, rung: Rung) -> float:
        """Root mean square of a rung's residual beyond what the explored recordings leave open of the unit."""
        r, inner = rung.residual, np.eye(self.open.shape[1]) + self.open.T @ self.open
        along = self.open.T @ r
        return float(np.sqrt(max(r @ r - along @ np.linalg.solve(inner, along), 0.0) / len(r)))

    def signal(self) -> dict:
        """The verdict file's entry; the floor is the noise itself, in whose units the others are.

        A twin whose covariance is cautious says by ``noise_floor`` what root mean square its true model leaves.
        """
        noise = float(getattr(self.problem.twin, "noise_floor", 1.0))
        rungs = {"nominal": self.nominal.rms, "recalibrated": self.recalibrated.rms}
        rungs |= {"placebo": self.placebo, "after": self.after.rms}
        entry: dict[str, float | None] = {name: rms / noise for name, rms in rungs.items()}
        size = len(self.problem.cells)
        share = closed(self.recalibrated.rms / noise, self.after.rms / noise, 1.0, size)
        return entry | {"floor": 1.0, "closed": share}


def left_open(explore: Problem, confirm: Problem, point: Point) -> np.ndarray:
    """(statistic, direction) whitened changes of the confirm recordings by one deviation of the unit's parameters, as
    far as a fit of the explored recordings leaves them open, faults and effects given.

    Where nothing explored has told the inertia, a reversal that confirms contradicts no effect by telling it.
    """
    unit = [m for m in point.free if m in confirm.nuisances and explore.parameters[m].recordings is None]
    if not unit:
        return np.zeros((len(confirm.cells), 0))
    scale = np.sqrt(np.diag(point.covariance))
    own = [point.free.index(m) for m in unit]
    precision = np.linalg.inv(point.covariance / np.outer(scale, scale))[np.ix_(own, own)]
    deviations = np.linalg.cholesky(np.linalg.inv(0.5 * (precision + precision.T)))
    prediction = confirm.predict(point.values)[0]
    jacobian = confirm.nuisance_jacobian(point.values, prediction, unit, exact=False)
    return confirm.whiten(jacobian * scale[own]) @ deviations


def climb(twin: Twin, confirm: Sequence[str], explore: Problem, null: Point, best: Candidate | None) -> Ladder:
    """Open the confirm recordings and put every model on them."""
    problem = Problem(twin, confirm)
    settled = best.point.values if best is not None else null.values
    settle = getattr(twin, "settle", None)
    if settle is not None:
        settle(settled, confirm)
    problem.set_covariance(settled)
    free = own_nuisances(problem)
    # without_tolerance predicts the explore recordings again: their noise has been settled before
    nominal = refit(problem, without_tolerance(explore, null), free)
    recalibrated = refit(problem, null.values, free)
    if best is None:
        return Ladder(problem, nominal, recalibrated, recalibrated.rms, recalibrated, np.zeros((len(problem.cells), 0)))
    count = len(best.point.free) - len(explore.nuisances)
    blind = placebo(explore, problem, null, recalibrated, free, count)
    after = refit(problem, best.point.values, free)
    return Ladder(problem, nominal, recalibrated, blind, after, left_open(explore, problem, best.point))

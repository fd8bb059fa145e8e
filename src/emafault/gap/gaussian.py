"""Gaussian inference on a twin's statistics: covariance, derivatives, points, Laplace evidence, steps between points.

With statistics y, prediction mu(theta), covariance C and Gaussian priors (m, s), a fit minimises
Q = (y - mu)' C^-1 (y - mu) + sum ((theta - m)/s)^2; its log evidence is -Q/2 - log det(I + D J' C^-1 J D)/2 with
D = diag(s), up to a constant that all hypotheses share.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from .twin import Hypothesis, Twin

CLEAR = 2.0  # standard deviations of a twin's own scatter by which two predictions must differ
WIDTHS = (1.0, 0.3, 0.1, 0.03, 0.01)  # of an amplitude's prior
NO_MOVE = 2.0, 0.3  # prior standard deviations of a nuisance and an effect over which derivatives stay as they are


@dataclass(frozen=True)
class Point:
    """A fitted parameter point: values (parameter,), prediction (statistic,), objective and log evidence."""

    values: np.ndarray
    prediction: np.ndarray
    objective: float
    misfit: float  # the data's part of the objective
    log_evidence: float
    free: tuple[int, ...]
    jacobian: np.ndarray  # (statistic, free)
    covariance: np.ndarray  # (free, free)


class Gaussian:
    """Statistics of one part of a bench, whitened, with priors on a twin's parameters."""

    def __init__(self, twin: Twin, part: Sequence[str]):
        self.twin = twin
        self.part = tuple(part)
        self.cells = twin.cells(self.part)
        self.observed = twin.observed(self.part)
        self.parameters = list(twin.parameters)
        self.names = {p.name: m for m, p in enumerate(self.parameters)}
        self.mean = np.array([p.mean for p in self.parameters])
        self.sd = np.array([p.sd for p in self.parameters])
        self.still = self.sd * np.array([NO_MOVE[0] if p.effect is None else NO_MOVE[1] for p in self.parameters])
        self.low = np.array([p.low for p in self.parameters])
        self.high = np.array([p.high for p in self.parameters])
        self.nuisances = [
            m
            for m, p in enumerate(self.parameters)
            if p.effect is None and (p.recordings is None or set(p.recordings) & set(self.part))
        ]
        rows: dict[str, list[int]] = {}
        for m, cell in enumerate(self.cells):
            rows.setdefault(cell.recording, []).append(m)
        self.rows = {name: np.array(r) for name, r in rows.items()}
        #: by recording: its rows, inverse of the covariance's Cholesky factor, standard deviations
        self._blocks: dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]] = {}
        self._taken: list[tuple[np.ndarray, np.ndarray]] = []  # points where nuisance derivatives were taken, and they

    def erratic(self, name: str) -> bool:
        """Whether small changes may change a recording's statistics abruptly, as far as the twin knows."""
        known = getattr(self.twin, "erratic", None)
        return bool(known is not None and known(name))

    @property
    def judging(self) -> list[str]:
        """Recordings that a fit is judged by: how exactly an actuator hunts about its target proves nothing where
        others are there."""
        return [name for name in self.part if not self.erratic(name)] or list(self.part)

    def excess(self, point: "Point") -> float:
        """What a fit's objective is above its expectation, of the judging recordings.

        With the priors' part, in which the gap of a parameter far outside its tolerance stands.
        """
        residual = self.whiten(self.observed - point.prediction)
        rows = np.concatenate([self.rows[name] for name in self.judging if name in self.rows])
        return float(np.square(residual[rows]).sum() + point.objective - point.misfit - len(rows))

    # ---- whitening
    def set_covariance(self, values: np.ndarray, shy: bool = False) -> None:
        """Take the statistics' covariance at a parameter point; ``shy`` all but ignores erratic recordings."""
        cov = self.twin.covariance(values, self.part)
        for name, rows in self.rows.items():
            block = cov[np.ix_(rows, rows)]
            scale = np.sqrt(np.diag(block))
            correlation = block / np.outer(scale, scale)
            # a correlation known from finitely many numbers is never trusted to the last digit
            correlation = 0.98 * correlation + 0.02 * np.eye(len(rows))
            if shy and self.erratic(name):
                scale = 30.0 * scale
            factor = np.linalg.cholesky(correlation)
            inverse = solve_triangular(factor, np.diag(1.0 / scale), lower=True, check_finite=False)
            self._blocks[name] = rows, inverse, scale

    def temper(self, prediction: np.ndarray) -> None:
        """Let an erratic recording count no more per statistic than the others do at this prediction.

        Far from the truth it differs by anything at all, and leads a fit astray.
        """
        residual = self.whiten(self.observed - prediction)
        misfit = {name: float(np.mean(np.square(residual[rows]))) for name, rows in self.rows.items()}
        calm = [m for name, m in misfit.items() if not self.erratic(name)]
        most = max(1.0, float(np.mean(calm))) if calm else np.inf
        for name, (rows, inverse, scale) in self._blocks.items():
            if self.erratic(name) and misfit[name] > most:
                wider = np.sqrt(misfit[name] / most)
                self._blocks[name] = rows, inverse / wider, scale * wider

    def whiten(self, x: np.ndarray) -> np.ndarray:
        """C^-1/2 x for (statistic,) or (statistic, column)."""
        out = np.empty_like(x, dtype=float)
        for rows, inverse, _ in self._blocks.values():
            out[rows] = inverse @ x[rows]
        return out

    def deviations(self) -> np.ndarray:
        """(statistic,) standard deviations."""
        out = np.empty(len(self.cells))
        for rows, _, scale in self._blocks.values():
            out[rows] = scale
        return out

    # ---- derivatives
    def predict(self, points: np.ndarray) -> np.ndarray:
        """(point, parameter) -> (point, statistic)."""
        return self.twin.predict(np.atleast_2d(points), self.part)

    def seen(self, difference: np.ndarray) -> np.ndarray:
        """(..., statistic) differences of two predictions, zero where they are no larger than the twin's own scatter.

        Derivatives made of scatter would feign information, as many times as there are statistics.
        """
        difference = np.where(np.isfinite(difference), difference, 0.0)  # of a run that could not be simulated
        scatter = getattr(self.twin, "scatter", None)
        if scatter is None:
            return difference
        return np.where(np.abs(difference) > CLEAR * np.sqrt(2.0 * scatter(self.part)), difference, 0.0)

    @property
    def scatters(self) -> bool:
        """Whether the twin's predictions scatter and it can average them."""
        return hasattr(self.twin, "smooth")

    def nuisance_jacobian(
        self, values: np.ndarray, prediction: np.ndarray, free: Sequence[int], exact: bool = True
    ) -> np.ndarray:
        """(statistic, free) forward differences; parameters of disjoint recordings are moved together.

        A twin may know some derivatives exactly from others: ``derived`` names them and
        ``derive(name, values, derivative, recording)`` gives the rows of one recording from a function that returns
        those of another parameter. What cancels exactly in truth then cancels here too, where noisy differences would
        feign information. ``exact`` False leaves this out, for a few parameters that nothing else can cancel.
        """
        derived = set(getattr(self.twin, "derived", ())) if exact else set()
        known = [m for m in free if self.parameters[m].name in derived]
        asked = list(free)
        if known:
            asked = [m for m in self.nuisances if self.parameters[m].name not in derived]
        batches: list[list[int]] = []
        for m in asked:
            own = set(self.parameters[m].recordings or self.part)
            for batch in batches:
                if all(own.isdisjoint(self.parameters[o].recordings or self.part) for o in batch):
                    batch.append(m)
                    break
            else:
                batches.append([m])
        points, steps = [], {}
        for batch in batches:
            point = values.copy()
            for m in batch:
                step = self.parameters[m].step
                if point[m] + step > self.high[m]:
                    step = -step
                point[m] += step
                steps[m] = step
            points.append(point)
        differences = self.seen(self.predict(np.array(points)) - prediction)
        out = np.zeros((len(self.cells), len(asked)))
        column = {m: c for c, m in enumerate(asked)}
        for batch, difference in zip(batches, differences, strict=True):
            for m in batch:
                recordings = self.parameters[m].recordings
                for name in self.part if recordings is None else recordings:
                    if name in self.rows:
                        rows = self.rows[name]
                        out[rows, column[m]] = difference[rows] / steps[m]
        if not known:
            return out
        whole = {self.parameters[m].name: out[:, column[m]] for m in asked}
        # the later of the derived ones may need the earlier
        for name in self.twin.derived:  # type: ignore[attr-defined]
            m = self.names[name]
            rows_of = self.parameters[m].recordings or self.part
            values_of = np.zeros(len(self.cells))
            for recording in rows_of:
                if recording in self.rows:
                    rows = self.rows[recording]
                    values_of[rows] = self.twin.derive(  # type: ignore[attr-defined]
                        name, values, lambda other, rows=rows: whole[other][rows], recording
                    )
            whole[name] = values_of
        return np.stack([whole[self.parameters[m].name] for m in free], axis=1)

    def derivatives(self, values: np.ndarray, prediction: np.ndarray) -> np.ndarray:
        """(statistic, nuisance) derivatives at a point; those of a point hardly apart serve again."""
        for known, jacobian in reversed(self._taken):
            if np.max(np.abs(values - known) / self.still) < 1.0:
                return jacobian
        jacobian = self.nuisance_jacobian(values, prediction, self.nuisances)
        self._taken.append((values.copy(), jacobian))
        return jacobian

    # ---- points and steps
    def prior(self, free: Sequence[int], widened: Sequence[int] = ()) -> tuple[np.ndarray, np.ndarray]:
        """Means and standard deviations of the free parameters; widened ones spread over their bounds."""
        mean, sd = self.mean[list(free)].copy(), self.sd[list(free)].copy()
        for c, m in enumerate(free):
            if m in widened:
                sd[c] = (self.high[m] - self.low[m]) / np.sqrt(12.0)
        return mean, sd

    def solve(
        self,
        values: np.ndarray,
        prediction: np.ndarray,
        jacobian: np.ndarray,
        free: Sequence[int],
        widened: Sequence[int] = (),
    ) -> np.ndarray:
        """One Gauss-Newton step within the bounds; ``jacobian`` (statistic, free). Returns new values."""
        free = list(free)
        jacobian = self.whiten(jacobian)
        residual = self.whiten(self.observed - prediction)
        mean, sd = self.prior(free, widened)
        at = values[free]
        held = np.zeros(len(free), bool)
        target = at.copy()
        for _ in range(6):
            open_ = ~held
            shift = np.where(held, target - at, 0.0)
            r = residual - jacobian @ shift
            J = jacobian[:, open_]
            H = J.T @ J + np.diag(1.0 / sd[open_] ** 2)
            g = J.T @ r + (mean[open_] - at[open_]) / sd[open_] ** 2
            target = at + shift
            scale = 1.0 / np.sqrt(np.diag(H))
            target[open_] = at[open_] + scale * np.linalg.solve(H * np.outer(scale, scale), scale * g)
            low, high = self.low[free], self.high[free]
            outside = open_ & ((target < low) | (target > high))
            if not outside.any():
                break
            target = np.clip(target, low, high)
            held |= outside
        out = values.copy()
        out[free] = np.clip(target, self.low[free], self.high[free])
        return out

    def point(
        self,
        values: np.ndarray,
        prediction: np.ndarray,
        jacobian: np.ndarray,
        free: Sequence[int],
        widened: Sequence[int] = (),
    ) -> Point:
        """Objective and Laplace evidence of a parameter point."""
        free = list(free)
        mean, sd = self.prior(free, widened)
        residual = self.whiten(self.observed - prediction)
        misfit = float(residual @ residual)
        objective = misfit + float((((values[free] - mean) / sd) ** 2).sum())
        if not np.isfinite(objective):
            objective = np.inf
        whitened = self.whiten(jacobian)
        inner = whitened.T @ whitened
        information = np.eye(len(free)) + np.outer(sd, sd) * inner
        covariance = np.outer(sd, sd) * np.linalg.inv(information)
        evidence = self._evidence(misfit, (values[free] - mean) / sd, np.outer(sd, sd) * inner, free)
        return Point(values, prediction, objective, misfit, evidence, tuple(free), jacobian, covariance)

    def _evidence(self, misfit: float, shift: np.ndarray, information: np.ndarray, free: Sequence[int]) -> float:
        """Laplace evidence; ``shift`` (free,) and ``information`` (free, free) in units of the priors.

        The amplitude of an effect is as likely in one decade as in the next: its prior is a mixture of Gaussians of
        decreasing width, of which the best stands for all.
        """
        width = np.ones(len(free))

        def of(width: np.ndarray) -> float:
            inner = np.eye(len(free)) + information * np.outer(width, width)
            return -0.5 * (misfit + float(np.square(shift / width).sum())) - 0.5 * float(np.linalg.slogdet(inner)[1])

        owners = [self.parameters[m].effect if self.parameters[m].amplitude else None for m in free]
        for effect in sorted({o for o in owners if o is not None}):
            own = np.array([o == effect for o in owners])
            width = max((np.where(own, factor, width) for factor in WIDTHS), key=of)
        return of(width) - len({o for o in owners if o is not None}) * float(np.log(len(WIDTHS)))

    def descend(
        self,
        best: Point,
        widened: Sequence[int] = (),
        iterations: int = 4,
        predict: Callable[[np.ndarray], np.ndarray] | None = None,
    ) -> Point:
        """Gauss-Newton steps with the point's own derivatives, halved where they overshoot, until they gain nothing."""
        predict = predict or (lambda values: self.predict(values)[0])
        for _ in range(iterations):
            moved = self.solve(best.values, best.prediction, best.jacobian, best.free, widened)
            enough = max(0.1, 1e-3 * best.objective)
            if self.promised(best, moved, widened) < enough:
                break
            trial = self.point(moved, predict(moved), best.jacobian, best.free, widened)
            if trial.objective > best.objective:
                for part in (0.4, 0.12):
                    nearer = best.values + part * (moved - best.values)
                    trial = self.point(nearer, predict(nearer), best.jacobian, best.free, widened)
                    if trial.objective < best.objective:
                        break
                else:
                    break
            done = trial.objective > best.objective - enough
            best = trial
            if done:
                break
        return best

    def promised(self, point: Point, values: np.ndarray, widened: Sequence[int] = ()) -> float:
        """What a point's objective would fall by at other values, were its prediction linear."""
        free = list(point.free)
        mean, sd = self.prior(free, widened)
        residual = self.whiten(self.observed - point.prediction - point.jacobian @ (values - point.values)[free])
        return point.objective - float(residual @ residual + (((values[free] - mean) / sd) ** 2).sum())

    # ---- sets
    def effect_parameters(self, hypothesis: Hypothesis) -> list[int]:
        """Indices of the hypothesis' parameters."""
        return [self.names[n] for n in hypothesis.parameters]

    def freed(self, chosen: Sequence[Hypothesis]) -> tuple[list[int], list[int]]:
        """What a set frees: parameters of its own, and nuisances whose prior it widens."""
        own = [m for h in chosen for m in self.effect_parameters(h) if h.kind != "calibration"]
        widened = [m for h in chosen for m in self.effect_parameters(h) if h.kind == "calibration"]
        return own, widened

    def projected(self, null: Point, columns: np.ndarray) -> np.ndarray:
        """(I + J S J')^-1 x for whitened columns x: what of them the nuisances cannot take up."""
        _, sd = self.prior(self.nuisances)
        J = self.whiten(null.jacobian) * sd
        inner = np.eye(J.shape[1]) + J.T @ J
        return columns - J @ np.linalg.solve(inner, J.T @ columns)

    def squared_distance(self, null: Point, difference: np.ndarray) -> float:
        """d' (C + J S J')^-1 d of a whitened difference of predictions."""
        return float(difference @ self.projected(null, difference[:, None])[:, 0])

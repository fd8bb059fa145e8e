"""Gaussian inference on a twin's statistics: maximum a posteriori fits, Laplace evidence, signatures.

With statistics y, prediction mu(theta), covariance C and Gaussian priors (m, s), a fit minimises
Q = (y - mu)' C^-1 (y - mu) + sum ((theta - m)/s)^2; its log evidence is -Q/2 - log det(I + D J' C^-1 J D)/2 with
D = diag(s), up to a constant that all hypotheses share.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.linalg import solve_triangular

from .twin import Hypothesis, Twin

#: objective per statistic below which a null fit is worth more rounds: it may yet be no gap at all
NEAR = 20.0
SETTLED = 1.0  # prior standard deviations that a fit within the noise may still move for its derivatives to be kept
CLEAR = 2.0  # standard deviations of a twin's own scatter by which two predictions must differ
FAR = 2.0  # prior standard deviations that a round may move before noise, covariance and derivatives are taken anew
RENEWED = 4  # rounds in which noise and covariance may be
WIDTHS = (1.0, 0.3, 0.1, 0.03, 0.01)  # of an amplitude's prior
NO_MOVE = 2.0, 0.3  # prior standard deviations of a nuisance and an effect over which derivatives stay as they are
AVERAGED_STEPS = 2  # of a fit on averaged predictions, which cost several times as much
PULLED = 3.0  # standard deviations of its specification from which a fit is tried once more without the pull
LEASH = 2.0  # standard deviations that a unit's parameters may move in the first round of a null fit


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


@dataclass(frozen=True)
class Candidate:
    """A set of effects with its fit; ``gain`` is its log evidence above the empty set's."""

    effects: tuple[str, ...]
    point: Point
    gain: float
    refined: bool
    start: np.ndarray
    signature: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))  # (statistic, parameter)
    polished: bool = False


class Problem:
    """The recordings of one part of a bench as a Gaussian inference problem on a twin."""

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
        self._blocks: list[tuple[np.ndarray, np.ndarray]] = []
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
        self._blocks = []
        for name, rows in self.rows.items():
            block = cov[np.ix_(rows, rows)]
            scale = np.sqrt(np.diag(block))
            correlation = block / np.outer(scale, scale)
            # a correlation known from finitely many numbers is never trusted to the last digit
            correlation = 0.98 * correlation + 0.02 * np.eye(len(rows))
            if shy and self.erratic(name):
                scale = 30.0 * scale
            self._blocks.append((rows, scale[:, None] * np.linalg.cholesky(correlation)))

    def whiten(self, x: np.ndarray) -> np.ndarray:
        """C^-1/2 x for (statistic,) or (statistic, column)."""
        out = np.empty_like(x, dtype=float)
        for rows, factor in self._blocks:
            out[rows] = solve_triangular(factor, x[rows], lower=True, check_finite=False)
        return out

    def deviations(self) -> np.ndarray:
        """(statistic,) standard deviations."""
        out = np.empty(len(self.cells))
        for rows, factor in self._blocks:
            out[rows] = np.sqrt((factor**2).sum(1))
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

    def averaged(self, point: Point, chosen: Sequence[Hypothesis] = ()) -> Point:
        """The fit with predictions averaged over the twin's own scatter, taken further where that shows the way."""
        _, widened = self.freed(chosen)
        start = self.point(point.values, self._smooth(point.values), point.jacobian, point.free, widened)
        return self.descend(start, widened, AVERAGED_STEPS, self._smooth)

    def _smooth(self, values: np.ndarray) -> np.ndarray:
        return self.twin.smooth(values, self.part)  # type: ignore[attr-defined]

    def nuisance_jacobian(
        self, values: np.ndarray, prediction: np.ndarray, free: Sequence[int], exact: bool = True
    ) -> np.ndarray:
        """(statistic, free) forward differences; parameters of disjoint recordings are moved together.

        A twin may know some derivatives exactly from others: ``derived`` names them and ``derive(name, values,
        derivative,
        recording)`` gives the rows of one recording from a function that returns those of another parameter. What
        cancels exactly in truth then cancels here too, where noisy differences would feign information. ``exact`` False
        leaves this out, for a few parameters that nothing else can cancel.
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

    # ---- fits
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

    def unpulled(self, best: Point, widened: Sequence[int] = ()) -> Point:
        """The fit, or a better one begun where what lies far from its specification is back at it.

        What the data hardly tell may have been carried off on the way and not find back by derivatives made of scatter.
        """
        specified = [m for m in self.nuisances if self.parameters[m].specified and m not in widened]
        far = [m for m in specified if abs(best.values[m] - self.mean[m]) > PULLED * self.sd[m]]
        if not far:
            return best
        values = best.values.copy()
        values[far] = self.mean[far]
        back = self.resumed(best, values, widened)
        return back if back.objective < best.objective else best

    def fit_null(self, rounds: int = 7) -> Point:
        """Fit of the nuisances alone; calls the twin's ``settle`` (noise, start angle) where it has one."""
        values = np.array([p.off if p.effect else p.mean for p in self.parameters])
        settle = getattr(self.twin, "settle", None)
        best, before, far, shift = None, np.inf, False, np.inf
        jacobian = np.zeros((0, 0))
        bounds = self.low.copy(), self.high.copy()
        unit = [m for m in self.nuisances if self.parameters[m].recordings is None]
        # where the start is far off, only the smooth recordings lead the right way
        shy = 2 if any(map(self.erratic, self.part)) and not all(map(self.erratic, self.part)) else 0
        first = max(1, shy)  # round with all recordings in which the fit may end
        for round_ in range(rounds):
            # the first steps are long: what belongs to the unit stays near its specification until they are done
            self.low, self.high = bounds[0].copy(), bounds[1].copy()
            if round_ == 0:
                self.low[unit] = np.maximum(self.low[unit], self.mean[unit] - LEASH * self.sd[unit])
                self.high[unit] = np.minimum(self.high[unit], self.mean[unit] + LEASH * self.sd[unit])
            if round_ <= first or far:
                if settle is not None:
                    settle(values, self.part)
                self.set_covariance(values, shy=round_ < shy)
            prediction = self.predict(values)[0]
            # derivatives of the first round serve until the fit may end, unless it has moved far from them
            if not 0 < round_ <= first or shift > FAR:
                jacobian = self.derivatives(values, prediction)
            best = self.descend(self.point(values, prediction, jacobian, self.nuisances))
            shift = float((np.abs(best.values - values) / self.sd)[self.nuisances].max())
            values, far = best.values, shift > FAR and round_ + 1 < RENEWED
            if round_ < first or far:
                continue
            if round_ == first and best.objective < len(self.cells) and shift < SETTLED:
                break
            least = 0.99 if 1.3 * len(self.cells) < best.objective < NEAR * len(self.cells) else 0.85
            if round_ > first and (shift < 0.05 or best.objective > least * before):
                break
            before = best.objective
        assert best is not None
        return self.unpulled(best)

    def refit_null(self, start: Point) -> Point:
        """The null fitted from where a candidate's nuisances ended, so that both had the same chance."""
        values = start.values.copy()
        for m, p in enumerate(self.parameters):
            if p.effect is not None:
                values[m] = p.off
        prediction = self.predict(values)[0]
        jacobian = self.derivatives(values, prediction)
        return self.descend(self.point(values, prediction, jacobian, self.nuisances))

    def resumed(self, fit: Point, values: np.ndarray, widened: Sequence[int]) -> Point:
        """A fit once more, from other values and with the derivatives that it has."""
        return self.descend(self.point(values, self.predict(values)[0], fit.jacobian, fit.free, widened), widened)

    def rebase(self, null: Point, candidate: Candidate) -> Point:
        """Take noise, covariance and nuisance derivatives at a candidate's fit; returns the null refitted under them.

        Where an effect is strong, what was taken at the null fit is wrong by more than the noise.
        """
        settle = getattr(self.twin, "settle", None)
        if settle is not None:
            settle(candidate.point.values, self.part)
        self.set_covariance(candidate.point.values)
        values = candidate.point.values
        prediction = self.predict(values)[0]
        base = self.derivatives(values, prediction)
        best = self.point(null.values, self.predict(null.values)[0], null.jacobian, self.nuisances)
        moved = self.solve(best.values, best.prediction, null.jacobian, self.nuisances)
        trial = self.point(moved, self.predict(moved)[0], null.jacobian, self.nuisances)
        best = trial if trial.objective < best.objective else best
        return replace(best, jacobian=base)

    # ---- effects
    def effect_parameters(self, hypothesis: Hypothesis) -> list[int]:
        """Indices of the hypothesis' parameters."""
        return [self.names[n] for n in hypothesis.parameters]

    def freed(self, chosen: Sequence[Hypothesis]) -> tuple[list[int], list[int]]:
        """What a set frees: parameters of its own, and nuisances whose prior it widens."""
        own = [m for h in chosen for m in self.effect_parameters(h) if h.kind != "calibration"]
        widened = [m for h in chosen for m in self.effect_parameters(h) if h.kind == "calibration"]
        return own, widened

    def screen(self, null: Point, hypotheses: Sequence[Hypothesis]) -> list[Candidate]:
        """Linearised fit of every hypothesis at every start, from signatures simulated at the null fit."""
        points: list[np.ndarray] = []
        plan = []
        for h in hypotheses:
            own = self.effect_parameters(h)
            for start in h.starts:
                full = null.values.copy()
                full[own] = start
                first: int | None = None
                if not h.additive:
                    first = len(points)
                    points.append(full)
                partial = []
                for c, m in enumerate(own):
                    if start[c] == self.parameters[m].off or (len(own) == 1 and not h.additive):
                        continue
                    other = (null.values if h.additive else full).copy()
                    other[m] = start[c] if h.additive else self.parameters[m].off
                    partial.append((c, len(points)))
                    points.append(other)
                plan.append((h, own, np.array(start), first, partial))
        predictions = self.predict(np.array(points)) if points else np.zeros((0, len(self.cells)))
        out = []
        for h in hypotheses:
            if h.kind == "calibration":
                own = self.effect_parameters(h)
                free = list(self.nuisances)
                values = self.solve(null.values, null.prediction, null.jacobian, free, own)
                moved = null.prediction + null.jacobian @ (values - null.values)[free]
                fitted = self.point(values, moved, null.jacobian, free, own)
                gain = fitted.log_evidence - null.log_evidence
                columns = null.jacobian[:, [free.index(m) for m in own]]
                out.append(Candidate((h.effect,), fitted, gain, False, null.values, columns))
        for h, own, begin_at, first, partial in plan:
            columns = np.zeros((len(self.cells), len(own)))
            off = np.array([self.parameters[m].off for m in own])
            if first is None:
                for c, at in partial:
                    columns[:, c] = self.seen(predictions[at] - null.prediction) / (begin_at[c] - off[c])
                out.append(self.linear(null, (h,), null.values, null.prediction, columns))
                continue
            full = predictions[first]
            if len(own) == 1:
                columns[:, 0] = self.seen(full - null.prediction) / (begin_at[0] - off[0])
            for c, at in partial:
                columns[:, c] = self.seen(full - predictions[at]) / (begin_at[c] - off[c])
            begin = null.values.copy()
            begin[own] = begin_at
            if len(own) == 1:  # from where it is off, or the start's own scatter would count as misfit
                line = self.linear(null, (h,), null.values, null.prediction, columns)
                out.append(replace(line, start=begin))
            else:
                out.append(self.linear(null, (h,), begin, full, columns))
        return out

    def linear(
        self, null: Point, hypotheses: Sequence[Hypothesis], begin: np.ndarray, prediction: np.ndarray, signature
    ) -> Candidate:
        """Fit of nuisances and effects linearised about ``begin``; the null's nuisance derivatives are kept."""
        own, widened = self.freed(hypotheses)
        free = [*self.nuisances, *own]
        jacobian = np.concatenate([null.jacobian, signature], axis=1)
        values = self.solve(begin, prediction, jacobian, free, widened)
        moved = prediction + jacobian @ (values - begin)[free]
        fitted = self.point(values, moved, jacobian, free, widened)
        effects = tuple(h.effect for h in hypotheses)
        return Candidate(effects, fitted, fitted.log_evidence - null.log_evidence, False, begin, signature)

    def refine(
        self, null: Point, candidate: Candidate, hypotheses: dict[str, Hypothesis], rounds: int = 2, renew: bool = True
    ) -> Candidate:
        """Refit a candidate with the simulator: true prediction, effect derivatives renewed on the way."""
        chosen = [hypotheses[e] for e in candidate.effects]
        own, widened = self.freed(chosen)
        free = [*self.nuisances, *own]
        jacobian = candidate.point.jacobian.copy()
        jacobian[:, : len(self.nuisances)] = null.jacobian
        both = (candidate.point.values, candidate.start)
        starts = [self.point(v, self.predict(v)[0], jacobian, free, widened) for v in both]
        best = min(starts, key=lambda point: point.objective)
        for round_ in range(rounds):
            if own and renew and round_ in (0, 2):
                jacobian = jacobian.copy()
                jacobian[:, len(self.nuisances) :] = self._effect_columns(best, own)
                best = self.point(best.values, best.prediction, jacobian, free, widened)
            moved = self.solve(best.values, best.prediction, jacobian, free, widened)
            trial = self.point(moved, self.predict(moved)[0], jacobian, free, widened)
            if trial.objective > best.objective:
                halfway = 0.5 * (best.values + moved)
                trial = self.point(halfway, self.predict(halfway)[0], jacobian, free, widened)
            done = trial.objective > best.objective - 0.2
            if trial.objective < best.objective:
                best = trial
            if done:
                break
        signature = jacobian[:, len(self.nuisances) :] if own else candidate.signature
        return replace(
            candidate, point=best, gain=best.log_evidence - null.log_evidence, refined=True, signature=signature
        )

    def polish(self, null: Point, candidate: Candidate, hypotheses: dict[str, Hypothesis]) -> Candidate:
        """The candidate fitted to the end, all derivatives taken at its own fit; what is reported comes from here."""
        if candidate.polished:
            return candidate
        chosen = [hypotheses[e] for e in candidate.effects]
        own, widened = self.freed(chosen)
        point = candidate.point
        base = self.derivatives(point.values, point.prediction)
        columns = self._effect_columns(point, own)
        jacobian = np.concatenate([base, columns], axis=1)
        start = self.point(point.values, point.prediction, jacobian, point.free, widened)
        best = self.unpulled(self.descend(start, widened), widened)
        gain = best.log_evidence - null.log_evidence
        return replace(candidate, point=best, gain=gain, signature=columns, polished=True)

    def _effect_columns(self, at: Point, own: Sequence[int]) -> np.ndarray:
        """(statistic, own) differences by the parameters of effects, simulated at a fit."""
        if not own:
            return np.zeros((len(self.cells), 0))
        steps, points = [], []
        for m in own:
            step = self.parameters[m].step
            if at.values[m] + step > self.high[m]:
                step = -step
            point = at.values.copy()
            point[m] += step
            steps.append(step)
            points.append(point)
        return self.seen(self.predict(np.array(points)) - at.prediction).T / np.array(steps)

    def projected(self, null: Point, columns: np.ndarray) -> np.ndarray:
        """(I + J S J')^-1 x for whitened columns x: what of them the nuisances cannot take up."""
        _, sd = self.prior(self.nuisances)
        J = self.whiten(null.jacobian) * sd
        inner = np.eye(J.shape[1]) + J.T @ J
        return columns - J @ np.linalg.solve(inner, J.T @ columns)

    def squared_distance(self, null: Point, difference: np.ndarray) -> float:
        """d' (C + J S J')^-1 d of a whitened difference of predictions."""
        return float(difference @ self.projected(null, difference[:, None])[:, 0])

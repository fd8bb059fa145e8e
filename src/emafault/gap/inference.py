"""Fits of the empty set and of candidate sets to a part of a bench; the arithmetic is that of ``gaussian``."""

from collections.abc import Generator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from .gaussian import Gaussian, Point
from .twin import Hypothesis

#: objective per statistic below which a null fit is worth more rounds: it may yet be no gap at all
NEAR = 20.0
SETTLED = 1.0  # prior standard deviations that a fit within the noise may still move for its derivatives to be kept
FAR = 2.0  # prior standard deviations that a round may move before noise, covariance and derivatives are taken anew
RENEWED = 4  # rounds in which noise and covariance may be
AVERAGED_STEPS = 2  # of a fit on averaged predictions, which cost several times as much
PULLED = 3.0  # standard deviations of its specification from which a fit is tried once more without the pull
LEASH = 2.0  # standard deviations that a unit's parameters may move in the first round of a null fit


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


class Problem(Gaussian):
    """The recordings of one part of a bench as an inference problem on a twin: what is fitted to them, and how."""

    # ---- the empty set
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
            renewed = round_ <= first or far
            if renewed:
                if settle is not None:
                    settle(values, self.part)
                self.set_covariance(values, shy=round_ < shy)
            prediction = self.predict(values)[0]
            if renewed and round_ >= shy:
                self.temper(prediction)
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
        self.temper(prediction)
        base = self.derivatives(values, prediction)
        best = self.point(null.values, self.predict(null.values)[0], null.jacobian, self.nuisances)
        moved = self.solve(best.values, best.prediction, null.jacobian, self.nuisances)
        trial = self.point(moved, self.predict(moved)[0], null.jacobian, self.nuisances)
        best = trial if trial.objective < best.objective else best
        return replace(best, jacobian=base)

    def averaged(self, point: Point, chosen: Sequence[Hypothesis] = ()) -> Point:
        """The fit with predictions averaged over the twin's own scatter, taken further where that shows the way."""
        _, widened = self.freed(chosen)
        start = self.point(point.values, self._smooth(point.values), point.jacobian, point.free, widened)
        return self.descend(start, widened, AVERAGED_STEPS, self._smooth)

    def averaged_from(self, null: Point, point: Point, chosen: Sequence[Hypothesis]) -> Point:
        """A set's fit on averaged predictions begun where that of the null ended, its amplitudes at zero.

        The set contains the null: a fit that ended above it has stopped on its way.
        """
        own, widened = self.freed(chosen)
        values = null.values.copy()
        for m in own:
            values[m] = self.parameters[m].off if self.parameters[m].amplitude else point.values[m]
        start = self.point(values, null.prediction, point.jacobian, point.free, widened)
        return self.descend(start, widened, AVERAGED_STEPS, self._smooth)

    def _smooth(self, values: np.ndarray) -> np.ndarray:
        return self.twin.smooth(values, self.part)  # type: ignore[attr-defined]

    # ---- effects
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
        self, null: Point, candidate: Candidate, hypotheses: dict[str, Hypothesis], rounds: int = 2
    ) -> Candidate:
        """Refit a candidate with the simulator: true prediction, effect derivatives renewed on the way."""
        return self.refine_all(null, [(candidate, rounds)], hypotheses)[0]

    def refine_all(
        self,
        null: Point,
        candidates: Sequence[tuple[Candidate, int]],
        hypotheses: dict[str, Hypothesis],
    ) -> list[Candidate]:
        """Refit candidates, each in so many rounds; what each asks for next is simulated side by side."""
        refits = [self._refit(null, candidate, hypotheses, rounds) for candidate, rounds in candidates]
        asked = {n: next(refit) for n, refit in enumerate(refits)}
        done: dict[int, Candidate] = {}
        while asked:
            predictions = self.predict(np.concatenate(list(asked.values())))
            ends = np.cumsum([len(points) for points in asked.values()])
            answers = zip(list(asked), np.split(predictions, ends[:-1]), strict=True)
            for n, answer in answers:
                try:
                    asked[n] = refits[n].send(answer)
                except StopIteration as end:
                    del asked[n]
                    done[n] = end.value
        return [done[n] for n in range(len(refits))]

    def _refit(
        self, null: Point, candidate: Candidate, hypotheses: dict[str, Hypothesis], rounds: int
    ) -> Generator[np.ndarray, np.ndarray, Candidate]:
        """The refit of one candidate: yields (point, parameter), is sent their predictions (point, statistic)."""
        chosen = [hypotheses[e] for e in candidate.effects]
        own, widened = self.freed(chosen)
        free = [*self.nuisances, *own]
        jacobian = candidate.point.jacobian.copy()
        jacobian[:, : len(self.nuisances)] = null.jacobian
        both = np.array([candidate.point.values, candidate.start])
        predictions = yield both
        starts = [self.point(v, y, jacobian, free, widened) for v, y in zip(both, predictions, strict=True)]
        best = min(starts, key=lambda point: point.objective)
        for round_ in range(rounds):
            if own and round_ in (0, 2):
                points, steps = self._effect_steps(best, own)
                predictions = yield points
                jacobian = jacobian.copy()
                jacobian[:, len(self.nuisances) :] = self.seen(predictions - best.prediction).T / steps
                best = self.point(best.values, best.prediction, jacobian, free, widened)
            moved = self.solve(best.values, best.prediction, jacobian, free, widened)
            predictions = yield moved[None]
            trial = self.point(moved, predictions[0], jacobian, free, widened)
            if trial.objective > best.objective:
                halfway = 0.5 * (best.values + moved)
                predictions = yield halfway[None]
                trial = self.point(halfway, predictions[0], jacobian, free, widened)
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
        columns = self._together(point.values, base, self._effect_columns(point, own), chosen)
        jacobian = np.concatenate([base, columns], axis=1)
        start = self.point(point.values, point.prediction, jacobian, point.free, widened)
        best = self.unpulled(self.descend(start, widened), widened)
        gain = best.log_evidence - null.log_evidence
        return replace(candidate, point=best, gain=gain, signature=columns, polished=True)

    def _together(
        self, values: np.ndarray, base: np.ndarray, columns: np.ndarray, chosen: Sequence[Hypothesis]
    ) -> np.ndarray:
        """Columns (statistic, own) of one structural effect, with what the twin knows exactly of them put right.

        A change of all phases alike may be a change of nuisances: in noisy differences it would feign to be told apart.
        """
        weights_of = getattr(self.twin, "weights_together", None)
        structural = [h for h in chosen if h.kind != "calibration"]
        if weights_of is None or len(structural) != 1:
            return columns
        effect = structural[0].effect
        weights = weights_of(effect, values[self.effect_parameters(structural[0])])
        if weights is None:
            return columns
        at = {self.parameters[m].name: c for c, m in enumerate(self.nuisances)}
        exact = np.zeros(len(self.cells))
        for name, rows in self.rows.items():
            exact[rows] = self.twin.derive_together(  # type: ignore[attr-defined]
                effect, values, lambda other, rows=rows: base[rows, at[other]], name
            )
        return columns + np.outer(exact - columns @ weights, weights) / float(weights @ weights)

    def _effect_columns(self, at: Point, own: Sequence[int]) -> np.ndarray:
        """(statistic, own) differences by the parameters of effects, simulated at a fit."""
        if not own:
            return np.zeros((len(self.cells), 0))
        points, steps = self._effect_steps(at, own)
        return self.seen(self.predict(points) - at.prediction).T / steps

    def _effect_steps(self, at: Point, own: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
        """Points (own, parameter) a step from a fit by each parameter of effects, and the steps (own,)."""
        points = np.tile(at.values, (len(own), 1))
        steps = np.array([self.parameters[m].step for m in own])
        steps[at.values[list(own)] + steps > self.high[list(own)]] *= -1.0
        points[np.arange(len(own)), list(own)] += steps
        return points, steps

"""The fit of a measured machine: its noise as stated, remainders of every kind, rivals at their own optimum."""

from dataclasses import replace

import numpy as np

from ..diagnosis.evidence import Reduced
from ..diagnosis.fit import NOTHING, Bench, Fit
from ..diagnosis.model import Unit, Variant
from ..diagnosis.search import Search
from ..diagnosis.sets import Candidate, Model
from .adapter import SMOOTH, WAVES

SIZES = (0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0)  # of a remainder over the noise of a row
SETTLED, SETTLING = 1e-3, 10  # log evidence that one more step of a set may still promise, and most steps
ROUNDS, FINALISTS = 3, 6  # sets that are taken to their own optimum, and how often
NEAR, CLOSE = 12.0, 0.5  # log posterior within which a set is one of them, and by which it must be better
CARRYING = 5  # effects that carry their own form
UNSEEN = 1.0  # information over that of the prior, below which rows say nothing of an effect


class MeasuredSearch(Search):
    """Sets of up to five effects: constants of instruments have no tolerance that others would take."""

    size_prior = (0.40, 0.30, 0.15, 0.08, 0.05, 0.02)

    def fit(self, members, widths=None):
        """See ``Search``; an effect of which the rows say nothing pays nothing for the choice of its width."""
        known = tuple(sorted(members)) in self.seen
        model = super().fit(members, widths)
        if not known:
            unpaid = sum(self._unpaid(self.candidates[m]) for m in members)
            model.log_posterior += unpaid
            model.log_likelihood += unpaid
        return model

    def _unpaid(self, c: Candidate) -> float:
        """Log of the mean over the widths of a prior over the best of them, of an effect that leaves no trace."""
        information = self.reduced.M[c.index, c.index] * (c.widths[0] * c.sd) ** 2
        if information.sum() > UNSEEN or len(c.widths) == 1:
            return 0.0
        share = np.array(c.widths) / c.widths[0]
        each = np.prod(1.0 / np.sqrt(1.0 + np.outer(share**2, np.maximum(information, 0.0))), axis=1)
        return float(np.log(len(share) * each.mean() / each.max()))


class MeasuredBench(Bench):
    """The fit of a measured machine: noise as its rows state it, a remainder that is smooth or free at each place."""

    searching = MeasuredSearch
    describing = False
    reaches = (np.inf, np.inf)  # priors are as wide as the signals allow
    settled = SETTLED

    def linearise(self, model=None, renew=False, corrected=True, leading=None):
        """See ``Bench``; there are no weights to renew, and what the equations read is taken as exact."""
        return self._each(self._task(model, corrected=False), self.recordings)

    def fit(self, begun=None):
        """See ``Bench``; the base model stands still before anything is compared, and rivals are compared at their own
        optimum: the leading set's is far from theirs where the priors are wide."""
        self.settle(NOTHING, steps=SETTLING)
        super().fit(begun)
        for _ in range(ROUNDS):
            whites = self.linearise()
            normal = self.normal(whites)
            search = self._search(normal)
            if not self._to_the_best(search):
                break
        return Fit(dict(self.point), whites, self.carried, search.ranked(), normal, search)

    def _to_the_best(self, search: Search) -> bool:
        """Move to the finalist that is the most probable at its own optimum; whether it is not the leading one."""
        # an own form may have taken up what another effect of the library is: sets without any are finalists as well
        sizes, self.sizes = self.sizes, {}
        plain = self._search(self.normal(self.linearise())) if sizes else search
        self.sizes = sizes
        finalists: dict[tuple[str, ...], Model] = {}
        for ranked in (search.ranked(), plain.ranked()):
            most = len(finalists) + FINALISTS
            for model in ranked:
                if model.log_posterior > ranked[0].log_posterior - NEAR and len(finalists) < most:
                    finalists.setdefault(tuple(u for u in model.units if not u.startswith("remainder:")), model)
        begun = self.here()
        reached = []
        for model in finalists.values():
            self.go_to(begun)
            found = self.settle(replace(model, log_posterior=0.0), steps=SETTLING)
            reached.append((found.log_posterior, self.here()))
        best = max(range(len(reached)), key=lambda k: reached[k][0])
        if best == 0 or reached[best][0] < reached[0][0] + CLOSE:
            self.go_to(begun)
            return False
        self.go_to(reached[best][1])
        return True

    def move(self, model, normal):
        """See ``Bench``; the point stays where parameters are possible."""
        ahead = super().move(model, normal)
        for n, (low, high) in self.machine.bounds.items():
            for point in (self.point, self.instead):
                point[n] = float(np.clip(point[n], low, high))
        return ahead

    def _ends(self, model, names):
        """See ``Bench``; a step ends where parameters are possible."""
        low, high = super()._ends(model, names)
        for k, n in enumerate(names):
            if n in self.machine.bounds:
                least, most = (self._deviation_to(n, x) for x in self.machine.bounds[n])
                low[k], high[k] = max(low[k], least), min(high[k], most)
        return low, high

    def _carry_own_forms(self, search: Search) -> bool:
        """See ``Bench``: effects of good sets alone."""
        chosen: dict[str, dict[str, float]] = {}
        for model in search.ranked():
            for choice in model.choices:
                if len(chosen) < CARRYING and self._kind(choice.unit) == "structural" and choice.unit not in chosen:
                    names = self.names_of(choice)
                    chosen[choice.unit] = {n: model.deviations[n] - self.prior(n)[2] for n in names}
        self.sizes = chosen
        return bool(chosen)

    def candidates(self, reduced: Reduced) -> tuple[list[Unit], dict[tuple[str, int], Candidate]]:
        """See ``Bench``: each remainder smooth, fast along a coordinate or free, of any size up to the largest gap."""
        _, found = super().candidates(reduced)
        out: dict[tuple[str, int], Candidate] = {}
        for (unit, variant), candidate in found.items():
            if not unit.startswith("remainder:"):
                reach = self.machine.reach.get(unit, 1.0)
                more = (reach,) if reach > 1.0 and len(candidate.widths) > 1 else ()
                out[unit, variant] = replace(candidate, widths=(*more, *candidate.widths))
                continue
            equation = unit.split(":", 1)[1]
            place = np.array([int(n.rsplit(".", 1)[1]) for n in candidate.names])
            coordinates = range(len(self.machine.ranges[equation]))
            block = (place - SMOOTH) // WAVES
            kept = [place < SMOOTH, *((place < SMOOTH) | (block == c) for c in coordinates), block >= len(coordinates)]
            for v, functions in enumerate(kept):
                out[unit, v] = _narrowed(candidate, functions)
            self.remainders[unit] = Unit(unit, "remainder", (equation,), [Variant([])] * len(kept))
        return [*self.units, *self.remainders.values()], out


def _narrowed(c: Candidate, kept: np.ndarray) -> Candidate:
    names = [n for n, k in zip(c.names, kept, strict=True) if k]
    return replace(
        c, index=c.index[kept], mean=c.mean[kept], sd=c.sd[kept], signs=c.signs[kept], names=names, widths=SIZES
    )

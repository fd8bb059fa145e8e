"""The posterior over sets of listed effects, described forms and equations with a remainder."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import ndtr

from ..compiled import compiled
from .evidence import Reduced, factored
from .growth import Factored
from .model import Unit
from .set_prior import SIZE_PRIOR, SetPrior
from .sets import OTHER_FORM, Candidate, Choice, Model

ROUNDING = 1e-6  # of a prior's width, by which the data know a value no better
TINY = 1e-12  # probability that counts as none
BEAM = 4
ADDED = 15  # units tried in addition to a set
SWAPPED = 5  # units tried in the place of each member
COMPLETED = 4  # leading sets that every candidate is added to in the end
NEAR = 12.0  # log posterior within which a set is worth extending
KEPT = 64  # sets that stay factored


class Search:
    """Beam search with additions, removals and swaps over a linearised model."""

    size_prior: tuple[float, ...] = SIZE_PRIOR

    def __init__(
        self,
        reduced: Reduced,
        units: Sequence[Unit],
        candidates: dict[tuple[str, int], Candidate],
        corrections: Mapping[str, float] | None = None,
        scanned: float = np.inf,
    ):
        """``scanned``: forms proposed by scans that a set is extended to, at most."""
        self.reduced = reduced
        self.units = {u.id: u for u in units}
        self.candidates = candidates
        self.seen: dict[tuple[tuple[str, int], ...], Model] = {}
        none = np.zeros(0)
        self.nothing = Factored(reduced, none.astype(int), none, none, none.astype(int))
        self.kept: dict[tuple, Factored] = {}  # sets that are factored, the last ones used
        self.usual: dict[tuple[str, int], float] = {}  # widths of the priors of what led before
        self.names = np.array(reduced.names, object)
        self.paid: dict[tuple[str, int], float] = {}
        self.priors: dict[tuple[tuple[str, int], float], tuple[np.ndarray, ...]] = {}
        self.tempering = 1.0
        self.corrections = corrections or {}
        self.scanned = scanned
        self.prior = SetPrior(units, candidates, self.size_prior)
        flat = list(candidates.values())
        #: (column,) indices of each candidate's own columns and of its own form's
        self.columns = {m: np.concatenate([c.index, c.extra]).astype(int) for m, c in candidates.items()}
        self.flat = (
            np.cumsum([0, *map(len, self.columns.values())]),
            _joined(list(self.columns.values())).astype(int),
            _joined([x for c in flat for x in (c.mean, np.zeros(len(c.extra)))]),
            _joined([x for c in flat for x in (c.sd, c.extra_sd)]),
        )  # fmt: skip

    # ---- one set
    def fit(self, members: tuple[tuple[str, int], ...], widths: dict[tuple[str, int], float] | None = None) -> Model:
        """The set's posterior, each member's width the best of its mixture."""
        members = tuple(sorted(members))
        if members not in self.seen:
            self.seen[members] = self._fit(members, widths)
        return self.seen[members]

    def _fit(self, members: tuple[tuple[str, int], ...], widths: dict[tuple[str, int], float] | None) -> Model:
        width = {m: (widths or {}).get(m) or self._usual(m) for m in members}
        best = None
        for m in members:
            if (widths or {}).get(m) is None:
                best, width = self._widen(members, m, width)
        value, index, mean, deviation = best or self.factored(members, width).log_evidence()
        for m in members:
            value += self._paid(m)
            if self.candidates[m].hole.size:
                value += self._outside(m, width[m], index, mean, deviation)
        names = self.names[index].tolist()
        return Model(
            tuple(Choice(m[0], m[1], width[m]) for m in members),
            self.tempering * value + self.log_prior(members),
            value,
            dict(zip(names, mean.tolist(), strict=True)),
            dict(zip(names, deviation.tolist(), strict=True)),
        )

    def _paid(self, m: tuple[str, int]) -> float:
        """Log evidence that a member has beside its columns': what a closer look took off, and the choice of one of its
        widths and variants."""
        if m not in self.paid:
            ways = len(self.candidates[m].widths) * self.variants(m[0])
            self.paid[m] = self.corrections.get(m[0], 0.0) - float(np.log(ways))
        return self.paid[m]

    def less(self, model: Model, unit: str) -> Model:
        """The set less a unit, the others' priors as wide as they are or as they were when it was looked at first."""
        width = {(c.unit, c.variant): c.width for c in model.choices if c.unit != unit}
        members = tuple(sorted(width))
        before, again = self.fit(members, width), self._fit(members, width)
        self.seen[members] = max(before, again, key=lambda m: m.log_posterior)
        return self.seen[members]

    def wide(self, model: Model) -> Model:
        """The same set under the widest priors, whose estimates are shrunk the least."""
        members = tuple((c.unit, c.variant) for c in model.choices)
        _, index, mean, deviation = self.factored(
            members, {m: self.candidates[m].widths[0] for m in members}
        ).log_evidence()
        names = self.names[index].tolist()
        return replace(
            model,
            deviations=dict(zip(names, mean.tolist(), strict=True)),
            spread=dict(zip(names, deviation.tolist(), strict=True)),
        )

    def _usual(self, m: tuple[str, int]) -> float:
        """The width that a member's prior is tried with first."""
        widths = self.candidates[m].widths
        begun = self.usual.get(m)
        return begun if begun in widths else widths[len(widths) // 2]

    def _widen(self, members, m, width):
        """Evidence at the best width of one member's prior: uphill over its grid from where it is."""
        c = self.candidates[m]
        others = self.factored(tuple(o for o in members if o != m), width)
        more = others.and_one_more(self.columns[m])

        def evidence(w):
            return more.log_evidence(*self._prior_of(m, w))

        grid = c.widths
        at = best_at = grid.index(width[m])
        best = evidence(grid[at])
        for step in (1, -1):
            k = at + step
            while 0 <= k < len(grid):
                found = evidence(grid[k])
                if found[0] <= best[0]:
                    break
                best, best_at = found, k
                k += step
            if best_at != at:
                break
        return best, {**width, m: grid[best_at]}

    def _outside(self, m, width, index, mean, deviation) -> float:
        """Log of the posterior over the prior mass outside a prior's hole: of a unit's values beyond tolerance.

        The value is that within tolerance and what is beyond together, which the data tell from one column: of both
        posteriors follow the column's error, and that of their sum.
        """
        c = self.candidates[m]
        k = np.searchsorted(np.sort(index), c.index)
        k = np.argsort(index)[k]
        beyond = width**2
        both = beyond + c.within**2
        s = np.minimum(deviation[k] / c.sd, width * (1.0 - ROUNDING))
        error = np.maximum(beyond**2 / (beyond - s**2) - both, (ROUNDING * width) ** 2)
        x = (mean[k] - self.reduced.fixed[c.index]) / c.sd * both / beyond
        spread = np.sqrt(both * error / (both + error))
        low, high = c.hole
        inside = ndtr((high - x) / spread) - ndtr((low - x) / spread)
        before = ndtr(high / np.sqrt(both)) - ndtr(low / np.sqrt(both))
        return float(np.log(np.maximum(1.0 - np.prod(inside), TINY)) - np.log(1.0 - np.prod(before)))

    def variants(self, unit: str) -> int:
        """Number of variants of a unit, wherever the point is."""
        return max(1, len(self.units[unit].variants))

    def factored(self, members, width) -> Factored:
        """A set ready for one member more. Its members come one after the other, those of most columns first, so that
        sets that differ in small members share the factor of the large ones."""
        ordered = sorted(members, key=lambda m: (-len(self.columns[m]), m))
        key = tuple((m, width[m]) for m in ordered)
        begun = next((k for k in range(len(key), 0, -1) if key[:k] in self.kept), 0)
        found = self.nothing
        if begun:  # put last again
            found = self.kept[key[:begun]] = self.kept.pop(key[:begun])
        for k in range(begun, len(key)):
            grown = found.with_more(self.columns[ordered[k]], *self._prior_of(*key[k]))
            found = self.kept[key[: k + 1]] = grown
        while len(self.kept) > KEPT:
            del self.kept[next(iter(self.kept))]
        return found

    def _prior_of(self, m, width) -> tuple[np.ndarray, ...]:
        """(column,) means, standard deviations and sides of a member's prior that is so wide."""
        if (m, width) not in self.priors:
            c = self.candidates[m]
            none = np.zeros(len(c.extra))
            self.priors[m, width] = (
                np.concatenate([c.mean, none]),
                np.concatenate([c.sd * width, c.extra_sd]),
                np.concatenate([c.signs, none.astype(int)]),
            )
        return self.priors[m, width]

    def log_prior(self, members: Sequence[tuple[str, int]]) -> float:
        """Log prior probability of a set."""
        return self.prior.log_of(members)

    def _may_be(self, members: Sequence[tuple[str, int]]) -> bool:
        """Whether the search may look at a set."""
        few = sum(self.units[u].proposed for u, _ in members) <= self.scanned
        return few and bool(np.isfinite(self.log_prior(members)))

    # ---- the search
    def run(self, begun: Sequence[tuple[Choice, ...]] = (), rounds: int = 8) -> list[Model]:
        """Every set looked at, most probable first; ``begun``: sets that led where this search goes on from."""
        causes = {m for m in self.candidates if self.units[m[0]].kind != "remainder"}
        # a remainder stands in for several causes at once, from which no single step leads back to them
        for among in (causes, set(self.candidates)):
            self.look(begun, among)
            self._climb(rounds, among)
        # a unit in another form may take up what is another's, beside which its own form is the better again
        while self._complete():
            self._climb(rounds, set(self.candidates))
        return self.ranked()

    def look(self, begun: Sequence[tuple[Choice, ...]], among: Collection[tuple[str, int]] | None = None) -> None:
        """Fit the empty set and some others, what they have of some candidates or of all."""
        self.usual |= {m: c.width for choices in reversed(begun) for m, c in self._here(choices).items()}
        inside = set(self.candidates) if among is None else among
        for members in [(), *(tuple(sorted(self._here(choices))) for choices in begun)]:
            kept = tuple(m for m in members if m in inside)
            if self._may_be(kept):
                self.fit(kept)

    def look_without(self) -> None:
        """Fit the likeliest set less each of its members."""
        best = self.ranked()[0]
        for unit in best.units:
            self.less(best, unit)

    def leading(self) -> list[tuple[Choice, ...]]:
        """The likeliest sets, and the likeliest of those without a remainder: where a search may go on from."""
        ranked = self.ranked()
        causes = [m for m in ranked if all(self.units[u].kind != "remainder" for u in m.units)]
        return [m.choices for few in (ranked, causes) for m in self._near(few)]

    def _near(self, ranked: Sequence[Model]) -> list[Model]:
        """The first of some sets that are worth extending."""
        return [m for m in ranked[: 4 * BEAM] if m.log_posterior > ranked[0].log_posterior - NEAR]

    def _here(self, choices: Sequence[Choice]) -> dict[tuple[str, int], Choice]:
        """The candidates that a set's units are now."""
        out = {}
        for c in choices:
            for variant in (c.variant, c.variant % OTHER_FORM, 0):
                if (c.unit, variant) in self.candidates:
                    out[c.unit, variant] = c
                    break
        return out

    def _complete(self) -> bool:
        """Add every candidate to the leading sets, for what is too small to be seen has its prior odds and is not left
        out; whether another set leads then."""
        before = self.ranked()
        for model in before[:COMPLETED]:
            inside = tuple((c.unit, c.variant) for c in model.choices)
            widths = {(c.unit, c.variant): c.width for c in model.choices}
            for m in self.candidates:
                if m[0] not in {u for u, _ in inside} and self._may_be((*inside, m)):
                    self.fit((*inside, m), widths)
        return self.ranked()[0] is not before[0]

    def _climb(self, rounds: int, among: set[tuple[str, int]]) -> None:
        """Extend the likeliest sets by some of the candidates until none is left that is worth it."""
        extended: set = set()
        for _ in range(rounds):
            todo = [m for m in self._near(self.ranked()) if m.choices not in extended][:BEAM]
            if not todo:
                break
            for model in todo:
                extended.add(model.choices)
                self._extend(model, among)

    def ranked(self) -> list[Model]:
        """Sets seen, most probable first."""
        return sorted((m for m in self.seen.values() if np.isfinite(m.log_posterior)), key=lambda m: -m.log_posterior)

    def _extend(self, model: Model, among: set[tuple[str, int]]) -> None:
        inside = tuple((c.unit, c.variant) for c in model.choices)
        widths = {(c.unit, c.variant): c.width for c in model.choices}
        others = {m for m in among if m[0] not in {u for u, _ in inside}}
        for m in self._promising(model, others, ADDED):
            grown = (*inside, m)
            if self._may_be(grown):
                self.fit(grown, widths)
        for out in inside:
            kept = tuple(m for m in inside if m != out)
            less = self.fit(kept, widths)
            variants = [m for m in self.candidates if m[0] == out[0] and m != out]
            for m in [*self._promising(less, others, SWAPPED), *variants]:
                swapped = (*kept, m)
                if self._may_be(swapped):
                    self.fit(swapped, widths)

    def _promising(self, model: Model, among: set[tuple[str, int]], most: int) -> list[tuple[str, int]]:
        """Candidates by what each alone would add to a model, the others held where the model has them."""
        r = self.reduced
        d = r.fixed.copy()
        for n, value in model.deviations.items():
            d[r.index[n]] = value
        gains = _gains(r.M, r.b, d, *self.flat)
        ranked = [(-gains[k], k) for k, m in enumerate(self.candidates) if m in among]
        every = list(self.candidates)
        return [every[k] for _, k in sorted(ranked)[:most]]


@compiled
def _gains(M, b, d, starts, index, mean, sd):
    """Log evidence (candidate,) that each candidate's own columns would add to deviations ``d``, all else held."""
    left = b.copy()
    for o in np.flatnonzero(d):
        for k in range(len(left)):
            left[k] -= M[o, k] * d[o]  # along a row of memory
    out = np.empty(len(starts) - 1)
    for c in range(len(out)):
        own = index[starts[c] : starts[c + 1]]
        n = len(own)
        A, step, g = np.empty((n, n)), np.empty(n), np.empty(n)
        for k in range(n):
            step[k] = mean[starts[c] + k] - d[own[k]]
        gain = 0.0
        for k in range(n):
            moved = 0.0
            for m in range(n):
                moved += M[own[k], own[m]] * step[m]
                A[k, m] = M[own[k], own[m]] * sd[starts[c] + k] * sd[starts[c] + m]
            A[k, k] += 1.0
            g[k] = (left[own[k]] - moved) * sd[starts[c] + k]
            gain += (left[own[k]] - 0.5 * moved) * step[k]
        if not factored(A):
            out[c] = -np.inf
            continue
        for k in range(n):
            x = g[k]
            for q in range(k):
                x -= A[k, q] * g[q]
            g[k] = x / A[k, k]
            gain += 0.5 * g[k] * g[k]
        out[c] = gain
    return out


def _joined(parts: Sequence[np.ndarray]) -> np.ndarray:
    return np.concatenate([np.zeros(0), *parts])

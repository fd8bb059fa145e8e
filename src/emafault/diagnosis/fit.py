"""The fit of a bench: linearise, search, relinearise at what leads, until it stands still."""

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import expit

from .described import Described
from .describing import FEWEST, MOST, Describing
from .evidence import Normal
from .linear import White
from .linearisation import Carried, Task
from .model import LISTED
from .naming import NAMED
from .point import Place
from .search import NEAR, Search
from .sets import OTHER_FORM, Choice, Model

ROUNDS = 3
LINEAR = 0.01  # of what an effect explains, that a linear model may be wrong by
FIRST = 2  # rounds of the search before remainders and own forms
LEAVES = 1  # times that a member of the leading set may fall at a closer look
SINGLES = 3  # causes that a search may begin at in the place of what leads
CARRYING = 6  # units that carry their own form
CHANGING = ("carried", "sizes", "closer", "looked_at", "leading", "sound", "scanned")  # in a search, beside its point
NOTHING = Model(())  # the unit alone


@dataclass
class Fit:
    """Where a bench's search ended."""

    values: dict[str, float]  # the point of linearisation
    whites: list[White]
    carried: dict[str, Carried]  # by recording
    models: list[Model]
    normal: Normal
    search: Search


@dataclass(frozen=True)
class State:
    """All that a search changes."""

    place: Place
    forms: Sequence[Described]
    rest: Mapping[str, Any]


class Bench(Describing):
    """A bench with the search over its sets."""

    def __init__(self, machine, recordings: Sequence[str], processes: int = 1):
        super().__init__(machine, recordings, processes)
        self.looked_at: tuple[str, ...] | None = None  # units of the set at which the weights were taken
        self.leading: dict[bool, list[tuple[Choice, ...]]] = {}  # sets that the last search ended at, by ``sound``

    def fit(self, begun: "tuple[Bench, Fit] | None" = None) -> Fit:
        """Search and relinearise until the leading set stands still.

        ``begun``: a bench of some of these recordings and its fit, to go on from.
        """
        if begun is not None:
            self._go_on(*begun)
        if begun is not None and self.describing:
            whites, normal, search = self._by_what_leads(begun[1].models[0])
        elif begun is not None:
            self.settle(begun[1].models[0])
            whites, normal, search = self._with_none_to_leave(*self._renewed())
        else:
            whites, normal, search = self._explored()
            if self.describing:
                whites, normal, search = self._by_what_leads(search.ranked()[0], normal)
        return Fit(dict(self.point), whites, self.carried, search.ranked(), normal, search)

    def _explored(self) -> tuple[list[White], Normal, Search]:
        # the unit first: its nuisances move the point before anything is compared, but not to where only a cause that
        # is missing would have them
        self.reach = self.reaches[0]
        self.settle(NOTHING)
        whites, normal = self._renewed()
        if self._describe("first"):
            whites, normal = self._renewed()
        self.reach = self.reaches[1]
        if self.describing and self._begun_at_single(normal):
            whites, normal = self._renewed()
        # what no one has described comes last: it would take up what only a better point explains
        whites, normal, search = self._until_still(whites, normal, FIRST, False)
        before = self.described
        self._keep_likely(search)
        self._describe("led")
        if self._carry_own_forms(search) or self.described != before:
            self.looked_at = search.ranked()[0].units
            whites, normal = self._renewed()
        return self._with_all_described(*self._with_none_to_leave(whites, normal))

    def _with_all_described(
        self, whites: list[White], normal: Normal, search: Search
    ) -> tuple[list[White], Normal, Search]:
        """Scan on while the leading set has as many forms of scans as sets may have, which are one more each time; if
        that ends at a set with a remainder where they act, or can be seen to, where it began: what several forms do not
        describe is a remainder beside few.
        """
        fit, begun = (whites, normal, search), self._state()
        while self.scanned < MOST and self._count_scanned(search) == self.scanned:
            before = self.described
            self._keep_likely(search)
            if not self._describe(f"led_{self.scanned}") and len(self.described) == self._count_scanned(search):
                self.describe(before)
                break
            self.scanned += 1
            whites, normal, search = self._until_still(*self._renewed(), FIRST, False)
            if self._count_scanned(search) == self.scanned and self._out_of_reach(search, normal):
                self._restore(begun)
                return fit
        if self.scanned == FEWEST:
            return fit
        whites, normal, search = self._until_still(*self._renewed(), ROUNDS)
        if not self._lacking(search):
            whites, normal, search = self._none_to_leave(whites, normal, search)
        if not self._lacking(search):
            return whites, normal, search
        self._restore(begun)
        return fit

    def _out_of_reach(self, search: Search, normal: Normal) -> bool:
        """Whether a remainder where the leading set's forms of scans act would still add more to that than all the
        forms which it may yet have, were each as good as the least of those."""
        best = search.ranked()[0]
        mine = [f for f in self.described if f.id in best.units]
        least = min(best.log_posterior - search.less(best, f.id).log_posterior for f in mine)
        with_remainders = self._searched(normal, True, [best.choices])
        members = tuple((c.unit, c.variant) for c in best.choices)
        places = {f"remainder:{q}" for f in mine for q in (f.equation, f.seen)}
        added = [
            with_remainders.fit((*members, m)).log_posterior - with_remainders.fit(members).log_posterior
            for m in with_remainders.candidates
            if m[0] in places
        ]
        return max(added, default=0.0) > (MOST - self.scanned) * least

    def _with_none_to_leave(self, whites: list[White], normal: Normal) -> tuple[list[White], Normal, Search]:
        return self._none_to_leave(*self._until_still(whites, normal, ROUNDS))

    def _none_to_leave(self, whites: list[White], normal: Normal, search: Search) -> tuple[list[White], Normal, Search]:
        for _ in range(LEAVES):
            if not self._leave_out(search, normal):
                break
            whites, normal = self._renewed()
            whites, normal, search = self._until_still(whites, normal, ROUNDS)
        return whites, normal, search

    def _go_on(self, bench: "Bench", fit: Fit) -> None:
        """From where a bench's fit ended."""
        self.describe(bench.described)
        self.point |= {n: v for n, v in fit.values.items() if n in self.point}
        self.on, self.sizes, self.closer = set(bench.on), dict(bench.sizes), dict(bench.closer)
        self.sound, self.leading, self.scanned = bench.sound, dict(bench.leading), bench.scanned
        self.carried |= fit.carried
        self.describe([self._over_all(f) for f in self.described])
        # until they are fitted, what the others' fit leaves of further recordings is their noise
        as_left = Task(self.values(), (), frozenset(), full={}, corrected=False)
        self._each(as_left, [n for n in self.recordings if n not in fit.carried])

    def _by_what_leads(self, best: Model, normal: Normal | None = None) -> tuple[list[White], Normal, Search]:
        """Search once more with the noise that the leading set leaves, until it leads by that too.

        A full model takes from the noise whatever any cause could explain: right while causes are compared that one of
        them may be, too little noise once none of them is it.
        """
        for _ in range(ROUNDS):
            self.settle(best, normal)
            whites = self.linearise(leading=self.own_deviations(*self._fitted(best)))
            renewed = self.normal(whites)
            search = self._search(renewed)
            self._against_rivals(search, renewed)
            before, best, normal = best, search.ranked()[0], renewed
            if best.units == before.units:
                break
        return whites, renewed, search

    def _begun_at_single(self, normal: Normal) -> bool:
        """Move the point to the best single cause where that, at its own optimum, is better than what the linear model
        has lead; whether it is.

        A far optimum looks from here like several small effects together.
        """
        search = self._search(normal, remainders=False)
        leading = search.ranked()[0]
        if len(leading.units) < 2:
            return False
        best: dict[str, Model] = {}  # variant of each
        for m in search.candidates:
            if self._kind(m[0]) != "remainder" and m[1] < OTHER_FORM:
                single = search.fit((m,))
                if m[0] not in best or single.log_posterior > best[m[0]].log_posterior:
                    best[m[0]] = single
        singles = sorted(best.values(), key=lambda m: -m.log_posterior)[:SINGLES]
        begun, proposed = self.here(), self.described
        ends = []
        for model in [leading, *singles]:
            self.go_to(begun)
            found = self.settle(model, normal)
            if self._refine(found):  # its shape was found beside whatever else might explain it
                found = self.settle(found)
            ends.append((found.log_posterior, self.here(), self.described))
            self.describe(proposed)
        value, place, shaped = max(ends, key=lambda e: e[0])
        better = value > ends[0][0]
        self.describe(shaped if better else proposed)
        self.go_to(place if better else begun)
        return better

    def _renewed(self) -> tuple[list[White], Normal]:
        whites = self.linearise(renew=True)
        return whites, self.normal(whites)

    def _until_still(
        self, whites: list[White], normal: Normal, rounds: int, remainders: bool = True
    ) -> tuple[list[White], Normal, Search]:
        search = self._search(normal, remainders)
        at_optimum: tuple[Choice, ...] | None = None  # of this set, under the present weights
        for _ in range(rounds):
            best = search.ranked()[0]
            more = remainders and self._carry_own_forms(search)
            if not more and (best.choices == at_optimum or self._ahead(best, normal) < self.settled):
                break
            best = self._by_own_variants(self.settle(best, normal))
            if self._refine(best):
                self.settle(best)
            # weights are those of the first look at a set: no hypothesis gains by what it leaves
            renew = more or best.units != self.looked_at
            whites = self.linearise(renew=renew)
            self.looked_at, at_optimum = best.units, None if renew else best.choices
            normal = self.normal(whites)
            search = self._search(normal, remainders)
        return whites, normal, search

    def _search(self, normal: Normal, remainders: bool = True) -> Search:
        """Sets by the linear model; of a unit that may have no fault, under the prior that it has none where that is
        sure enough to be named.

        From the second time on, what leads under the prior of the last search is only looked at under the other, and so
        is the likeliest set less each of its members, which may have stood in for a fault; where that look is in its
        favour, the other is searched by as well.
        """
        before = self.sound
        found = {before: self._searched(normal, remainders)}
        if not any(p.absent > 0.0 for p in self.parameters.values()):
            return found[before]
        for only in (found[before].leading(), None) if (not before) in self.leading else (None,):
            self.sound = not before
            found[not before] = self._searched(normal, remainders, only)
            odds = found[True].ranked()[0].log_posterior - found[False].ranked()[0].log_posterior
            self.sound = bool(expit(odds) >= NAMED)
            if self.sound == before:
                break
        return found[self.sound]

    def _searched(self, normal: Normal, remainders: bool, only: Sequence[tuple[Choice, ...]] | None = None) -> Search:
        """By the present prior; ``only``: sets that are looked at, no others."""
        reduced = self.reduce(normal)
        units, candidates = self.candidates(reduced)
        if not remainders:
            candidates = {m: c for m, c in candidates.items() if not m[0].startswith("remainder:")}
        closer = {u: c for u, c in self.closer.items() if u not in self.on}
        search = self.searching(reduced, units, candidates, closer, self.scanned)
        if only is not None:
            search.look(only)
            search.look_without()
            return search
        search.run(self.leading.get(self.sound, ()))
        self.leading[self.sound] = search.leading()
        return search

    def _carry_own_forms(self, search: Search) -> bool:
        """Units of the leading set, then those that explain most alone, may take another form than the library's, in
        proportion to their size; whether any of the leading set does that did not before."""
        before = self.sizes
        leading = search.ranked()[0]
        if before and {c.unit for c in leading.choices if self._kind(c.unit) in LISTED} <= set(before):
            return False
        nothing = search.fit(())
        alone = [search.fit((m,)) for m in search.candidates if self._kind(m[0]) in LISTED and m[1] < OTHER_FORM]
        good = [m for m in alone if m.log_posterior > nothing.log_posterior]
        self.sizes = {}
        for model in [leading, *sorted(good, key=lambda m: -m.log_posterior)]:
            for choice in model.choices:
                if len(self.sizes) < CARRYING and self._kind(choice.unit) in LISTED and choice.unit not in self.sizes:
                    names = self.names_of(choice)
                    self.sizes[choice.unit] = {n: model.deviations[n] - self.prior(n)[2] for n in names}
        return bool(self.sizes)

    def _state(self) -> State:
        return State(self.here(), self.described, {name: copy(getattr(self, name)) for name in CHANGING})

    def _restore(self, state: State) -> None:
        self.describe(state.forms)
        self.go_to(state.place)
        vars(self).update(state.rest)

    # ---- sets, each at its own optimum
    def _ahead(self, model: Model, normal: Normal) -> float:
        """Log evidence that a model's step from the point promises, which stays."""
        kept = self.here()
        ahead = self.move(model, normal)
        self.go_to(kept)
        return ahead

    def _leave_out(self, search: Search, normal: Normal) -> bool:
        """Compare the leading set with those that lack one member, have a listed effect in the place of a described
        form, or are a listed effect alone in another form, each at its own optimum; whether one is better.

        What the linear model says of them from a point far from theirs is replaced by what it says at their own, where
        what tells them apart is less than the linear model may be wrong by.
        """
        best = search.ranked()[0]
        reach = max(LINEAR * (best.log_posterior - search.fit(()).log_posterior), NEAR)
        lacking: dict[str, Model] = {}  # by the member that is left out
        for unit in (u for u in best.units if not u.startswith("remainder:")):
            less = search.fit(tuple((c.unit, c.variant) for c in best.choices if c.unit != unit))
            if best.log_posterior - less.log_posterior < reach:
                lacking[unit] = less
        instead = [*self._listed_instead(search, best, reach), *self._alone_in_another_form(search, best)]
        if not lacking and not instead:
            return False
        begun = self.here()
        self.move(best, normal)
        leading = self.settle(Model(best.choices))  # from its own columns, as the others
        top = leading.log_posterior
        better: Place | None = None
        for unit, less in lacking.items():
            self.go_to(begun)
            self.move(less, normal)  # where the linear model has the set's optimum
            own = self.settle(Model(less.choices))
            error = best.log_posterior - less.log_posterior - (leading.log_posterior - own.log_posterior)
            if self._by_secant(unit):
                self.closer[unit] = -error
            less.log_posterior += error
            if own.log_posterior > top:
                top, better = own.log_posterior, self.here()
        for listed in instead:
            self.go_to(begun)
            self.move(listed, normal)
            own = self.settle(Model(listed.choices))
            if own.log_posterior > top:
                top, better = own.log_posterior, self.here()
        self.go_to(better or begun)
        return better is not None

    def _against_rivals(self, search: Search, normal: Normal) -> None:
        """Compare the leading set with those that have another listed effect in the place of one that it nearly stands
        for, each at its own optimum, and correct the sets of the search by what that changes.

        What a large effect explains is wrong in the linear model by more than what tells a near rival from it.
        """
        best = search.ranked()[0]
        rivals = []
        for unit in (u for u in best.units if self._kind(u) in LISTED):
            rest = tuple((c.unit, c.variant) for c in best.choices if c.unit != unit)
            reach = LINEAR * (best.log_posterior - search.fit(rest).log_posterior)
            if reach <= NEAR:  # what tells them apart is larger than the linear model's error
                continue
            for m in search.candidates:
                if self._kind(m[0]) in LISTED and m[1] < OTHER_FORM and m[0] not in best.units:
                    found = search.fit((*rest, m))
                    if best.log_posterior - found.log_posterior < reach:
                        rivals.append((unit, m[0], found))
        if not rivals:
            return
        leading = self.at_its_own(best, normal).log_posterior
        for unit, rival, model in rivals:
            own = self.at_its_own(model, normal).log_posterior
            error = own - leading - (model.log_posterior - best.log_posterior)
            for other in search.seen.values():
                if rival in other.units and unit not in other.units:
                    other.log_posterior += error

    def _listed_instead(self, search: Search, best: Model, reach: float) -> list[Model]:
        """A set with each of the likeliest listed effects in the place of each of its described forms.

        A far optimum may look from here less like the effect that it is than like a form. In the place of one that no
        scan has proposed, that is so of effects by secants alone, as far as they explain something there. ``reach``:
        log evidence that the linear model may be wrong by, of an effect that is none by a secant.
        """
        out = []
        proposed = {f.id for f in self.described}
        for form in (u for u in best.units if self._kind(u) == "form"):
            rest = tuple((c.unit, c.variant) for c in best.choices if c.unit != form)
            sets = [
                (*rest, m)
                for m in search.candidates
                if self._kind(m[0]) in LISTED and m[1] < OTHER_FORM and m[0] not in best.units
                if form in proposed or self._by_secant(m[0])
            ]
            least = -np.inf if form in proposed else search.fit(rest).log_posterior
            likeliest: dict[str, Model] = {}  # variant of each effect
            for members in sets:
                if np.isfinite(search.log_prior(members)):
                    found, effect = search.fit(members), members[-1][0]
                    if found.log_posterior > (likeliest[effect].log_posterior if effect in likeliest else least):
                        likeliest[effect] = found
            near = [
                m for u, m in likeliest.items() if self._by_secant(u) or best.log_posterior - m.log_posterior < reach
            ]
            out += sorted(near, key=lambda m: -m.log_posterior)[:SINGLES]
        return out

    def _alone_in_another_form(self, search: Search, best: Model) -> list[Model]:
        """The likeliest listed effects, each alone and in another form than the library's.

        A large effect in another form looks from the library's like several causes together, and from where these have
        taken the point that effect alone like nothing.
        """
        if len(best.units) < 2:
            return []
        alone: dict[str, Model] = {}
        for m in search.candidates:
            if self._kind(m[0]) in LISTED and m[1] >= OTHER_FORM:
                found = search.fit((m,))
                if m[0] not in alone or found.log_posterior > alone[m[0]].log_posterior:
                    alone[m[0]] = found
        return sorted(alone.values(), key=lambda m: -m.log_posterior)[:SINGLES]

    def _by_secant(self, unit: str) -> bool:
        return any(p.secant is not None for u in self.units if u.id == unit for p in u.parameters)

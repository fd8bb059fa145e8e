"""The fit of a bench: linearise, search, relinearise at what leads, until it stands still."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import expit

from .described import Described, proposed, refined, with_forms
from .evidence import SETTLED, Normal
from .linear import White
from .linearisation import Carried, Task
from .model import LISTED
from .naming import NAMED
from .normal import NormalEquations
from .point import is_parameter
from .search import NEAR, OTHER_FORM, Model, Search

ROUNDS = 3
LINEAR = 0.01  # of what an effect explains, that a linear model may be wrong by
FIRST = 2  # rounds of the search before remainders and own forms
LEAVES = 1  # times that a member of the leading set may fall at a closer look
SETTLING = 3  # steps of a set to its own optimum
HALVINGS = 6  # of a step after which a set fits worse than before
SINGLES = 3  # causes that a search may begin at in the place of what leads
CARRYING = 6  # units that carry their own form
SCANNED = 30_000  # samples that are looked through for forms, or more where few recordings hold them
SPREAD = 3  # recordings that they are of at least
FAR = 1e3  # log evidence that the next step will promise, beyond which its own bias does not matter


NOTHING = Model((), 0.0, 0.0, {}, {})  # the unit alone


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
class Began:
    """Where a step began: the point, and its misfit (nats) with the noise's part and, where that is known, without."""

    point: dict[str, float]
    misfits: tuple[float, float | None]

    def holds(self, after: tuple[float, float | None], slack: float) -> bool:
        """Whether the misfit after the step is no larger."""
        whole, less = self.misfits
        return after[1] < less + slack if less is not None and after[1] is not None else after[0] < whole + slack


@dataclass
class Inserted:
    """A fitted set as a model of other recordings: all values, and what stands beside them.

    ``beside``: coefficients of remainders and own forms by column; ``own``: sizes of the units that carry their own
    form.
    """

    values: dict[str, float]
    beside: dict[str, float]
    own: dict[str, dict[str, float]]


def halfway(one: Mapping[str, float], other: Mapping[str, float]) -> dict[str, float]:
    """The point in the middle of two."""
    return {n: 0.5 * (one[n] + other[n]) for n in other}


class Bench(NormalEquations):
    """A bench with the search over its sets."""

    searching: type[Search] = Search
    describing = True  # whether recordings are long enough to tell forms and the colour of the noise from each other
    settled = SETTLED

    def __init__(self, machine, recordings: Sequence[str], processes: int = 1):
        super().__init__(with_forms(machine, getattr(machine, "forms", ())), recordings, processes)
        self.closer: dict[str, float] = {}  # what a closer look took off the log evidence that a secant gave a unit
        self._inserted: dict[tuple, Inserted] = {}
        self.looked_at: tuple[str, ...] | None = None  # units of the set at which the weights were taken

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
        return self._with_none_to_leave(whites, normal)

    def _with_none_to_leave(self, whites: list[White], normal: Normal) -> tuple[list[White], Normal, Search]:
        whites, normal, search = self._until_still(whites, normal, ROUNDS)
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
        self.sound = bench.sound
        self.carried |= fit.carried
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

    @property
    def described(self) -> tuple[Described, ...]:
        """Forms that have been proposed."""
        return self.machine.forms

    def describe(self, forms: Sequence[Described]) -> None:
        """Take described forms among the candidate causes."""
        if tuple(forms) == self.described:
            return
        self.machine = with_forms(self.machine, forms)
        self.parameters = dict(self.machine.parameters)
        self.units = list(self.machine.units)
        self.point = {n: p.off for n, p in self.parameters.items()} | self.point
        if self.workers is not None:
            self.workers.tell("describe", tuple(forms))

    def _describe(self, mark: str) -> bool:
        """Look through what the present point leaves for forms; whether there are any."""
        if not self.describing:
            return False
        names, workers = self._looked_through(), self._workers()
        carried = {n: self.carried[n] for n in names}
        # what stands out is what no listed effect could be, whether or not it acts yet
        values, free = self.values(), self._free({u.id for u in self.units if u.kind in LISTED} | self.on)
        parts = [(values, names, carried, free, mark, k, workers.count) for k in range(workers.count)]
        found = proposed(self.machine, [f for part in workers.map("scan", parts) for f in part])
        found = [f for f in found if not any(f.same(g) for g in self.described)]
        self.describe([*self.described, *found])
        return bool(found)

    def _free(self, units: Collection[str]) -> dict[str, tuple[float, float]]:
        """What is free beside a form: nuisances and parameters of some units, by name of a column."""
        names = [p.name for u in self.units if u.id in units for v in self.active(u) for p in v.parameters]
        return self._full_prior(names, self.columns()[1])

    def _keep_likely(self, search: Search) -> None:
        """Let go of described forms that no likely set has."""
        ranked = search.ranked()
        likely = {u for m in ranked if m.log_posterior > ranked[0].log_posterior - NEAR for u in m.units}
        self.describe([f for f in self.described if f.id in likely])

    def _looked_through(self) -> list[str]:
        """As many recordings as a scan needs."""
        out: list[str] = []
        samples = 0
        for name in [*self.recordings[::2], *self.recordings[1::2]]:
            if samples > SCANNED and len(out) >= SPREAD:
                break
            samples += self.machine.samples(name)
            out.append(name)
        return out

    def _refine(self, model: Model) -> bool:
        """Give described forms of a set, fitted at the present point, the shape that is best there; whether any
        changes."""
        mine = [f for f in self.described if f.id in model.units]
        if not mine:
            return False
        values, free = self.values(), self._free(self.on)
        blocks = [b for n in self._looked_through() for b in self.machine.blocks(values, n, wanted=set(free))]
        better = {f.id: refined(self.machine, f, blocks, self.carried, self.point, free) for f in mine}
        before = self.described
        self.describe([better.get(f.id, f) for f in before])
        return self.described != before

    def _by_own_variants(self, model: Model) -> Model:
        """A set that the point has settled at, with the variant of each unit whose variants look alike near off that is
        best at its own optimum, where the point moves."""
        alike = {u.id: u for u in self.units if u.alike}
        for unit in (alike[u] for u in model.units if u in alike):
            ends = [(model, dict(self.point), set(self.on))]
            amount = sum(self.point[p.name] for p in unit.parameters)
            for v, variant in enumerate(unit.variants):
                if v in [c.variant for c in model.choices if c.unit == unit.id]:
                    continue
                self.point, self.on = dict(ends[0][1]), set(ends[0][2])
                self.point |= {p.name: p.off for p in unit.parameters} | {p.name: amount for p in variant.parameters}
                other = tuple(replace(c, variant=v) if c.unit == unit.id else c for c in model.choices)
                ends.append((self.settle(Model(other, 0.0, 0.0, {}, {})), dict(self.point), set(self.on)))
            model, self.point, self.on = max(ends, key=lambda e: e[0].log_posterior)
        return model

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
        begun = dict(self.point), set(self.on)
        ends = []
        for model in [leading, *singles]:
            self.point, self.on = dict(begun[0]), set(begun[1])
            found = self.settle(model, normal)
            ends.append((found.log_posterior, dict(self.point), set(self.on)))
        value, point, on = max(ends, key=lambda e: e[0])
        better = value > ends[0][0]
        self.point, self.on = (point, on) if better else begun
        return better

    def _renewed(self) -> tuple[list[White], Normal]:
        whites = self.linearise(renew=True)
        return whites, self.normal(whites)

    def _until_still(
        self, whites: list[White], normal: Normal, rounds: int, remainders: bool = True
    ) -> tuple[list[White], Normal, Search]:
        search = self._search(normal, remainders)
        for _ in range(rounds):
            best = search.ranked()[0]
            more = remainders and self._carry_own_forms(search)
            if self._ahead(best, normal) < self.settled and not more:
                break
            best = self._by_own_variants(self.settle(best, normal))
            if self._refine(best):
                self.settle(best)
            # weights are those of the first look at a set: no hypothesis gains by what it leaves
            whites = self.linearise(renew=more or best.units != self.looked_at)
            self.looked_at = best.units
            normal = self.normal(whites)
            search = self._search(normal, remainders)
        return whites, normal, search

    def _search(self, normal: Normal, remainders: bool = True) -> Search:
        """Sets by the linear model; of a unit that may have no fault, under the prior that it has none where that is
        sure enough to be named."""
        found = {}
        for sound in (False, True) if any(p.absent > 0.0 for p in self.parameters.values()) else (False,):
            self.sound = sound
            found[sound] = self._searched(normal, remainders)
        if len(found) > 1:
            odds = found[True].ranked()[0].log_posterior - found[False].ranked()[0].log_posterior
            self.sound = bool(expit(odds) >= NAMED)
        return found[self.sound]

    def _searched(self, normal: Normal, remainders: bool) -> Search:
        reduced = self.reduce(normal)
        units, candidates = self.candidates(reduced)
        if not remainders:
            candidates = {m: c for m, c in candidates.items() if not m[0].startswith("remainder:")}
        search = self.searching(reduced, units, candidates, {u: c for u, c in self.closer.items() if u not in self.on})
        search.run()
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

    # ---- sets, each at its own optimum
    def _ahead(self, model: Model, normal: Normal) -> float:
        """Log evidence that a model's step from the point promises, which stays."""
        kept = dict(self.point), set(self.on)
        ahead = self.move(model, normal)
        self.point, self.on = kept
        return ahead

    def settle(self, model: Model, normal: Normal | None = None, steps: int = SETTLING) -> Model:
        """A set at its own optimum, by Gauss-Newton from the present point, which moves there.

        ``normal`` of a model fitted there saves the first step.
        """
        ahead = to_come = np.inf  # log evidence that the last step promised, and that the next one will
        began: Began | None = None
        if normal is not None:
            begun = dict(self.point), set(self.on)
            if self.on <= set(model.units):  # else the step takes something out, by which a set may fit worse
                began = Began(dict(self.point), self._misfits(normal, model, True))
            ahead = to_come = self.move(model, normal)
            if ahead < self.settled:
                return model
            new = {u.id for u in self.units if u.on is not None and len(u.variants) > 1 and u.id in self.on - begun[1]}
            if new:
                return self._settle_secants(model, new, begun)
        # on its way a set may be led by a little bias, where it ends it must not
        for enough, corrected in ((FAR, False), (self.settled, True)):
            for _ in range(steps):
                if to_come < enough:
                    break
                found, at_point, misfits = self._nearer(model, corrected, began)
                began, ended = Began(dict(self.point), misfits) if self.on <= set(model.units) else None, began
                if ended is not None and began is not None and ended.point == began.point:
                    to_come = 0.0
                    break
                before, ahead = ahead, self.move(found, at_point)
                # steps shrink on at least as they did
                to_come = min(ahead, ahead * ahead / before) if 0.0 < before < np.inf else ahead
            left, to_come = to_come, np.inf
        if left > FAR and began is not None:  # what the last steps promised they have not held
            self.point = dict(began.point)
            found.log_posterior -= ahead
        return found

    def _nearer(
        self, model: Model, corrected: bool, began: Began | None
    ) -> tuple[Model, Normal, tuple[float, float | None]]:
        """A set fitted at the present point, or nearer to where the last step began if it fits worse here than there,
        in the end at that point, which is where the point then lies (backtracking; Nocedal and Wright 2006, section
        3.1); and its misfits there."""
        for halving in range(HALVINGS + 1):
            found, at_point = self._fitted(model, corrected)
            misfits = self._misfits(at_point, found, corrected)
            if began is None or halving == HALVINGS or began.holds(misfits, self.settled):
                break
            last = halving == HALVINGS - 1
            self.point = dict(began.point) if last else halfway(began.point, self.point)
        return found, at_point, misfits

    def _misfits(self, normal: Normal, model: Model, corrected: bool) -> tuple[float, float | None]:
        """Half the squared misfit of a set at the present point (nats), with that of the parameters from their priors,
        and the same less the noise's part, where it is known.

        Columns beside the point, which the set is linear in, are at their best.
        """
        apart = sum((mean / sd) ** 2 for mean, sd, _ in (self.prior(n) for n in normal.names if is_parameter(n)))
        misfit = 0.5 * float(normal.c + apart) - self.gained_beside(model, normal)
        return misfit + 0.5 * normal.own, misfit if corrected else None

    def _settle_secants(self, model: Model, new: set[str], begun: tuple[dict[str, float], set[str]]) -> Model:
        """A set of which units have just been switched on, at its own optimum, or without them where it was ``begun``,
        if that is better.

        A secant points the way only: its effect finds its place before anything that a scan proposed or no one has
        described takes it, or finds none. Faults of the measuring chain stay: beside one that is not in the set no
        effect finds its place.
        """
        proposed = {f.id for f in self.described}
        kept = [c for c in model.choices if self._kind(c.unit) != "remainder" and c.unit not in proposed]
        found = self.settle(Model(tuple(kept), 0.0, 0.0, {}, {}))
        if found.log_posterior >= model.log_posterior:
            return found
        there = dict(self.point), set(self.on)
        self.point, self.on = begun
        less = self.settle(Model(tuple(c for c in kept if c.unit not in new), 0.0, 0.0, {}, {}))
        if less.log_posterior > found.log_posterior:
            self.closer |= dict.fromkeys(new, found.log_posterior - less.log_posterior)
            return less
        self.point, self.on = there
        return found

    def inserted(self, model: Model, normal: Normal) -> Inserted:
        """A set at its own optimum, where the point is left as it was; ``normal`` of the present point."""
        key = model.choices, tuple(sorted(self.point.items()))
        if key in self._inserted:
            return self._inserted[key]
        kept = dict(self.point), set(self.on), dict(self.sizes)
        found = self.settle(model, normal)
        values = self.values()
        own = {
            u: {self.parameters[n].alias or n: d for n, d in sizes.items()}
            for u, sizes in self.sizes.items()
            if u in found.units
        }
        self.point, self.on, self.sizes = kept
        beside = {n: d for n, d in found.deviations.items() if not is_parameter(n)}
        self._inserted[key] = Inserted(values, beside, own)
        return self._inserted[key]

    def _fitted(self, model: Model, corrected: bool = True) -> tuple[Model, Normal]:
        """A set fitted by the linear model of the present point, and that model; its members' widths stay."""
        shaped = {u.id for u in self.units if u.on is not None and u.id in self.on}
        choices = tuple(
            replace(c, variant=c.variant - c.variant % OTHER_FORM) if c.unit in shaped else c for c in model.choices
        )
        this = replace(model, choices=choices)
        at_point = self.normal(self.linearise(this, corrected=corrected), this)
        reduced = self.reduce(at_point)
        search = self.searching(reduced, *self.candidates(reduced))
        width = {
            (c.unit, c.variant if (c.unit, c.variant) in search.candidates else c.variant % OTHER_FORM): c.width
            for c in choices
        }
        fixed = {m: w for m, w in width.items() if w in search.candidates[m].widths}
        return search.fit(tuple(width), fixed), at_point

    def _leave_out(self, search: Search, normal: Normal) -> bool:
        """Compare the leading set with those that lack one member, or have a listed effect in the place of a described
        form, each at its own optimum; whether one is better.

        What the linear model says of them from a point far from theirs is replaced by what it says at their own.
        """
        best = search.ranked()[0]
        members = [u for u in best.units if not u.startswith("remainder:")]
        if not members:
            return False
        begun = dict(self.point), set(self.on)
        leading = self.settle(best, normal)
        top = leading.log_posterior
        better = (dict(self.point), set(self.on)), False
        for unit in members:
            self.point, self.on = dict(begun[0]), set(begun[1])
            less = search.fit(tuple((c.unit, c.variant) for c in best.choices if c.unit != unit))
            self.move(less, normal)  # where the linear model has the set's optimum
            own = self.settle(Model(less.choices, 0.0, 0.0, {}, {}))
            error = best.log_posterior - less.log_posterior - (leading.log_posterior - own.log_posterior)
            if self._by_secant(unit):
                self.closer[unit] = -error
            less.log_posterior += error
            if own.log_posterior > top:
                top, better = own.log_posterior, ((dict(self.point), set(self.on)), True)
        for listed in self._listed_instead(search, best):
            self.point, self.on = dict(begun[0]), set(begun[1])
            self.move(listed, normal)
            own = self.settle(Model(listed.choices, 0.0, 0.0, {}, {}))
            if own.log_posterior > top:
                top, better = own.log_posterior, ((dict(self.point), set(self.on)), True)
        self.point, self.on = better[0] if better[1] else begun
        return better[1]

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
        begun = dict(self.point), set(self.on)

        def at_its_own(model: Model) -> float:
            self.point, self.on = dict(begun[0]), set(begun[1])
            self.move(model, normal)
            return self.settle(Model(model.choices, 0.0, 0.0, {}, {})).log_posterior

        leading = at_its_own(best)
        for unit, rival, model in rivals:
            error = at_its_own(model) - leading - (model.log_posterior - best.log_posterior)
            for other in search.seen.values():
                if rival in other.units and unit not in other.units:
                    other.log_posterior += error
        self.point, self.on = begun

    def _listed_instead(self, search: Search, best: Model) -> list[Model]:
        """A set with each of the likeliest listed effects in the place of each of its described forms.

        A far optimum may look from here less like the effect that it is than like a form.
        """
        out = []
        for form in (f.id for f in self.described if f.id in best.units):
            rest = tuple((c.unit, c.variant) for c in best.choices if c.unit != form)
            sets = [
                (*rest, m)
                for m in search.candidates
                if self._kind(m[0]) in LISTED and m[1] < OTHER_FORM and m[0] not in best.units
            ]
            likeliest: dict[str, Model] = {}  # variant of each effect
            for members in sets:
                if np.isfinite(search.log_prior(members)):
                    found, effect = search.fit(members), members[-1][0]
                    if effect not in likeliest or found.log_posterior > likeliest[effect].log_posterior:
                        likeliest[effect] = found
            out += sorted(likeliest.values(), key=lambda m: -m.log_posterior)[:SINGLES]
        return out

    def _by_secant(self, unit: str) -> bool:
        return any(p.secant is not None for u in self.units if u.id == unit for p in u.parameters)

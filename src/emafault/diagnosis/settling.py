"""A set at its own optimum: Gauss-Newton steps of the point that are halved where the set fits worse after them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .described import Described
from .evidence import SETTLED, Normal
from .linear import OwnForm
from .normal import NormalEquations
from .point import Place, is_parameter
from .search import NEAR, Search
from .sets import OTHER_FORM, Model

STEPS = 3  # of a set to its own optimum
SHORTER = (0.1, 0.5)  # least and most of a step after which a set fits worse, that is tried next
FAR = 1e3  # log evidence that a step promises, beyond which its own bias does not matter, nor by how much


@dataclass(frozen=True)
class Began:
    """Where a step began: the point, its misfit (nats) with the noise's part and, where that is known, without, and the
    log evidence that the step promised; and where it ends if factors are added to, not multiplied."""

    point: dict[str, float]
    misfits: tuple[float, float | None]
    promised: float
    instead: dict[str, float]

    def rise(self, after: tuple[float, float | None]) -> float:
        """By how much the misfit is larger after the step."""
        whole, less = self.misfits
        return after[1] - less if less is not None and after[1] is not None else after[0] - whole

    def shorter(self, share: float, rise: float) -> float:
        """Share of the step to be tried after ``share`` of it: the minimum of the parabola through both misfits with
        the slope that was promised (Nocedal and Wright 2006, section 3.5)."""
        least, most = SHORTER
        if not np.isfinite(self.promised):
            return most * share
        slope = 2.0 * self.promised * share
        return share * min(max(0.5 * slope / (rise + slope), least), most)


@dataclass
class Inserted:
    """A fitted set as a model of other recordings: all values, and what stands beside them.

    ``beside``: coefficients of remainders and own forms by column; ``own``: units that carry their own form.
    """

    values: dict[str, float]
    beside: dict[str, float]
    own: dict[str, OwnForm]


def between(one: Mapping[str, float], other: Mapping[str, float], share: float) -> dict[str, float]:
    """The point that lies a share of the way from one to another."""
    return {n: one[n] + share * (x - one[n]) for n, x in other.items()}


class Settling(NormalEquations):
    """Recordings of one machine, with sets at their own optimum."""

    searching: type[Search] = Search
    settled = SETTLED

    def __init__(self, machine, recordings: Sequence[str], processes: int = 1):
        super().__init__(machine, recordings, processes)
        self.closer: dict[str, float] = {}  # what a closer look took off the log evidence that a secant gave a unit
        self._inserted: dict[tuple, Inserted] = {}

    @property
    def described(self) -> tuple[Described, ...]:
        """Forms that have been proposed."""
        return self.machine.forms

    def settle(self, model: Model, normal: Normal | None = None, steps: int = STEPS) -> Model:
        """A set at its own optimum, by Gauss-Newton from the present point, which moves there.

        ``normal`` of a model fitted there saves the first step.
        """
        ahead = to_come = np.inf  # log evidence that the last step promised, and that the next one will
        began: Began | None = None
        if normal is not None:
            begun = self.here()
            at, misfits = dict(self.point), self._misfits(normal, model, True)
            ahead = to_come = self.move(model, normal)
            if begun.on <= set(model.units):  # else the step takes something out, by which a set may fit worse
                began = Began(at, misfits, ahead, self.instead)
            if ahead < self.settled:
                return model
            new = {u.id for u in self.units if u.on is not None and len(u.variants) > 1 and u.id in self.on - begun.on}
            if new:
                return self._settle_secants(model, new, begun)
        # on its way a set may be led by a little bias, where it ends it must not
        for enough, corrected in ((FAR, False), (self.settled, True)):
            for _ in range(steps):
                if to_come < enough:
                    break
                found, at_point, misfits = self._nearer(model, corrected, began)
                at, keeps = dict(self.point), self.on <= set(model.units)
                if began is not None and keeps and began.point == at:
                    to_come = 0.0
                    break
                before, ahead = ahead, self.move(found, at_point)
                began = Began(at, misfits, ahead, self.instead) if keeps else None
                # steps shrink on at least as they did
                to_come = min(ahead, ahead * ahead / before) if 0.0 < before < np.inf else ahead
            left, to_come = to_come, np.inf
        if left > FAR and began is not None:  # what the last steps promised they have not held
            self.point = dict(began.point)
            found.log_posterior -= ahead
        found.log_posterior -= self.unreached  # its optimum lies where no nuisance may go
        return found

    def at_its_own(self, model: Model, normal: Normal) -> Model:
        """A set at its own optimum, from where the linear model of the present point has it; the point stays."""
        begun = self.here()
        self.move(model, normal)
        found = self.settle(Model(model.choices))
        self.go_to(begun)
        return found

    def _nearer(
        self, model: Model, corrected: bool, began: Began | None
    ) -> tuple[Model, Normal, tuple[float, float | None]]:
        """A set fitted at the present point, or nearer to where the last step began if it fits worse than there, in the
        end at that point once a shorter step promises nothing (backtracking; Nocedal and Wright 2006, section 3.1); and
        its misfits where the point then lies.

        In logarithms of factors a product is linear, in the factors themselves a sum: what fits worse after a step of
        the former may fit better after one of the latter.
        """
        share, whole = 1.0, dict(self.point)
        ends = [] if began is None else [began.instead]
        rises: list[tuple[float, dict[str, float]]] = []
        while True:
            found, at_point = self._fitted(model, corrected)
            misfits = self._misfits(at_point, found, corrected)
            if began is None or share == 0.0 or (rise := began.rise(misfits)) < self.settled:
                return found, at_point, misfits
            if share == 1.0:
                rises.append((rise, whole))
                if ends:
                    whole = ends.pop()
                    self.point = dict(whole)
                    continue
                rise, whole = min(rises, key=lambda r: r[0])
            share = began.shorter(share, rise)
            if 2.0 * share * min(began.promised, FAR) < self.settled:
                share = 0.0
            self.point = between(began.point, whole, share)

    def _misfits(self, normal: Normal, model: Model, corrected: bool) -> tuple[float, float | None]:
        """Half the squared misfit of a set at the present point (nats), with that of the parameters from their priors,
        and the same less the noise's part, where it is known.

        Columns beside the point, which the set is linear in, are at their best.
        """
        own = [*self.nuisances, *(n for n in model.deviations if is_parameter(n))]
        apart = sum((mean / sd) ** 2 for mean, sd, _ in map(self.prior, own))
        misfit = 0.5 * float(normal.c + apart) - self.gained_beside(model, normal)
        return misfit + 0.5 * normal.own, misfit if corrected else None

    def _settle_secants(self, model: Model, new: set[str], begun: Place) -> Model:
        """A set of which units have just been switched on, at its own optimum, or without them where it was ``begun``,
        if that is better.

        A secant points the way only: its effect finds its place before anything that a scan proposed or no one has
        described takes it, or beside that where the set fits better with both, or finds none. Faults of the measuring
        chain stay: beside one that is not in the set no effect finds its place.
        """
        proposed = {f.id for f in self.described}
        kept = tuple(c for c in model.choices if self._kind(c.unit) != "remainder" and c.unit not in proposed)
        switched = self.here()
        found, there = self.settle(Model(kept)), self.here()
        if len(kept) < len(model.choices):
            self.go_to(switched)
            whole = self.settle(Model(model.choices))
            if whole.log_posterior > found.log_posterior:
                found, there, kept = whole, self.here(), model.choices
            self.go_to(there)
        if found.log_posterior >= model.log_posterior:
            return found
        self.go_to(begun)
        less = self.settle(Model(tuple(c for c in kept if c.unit not in new)))
        if less.log_posterior > found.log_posterior:
            self.closer |= dict.fromkeys(new, found.log_posterior - less.log_posterior)
            return less
        self.go_to(there)
        return found

    def inserted(self, model: Model, normal: Normal) -> Inserted:
        """A set at its own optimum, where the point is left as it was; ``normal`` of the present point."""
        key = model.choices, tuple(sorted(self.point.items()))
        if key in self._inserted:
            return self._inserted[key]
        kept, sizes = self.here(), dict(self.sizes)
        found = self.settle(model, normal)
        values = self.values()
        beside: dict[str, float] = {}
        if not all(map(is_parameter, found.deviations)):
            # the point need not be where the model would have it, along what its own columns make up for
            beside = self.beside(found, self._fitted(found)[1])
        own = self.own_forms(found)
        self.go_to(kept)
        self.sizes = sizes
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

    def _by_own_variants(self, model: Model) -> Model:
        """A set that the point has settled at, with the variant of each unit whose variants look alike near off that is
        best at its own optimum, where the point moves; one that its first step does not bring near is not followed."""
        alike = {u.id: u for u in self.units if u.alike}
        for unit in (alike[u] for u in model.units if u in alike):
            ends = [(model, self.here())]
            amount = sum(self.point[p.name] for p in unit.parameters)
            for v, variant in enumerate(unit.variants):
                if v in [c.variant for c in model.choices if c.unit == unit.id]:
                    continue
                self.go_to(ends[0][1])
                self.point |= {p.name: p.off for p in unit.parameters} | {p.name: amount for p in variant.parameters}
                other = Model(tuple(replace(c, variant=v) if c.unit == unit.id else c for c in model.choices))
                if self._fitted(other)[0].log_posterior > ends[0][0].log_posterior - NEAR:
                    ends.append((self.settle(other), self.here()))
            model, place = max(ends, key=lambda e: e[0].log_posterior)
            self.go_to(place)
        return model

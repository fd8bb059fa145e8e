"""Log predictive ratios of sets on the recordings that took no part in fitting them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..diagnosis.closure import Ladder
from ..diagnosis.evidence import CLEAR, Definite
from ..diagnosis.fit import Bench, Fit
from ..diagnosis.linear import White, assemble
from ..diagnosis.model import LISTED
from ..diagnosis.naming import PRESENT
from ..diagnosis.point import is_parameter
from ..diagnosis.search import Search
from ..diagnosis.sets import Model, inclusion
from ..diagnosis.settling import Inserted


@dataclass(frozen=True)
class Explored:
    """The fit to the explored recordings, and the ladder on which it predicts the others."""

    bench: Bench
    fit: Fit
    ladder: Ladder


class Account:
    """Log predictive ratios on the confirm recordings."""

    def __init__(self, explored: Explored, named: Sequence[str]):
        self.explored, self.search = explored, explored.fit.search
        self.leading = next((m for m in explored.fit.models if set(named) <= set(m.units)), explored.fit.models[0])
        self.gone: set[str] = set()
        self.instead_of: dict[str, int] = {}  # remainders in the place of what is gone, and their variants
        self.misfits: dict[tuple, float] = {}  # of sets, and of sets less a unit

    def let_go(self, unit: str, left: bool = False) -> None:
        """A unit that is not told: from here on it stands in for no other; ``left``: a remainder does in its place."""
        first = self._likeliest(unit)
        self.gone.add(unit)
        if left and first is not None:
            instead = less(self.search, first, unit, True)
            self.instead_of |= {c.unit: c.variant for c in instead.choices if c.unit not in first.units}
            self.gone -= set(self.instead_of)
        self.leading = self._left(self.leading)

    def let_go_absent(self, models: Sequence[Model]) -> None:
        """Forms and remainders that the sets of all recordings say are more likely not there."""
        units, present = self.search.units, {u for u, p in inclusion(models).items() if p >= PRESENT}
        for unit in self.leading.units:
            if units[unit].kind not in LISTED and unit not in present:
                self.let_go(unit, any(f"remainder:{e}" in present for e in units[unit].equations))

    def _left(self, model: Model) -> Model:
        """A set less what has been let go, with what takes its place."""
        if self.gone.isdisjoint(model.units) and set(self.instead_of) <= set(model.units):
            return model
        members = self.instead_of | {c.unit: c.variant for c in model.choices if c.unit not in self.gone}
        return self.search.fit(tuple(members.items()))

    def counterpart(self, told: Model) -> Model:
        """The explored recordings' set of what a set of all recordings has, as far as they have columns of it."""
        known = {c.unit: c.variant for c in self.leading.choices}
        members = [(c.unit, known.get(c.unit, c.variant)) for c in told.choices]
        return self.search.fit(tuple(m for m in members if m in self.search.candidates))

    @property
    def base(self) -> Model:
        """The leading set less its listed effects."""
        units = self.search.units
        return self.search.fit(
            tuple((c.unit, c.variant) for c in self.leading.choices if units[c.unit].kind not in LISTED)
        )

    def ratio(self, unit: str) -> float:
        """Of a set with a unit over the same without it; 0 where the explored recordings never had the unit."""
        self.gone.discard(unit)
        inside = self.leading
        if unit not in inside.units or self._misfit(self.leading) > self._misfit(self.base) + 2.0 * CLEAR:
            first = self._likeliest(unit)
            if first is None:
                return 0.0
            mine = [(c.unit, c.variant) for c in self.base.choices if c.unit != unit]
            mine += [(c.unit, c.variant) for c in first.choices if c.unit == unit]
            inside = self.search.fit(tuple(mine))
        ratio = self._over_less(inside, unit)
        return ratio if self.search.units[unit].kind in LISTED else min(ratio, self._by_itself(inside, unit))

    def of_remainder(self, unit: str) -> float:
        """Of the likeliest set with a remainder over the same without it; 0 where the explored recordings had none."""
        self.gone.discard(unit)
        first = self._likeliest(unit)
        return 0.0 if first is None else min(self._over_less(first, unit), self._by_itself(first, unit))

    def instead(self, unit: str) -> float:
        """Of the likeliest set with a unit, a remainder in that one's place, over the same with nothing there; 0 where
        the explored recordings never had the unit."""
        first = self._likeliest(unit)
        if first is None:
            return 0.0
        nothing, instead = (less(self.search, first, unit, left) for left in (False, True))
        ratio = 0.5 * (self._misfit(nothing) - self._misfit(instead))
        added = set(instead.units) - set(nothing.units)
        return min([ratio, *(self._by_itself(instead, u) for u in added)])

    def _likeliest(self, unit: str) -> Model | None:
        """Of the explored recordings' sets with a unit, less what has been let go."""
        found = next((m for m in self.explored.fit.models if unit in m.units), None)
        return None if found is None else self._left(found)

    def _over_less(self, inside: Model, unit: str) -> float:
        return 0.5 * (self._misfit(self.search.less(inside, unit)) - self._misfit(inside))

    def _by_itself(self, inside: Model, unit: str) -> float:
        """Of a set over the same with a form or remainder taken out and all else where it is: what it gains beyond that
        it has from what others need not stand in for, which is no sign of it in the confirm recordings."""
        return 0.5 * (self._misfit(inside, unit) - self._misfit(inside))

    def _misfit(self, model: Model, out: str = "") -> float:
        key = model.choices, out
        if key not in self.misfits:
            self.misfits[key] = _misfit(self.explored, model, out)
        return self.misfits[key]


def less(search: Search, model: Model, unit: str, left: bool) -> Model:
    """A set less a unit, with a remainder in its place if asked, in the one of the unit's equations where that explains
    most."""
    members = tuple((c.unit, c.variant) for c in model.choices if c.unit != unit)
    equations = search.units[unit].equations if left else ()
    places = {u for q in equations for u, v in search.candidates if u.startswith(f"remainder:{q}")}
    if not places or places & {u for u, _ in members}:
        return search.fit(members)
    found = [search.fit((*members, (p, 0))) for p in sorted(places)]
    return max(found, key=lambda m: m.log_posterior)


def _misfit(explored: Explored, model: Model, out: str = "") -> float:
    """-2 log predictive density of the confirm recordings under a set fitted to the explored ones, up to a constant;
    ``out``: a unit of it that is taken out once it is fitted.

    Remainders are integrated: what all recordings share over the posterior of the explored ones, what each has of its
    own over its prior. The noise's part of the misfit, which goes with the coefficients that noise is multiplied by, is
    taken out.
    """
    ladder, fit = explored.ladder, explored.fit
    inserted = explored.bench.inserted(model, fit.normal)
    if out:
        model, inserted = _taken_out(explored, model, inserted, out)
    also = [n for n in model.deviations if is_parameter(n)]
    shared, own = _remainders(fit.search, model)
    whites = ladder.blocks(
        inserted.values, remainders=bool(shared or own), also=also, inserted=inserted, corrected=True
    )
    found = _occam(explored, whites, model) + sum(w.misfit for w in whites)
    if not shared and not own:
        return found
    seen = dict.fromkeys(n for w in whites for n in w.names if n.startswith("remainder."))
    single = [n for n in seen if "@" in n and n.split(".")[1] in own]
    common = [n for n in seen if n in shared]
    normal = assemble(whites, [*common, *single], {})
    precision = np.diag([0.0] * len(common) + [own[n.split(".")[1]] ** -2 for n in single])
    k = np.array([fit.search.reduced.index[n] for n in common], int)
    precision[: len(k), : len(k)] = fit.search.reduced.M[np.ix_(k, k)] + np.diag([shared[n] ** -2 for n in common])
    after = Definite(normal.H + precision)
    found -= float(normal.g @ after.solve(normal.g))
    return found + 2.0 * (after.half_log_determinant() - Definite(precision).half_log_determinant())


def _taken_out(explored: Explored, model: Model, inserted: Inserted, unit: str) -> tuple[Model, Inserted]:
    """A fitted set less one of its forms or remainders, all else where it is."""
    names = {
        n for c in model.choices if c.unit == unit for n in explored.fit.search.candidates[c.unit, c.variant].names
    }
    off: dict[str, float] = {}
    for n, p in explored.bench.parameters.items():
        if n in names:
            off[n] = p.off
            if p.alias:  # its quantity has what is beyond the tolerance in it
                off[p.alias] = off.get(p.alias, inserted.values[p.alias]) - inserted.values[n]
    left = tuple(c for c in model.choices if c.unit != unit)
    deviations = {n: d for n, d in model.deviations.items() if n not in names}
    beside = {n: x for n, x in inserted.beside.items() if n not in names}
    return replace(model, choices=left, deviations=deviations), replace(
        inserted, values=inserted.values | off, beside=beside
    )


def _remainders(search: Search, model: Model) -> tuple[dict[str, float], dict[str, float]]:
    """Prior standard deviations of a set's remainders: by column that all recordings share, and by equation of which
    each recording has columns of its own."""
    shared, own = {}, {}
    for c in model.choices:
        candidate = search.candidates[c.unit, c.variant]
        if search.units[c.unit].kind == "remainder":
            for n, sd in zip(candidate.names, c.width * candidate.sd, strict=True):
                if "@" in n:
                    own[n.split(".")[1]] = float(sd)
                else:
                    shared[n] = float(sd)
    return shared, own


def _occam(explored: Explored, whites: Sequence[White], model: Model) -> float:
    """What a model loses for parameters that each confirm recording has its own of: twice the log of how much narrower
    the recording makes them."""
    width: dict[str, float] = {}  # of the parameters of a recording, by name without it
    for c in model.choices:
        for n in explored.fit.search.candidates[c.unit, c.variant].names:
            if is_parameter(n) and "@" in n:
                width[n.rsplit("@", 1)[0]] = c.width
    found = 0.0
    for recording in explored.ladder.recordings if width else ():
        mine = [w for w in whites if w.recording == recording]
        names = [n for n in dict.fromkeys(n for w in mine for n in w.names) if n.rsplit("@", 1)[0] in width]
        sd = np.array([width[n.rsplit("@", 1)[0]] * explored.ladder.parameters[n].sd for n in names])
        H = assemble(mine, names, {}).H
        found += float(np.linalg.slogdet(np.eye(len(names)) + H * np.outer(sd, sd))[1])
    return found

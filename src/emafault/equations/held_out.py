"""Whether what was named holds on the recordings that took no part in naming it."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logsumexp

from ..diagnosis import predictive
from ..diagnosis.closure import Ladder
from ..diagnosis.constancy import log_odds_of_another_cause, log_odds_of_change
from ..diagnosis.dispersion import overdispersion
from ..diagnosis.evidence import CLEAR, Definite
from ..diagnosis.fit import Bench, Fit
from ..diagnosis.linear import White, assemble
from ..diagnosis.model import LISTED, meet
from ..diagnosis.naming import OWN_BUSINESS, PRESENT, read
from ..diagnosis.point import is_parameter
from ..diagnosis.search import NEAR, Search
from ..diagnosis.sets import Model, inclusion
from ..diagnosis.settling import Inserted


@dataclass(frozen=True)
class Explored:
    """The fit to the explored recordings, and the ladder on which it predicts the others."""

    bench: Bench
    fit: Fit
    ladder: Ladder


@dataclass(frozen=True)
class HeldOut:
    """The fit to the explored recordings, and what the others say of names.

    ``ratios``: log predictive ratio by effect and form; ``changes``: by effect, log odds that it has another size in
    each recording; ``leading``: the explored recordings' set of what the likeliest set of all recordings has by then.
    """

    explored: Explored
    ratios: Mapping[str, float]
    changes: Mapping[str, float]
    leading: Model


def held_to_account(
    bench: Bench, fit: Fit, named: Sequence[str], explored: Explored, wandering: Mapping[str, float]
) -> tuple[list[Model], HeldOut]:
    """Sets of all recordings, those less likely that hold what makes the confirm recordings worse.

    What is told because the noise scatters by more than its model allows for has its likelihood ratio divided by the
    overdispersion of its score, and what it loses goes to the same set without it: see ``dispersion``.

    The explored recordings are fitted with a named effect and without; both predict the confirm recordings, frozen. One
    whose prediction is clearly the worse, or that by these odds is not there, has the odds that the explored recordings
    gave it times the ratio of the predictive densities (Bayes' rule one part of the data after the other), instead of
    those of all data together. What it loses goes to the same set without it, and where its prediction is the worse
    with a remainder in its place if the confirm recordings clearly confirm that: no other effect has been shown. What
    is named in consequence is held to account in turn, and so is a group, for which its likeliest member stands. Where
    the explored recordings' set as a whole predicts worse than without its effects, each is tried by itself.

    Where there is a remainder (one of the controller's equations: for what acts there), or what is left wanders
    (``wandering``: by equation, log odds that it does), or in an effect's equation a form or a remainder was seen that
    the confirm recordings do not confirm, none of the sets is the true one, and what the explored recordings give a set
    is no odds of its truth (the M-open view: Bernardo and Smith 1994, Bayesian Theory, 6.1.2): there the predictive
    densities of the confirm recordings decide by themselves, beside the prior.

    What has another size in each recording, or another form, is held to account likewise: see ``constancy``.

    A described form has been looked for in the explored recordings, and is told only where the others clearly confirm
    it, one of the measuring chain too; so is a remainder, which takes up whatever the model has of the noise wrong, by
    itself and in the place of a form that is not told. What is not told is left out of the sets that others are
    compared within from then on: of two causes that explain the same, neither is missed beside the other. So is, from
    the start, what the sets of all recordings hold to be more likely not there.

    Parameters
    ----------
    bench, fit : of all recordings
    named : what the sets of that fit name

    Returns
    -------
    sets, most probable first, and what the confirm recordings say
    """
    sets, account = _Sets(bench, fit), _Account(explored, named)
    ratios: dict[str, float] = {}
    changes: dict[str, float] = {}
    account.let_go_absent(sets.models)
    _ask_remainders(sets, account, ratios)
    # what is told of effects depends on whether what is described beside them is there, or a remainder in its place
    _ask_forms(sets, account, ratios)
    for told, incomplete in sets.told(ratios, wandering):
        effect = max(told, key=lambda u: sets.log_mass((u,)))  # of a group the likeliest stands for all
        ratio = account.ratio(effect)
        ratios |= dict.fromkeys(told, ratio)
        explored_odds = _log_odds(explored.fit.models, told)
        odds = (sets.log_prior_odds(effect) if incomplete else explored_odds) + ratio
        decides = incomplete or ratio < -CLEAR or odds < 0.0
        # of what the explored recordings have no columns they say nothing
        if np.isfinite(explored_odds) and decides and odds < _log_odds(sets.models, told):
            left = ratio < -CLEAR and account.instead(effect) >= CLEAR
            sets.add_without(effect, left, sets.log_mass(told) - odds)
        sets.add_dispersed(effect, told)
        sets.add_at_their_own(effect, told)
        leading = sets.leading(effect)
        change = log_odds_of_change(bench, fit, leading, effect)
        changes |= dict.fromkeys(told, change)
        other = np.logaddexp(change, log_odds_of_another_cause(fit, leading, effect, sets.lacking(leading)))
        # where hardly any probability goes to another size or cause, a remainder there need not be confirmed
        left = other < -CLEAR or account.instead(effect) >= CLEAR
        sets.add_without(effect, left, sets.log_mass(told) + other)
    _ask_forms(sets, account, ratios)  # those that only now would be told
    models = sorted(sets.models, key=lambda m: -m.log_posterior)
    return models, HeldOut(explored, ratios, changes, account.counterpart(models[0]))


def misfits(found: HeldOut) -> dict[str, float]:
    """Log odds by equation that the confirm recordings have other values than those of the leading set: see
    ``predictive``.

    What an equation lacks draws what it shares with others to where those are missed too: one after the other, the
    equation that is missed most has a remainder when the others are asked, and those are missed that are by then too.
    """
    explored, model = found.explored, found.leading
    out: dict[str, float] = {}
    given: list[str] = []  # equations that have a remainder by then
    while True:
        inserted = explored.bench.inserted(model, explored.fit.normal)
        also = [n for n in model.deviations if is_parameter(n)]
        confirm = explored.ladder.blocks(inserted.values, also=also, inserted=inserted)
        odds = predictive.log_odds(explored.bench, explored.fit, model, confirm)
        out |= {e: min(o, out.get(e, np.inf)) for e, o in odds.items() if e not in given}
        remainders = {e: (f"remainder:{e}", 0) for e, o in out.items() if o > 0.0}
        missed = [e for e, r in remainders.items() if r in explored.fit.search.candidates and r[0] not in model.units]
        if not missed:
            return out
        given.append(max(missed, key=lambda e: out[e]))
        members = [(c.unit, c.variant) for c in model.choices]
        model = explored.fit.search.fit((*members, remainders[given[-1]]))


def _ask_remainders(sets: "_Sets", account: "_Account", ratios: dict[str, float]) -> None:
    """Hold the remainders to account that the sets would tell."""
    for remainder in sets.untold(ratios, "remainder"):
        ratios[remainder] = account.of_remainder(remainder)
        if ratios[remainder] < CLEAR:
            sets.unexplained.add(remainder.removeprefix("remainder:"))
            sets.drop(remainder, False)
            account.let_go(remainder)


def _ask_forms(sets: "_Sets", account: "_Account", ratios: dict[str, float]) -> None:
    """Hold the described forms to account that the sets would tell."""
    for form in sets.untold(ratios, "form"):
        ratios[form] = account.ratio(form)
        sets.add_dispersed(form, (form,))
        if ratios[form] < CLEAR:
            sets.unexplained |= set(sets.fit.search.units[form].equations)
            leading = sets.leading(form)
            without, instead = (_less(sets.fit.search, leading, form, left) for left in (False, True))
            left = instead.log_posterior > without.log_posterior and account.instead(form) >= CLEAR
            sets.drop(form, left)
            account.let_go(form, left)


class _Sets:
    """The sets of all recordings, as what is held to account leaves them."""

    def __init__(self, bench: Bench, fit: Fit):
        self.bench, self.fit, self.models = bench, fit, list(fit.models)
        self.unexplained: set[str] = set()  # equations of forms and remainders that were seen but not confirmed

    def told(
        self, ratios: Mapping[str, float], wandering: Mapping[str, float]
    ) -> Iterator[tuple[tuple[str, ...], bool]]:
        """Listed effects that the sets, as they are by then, would name, and groups, not yet held to account; and
        whether the sets lack something: there is a remainder beside them, of the controller's own business only where
        they act, or in their equations a form or a remainder was seen that is not confirmed."""
        while True:
            found = read(self.models, self.fit.search.units.values(), wandering=wandering)
            left = [t for t in (*((e,) for e in found.named), *found.groups) if not set(t) <= set(ratios)]
            if not left:
                return
            incomplete = not set(found.remainders) <= set(OWN_BUSINESS)
            beside = self.unexplained | {r.removeprefix("remainder:") for r in found.remainders}
            units = self.fit.search.units
            yield left[0], incomplete or any(meet(units[e].equations, beside) for e in left[0])

    def untold(self, ratios: Mapping[str, float], kind: str) -> Iterator[str]:
        """Forms or remainders that the sets, as they are by then, would tell, not yet held to account."""
        units = self.fit.search.units
        while True:
            found = read(self.models, units.values())
            told = {u for u in (*found.forms, *found.remainders) if u not in ratios and units[u].kind == kind}
            left = next((u for u in inclusion(self.models) if u in told), None)
            if left is None:
                return
            yield left

    def leading(self, unit: str) -> Model:
        """The likeliest set with a unit."""
        return max((m for m in self.models if unit in m.units), key=lambda m: m.log_posterior)

    def lacking(self, model: Model) -> set[str]:
        """Equations in which a set has a remainder, or something was seen that is not confirmed."""
        return self.unexplained | {u.removeprefix("remainder:") for u in model.units if u.startswith("remainder:")}

    def log_mass(self, units: Collection[str]) -> float:
        """Log mass of the sets that hold one of some units."""
        return float(logsumexp([m.log_posterior for m in self.models if not set(units).isdisjoint(m.units)]))

    def log_prior_odds(self, unit: str) -> float:
        """Log prior odds of the likeliest set with a unit over the same without it."""
        members = [(c.unit, c.variant) for c in self.leading(unit).choices]
        log_prior = self.fit.search.log_prior
        return log_prior(members) - log_prior([m for m in members if m[0] != unit])

    def add_without(self, unit: str, left: bool, mass: float) -> None:
        """Adds the likely sets with a unit, each less that one, with or without a remainder in its place, which share a
        mass (log) as they did."""
        mine = [m for m in self.models if unit in m.units]
        top = max(m.log_posterior for m in mine)
        likely = [m for m in mine if m.log_posterior > top - NEAR]
        all_of = logsumexp([m.log_posterior for m in likely])
        self.models += [
            replace(_less(self.fit.search, m, unit, left), log_posterior=float(m.log_posterior - all_of + mass))
            for m in likely
        ]

    def drop(self, unit: str, left: bool) -> None:
        """Takes a unit out of all sets, with or without a remainder in its place."""
        self.add_without(unit, left, self.log_mass((unit,)))
        self.models = [m for m in self.models if unit not in m.units]

    def add_at_their_own(self, unit: str, told: Collection[str]) -> None:
        """Adds the likely sets with a unit, each less that one, by the odds of the likeliest at its own optimum to the
        same set without the unit at its own, where the fit ended at another set, with what is not told: the linear
        model is one of that set's point.
        """
        leading = self.leading(unit)
        if leading.units == self.fit.models[0].units:
            return
        both = leading, self.fit.search.less(leading, unit)
        inside, less = (self.bench.at_its_own(model, self.fit.normal).log_posterior for model in both)
        self.add_without(unit, False, self.log_mass(told) - (inside - less))

    def add_dispersed(self, unit: str, told: Collection[str]) -> None:
        """Adds the likely sets with a unit, each less that one, with what is ``told`` loses where its score is
        overdispersed.

        Of a unit by itself that is of its odds against all other sets; of a group, whose members stand in for each
        other, of its likelihood ratio against nothing in its place.
        """
        leading = self.leading(unit)
        dispersion = overdispersion(self.bench, self.fit, leading, unit)
        if dispersion == 1.0:
            return
        gain = leading.log_likelihood - self.fit.search.less(leading, unit).log_likelihood
        prior = self.log_prior_odds(unit)
        if len(told) == 1:
            gain = min(gain, _log_odds(self.models, told) - prior)
        self.add_without(unit, False, self.log_mass(told) - (prior + max(gain, 0.0) / dispersion))


class _Account:
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
            instead = _less(self.search, first, unit, True)
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
        nothing, instead = (_less(self.search, first, unit, left) for left in (False, True))
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


def _less(search: Search, model: Model, unit: str, left: bool) -> Model:
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


def _log_odds(models: Sequence[Model], units: Collection[str]) -> float:
    """Log odds, over the sets seen, that one of some units is there."""
    inside = [m.log_posterior for m in models if not set(units).isdisjoint(m.units)]
    outside = [m.log_posterior for m in models if set(units).isdisjoint(m.units)]
    if not inside or not outside:
        return np.inf if inside else -np.inf
    return float(logsumexp(inside) - logsumexp(outside))

"""Whether what was named holds on the recordings that took no part in naming it."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logsumexp

from ..diagnosis import predictive
from ..diagnosis.constancy import log_odds_of_another_cause, log_odds_of_change
from ..diagnosis.dispersion import overdispersion
from ..diagnosis.evidence import CLEAR
from ..diagnosis.fit import Bench, Fit
from ..diagnosis.model import meet
from ..diagnosis.naming import OWN_BUSINESS, read
from ..diagnosis.point import is_parameter
from ..diagnosis.search import NEAR
from ..diagnosis.sets import Model, inclusion
from .predicted import Account, Explored, less


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
    sets, account = _Sets(bench, fit), Account(explored, named)
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


def _ask_remainders(sets: "_Sets", account: "Account", ratios: dict[str, float]) -> None:
    """Hold the remainders to account that the sets would tell."""
    for remainder in sets.untold(ratios, "remainder"):
        ratios[remainder] = account.of_remainder(remainder)
        if ratios[remainder] < CLEAR:
            sets.unexplained.add(remainder.removeprefix("remainder:"))
            sets.drop(remainder, False)
            account.let_go(remainder)


def _ask_forms(sets: "_Sets", account: "Account", ratios: dict[str, float]) -> None:
    """Hold the described forms to account that the sets would tell."""
    for form in sets.untold(ratios, "form"):
        ratios[form] = account.ratio(form)
        sets.add_dispersed(form, (form,))
        if ratios[form] < CLEAR:
            sets.unexplained |= set(sets.fit.search.units[form].equations)
            leading = sets.leading(form)
            without, instead = (less(sets.fit.search, leading, form, left) for left in (False, True))
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
            replace(less(self.fit.search, m, unit, left), log_posterior=float(m.log_posterior - all_of + mass))
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


def _log_odds(models: Sequence[Model], units: Collection[str]) -> float:
    """Log odds, over the sets seen, that one of some units is there."""
    inside = [m.log_posterior for m in models if not set(units).isdisjoint(m.units)]
    outside = [m.log_posterior for m in models if set(units).isdisjoint(m.units)]
    if not inside or not outside:
        return np.inf if inside else -np.inf
    return float(logsumexp(inside) - logsumexp(outside))

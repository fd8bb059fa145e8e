"""Whether what was named holds on the recordings that took no part in naming it."""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logsumexp

from ..diagnosis.closure import Ladder
from ..diagnosis.constancy import log_odds_of_another_cause, log_odds_of_change
from ..diagnosis.dispersion import overdispersion
from ..diagnosis.evidence import CLEAR, Definite
from ..diagnosis.fit import Bench, Fit
from ..diagnosis.linear import White, assemble
from ..diagnosis.model import LISTED
from ..diagnosis.naming import NAMED, OWN_BUSINESS, PRESENT, read
from ..diagnosis.point import is_parameter
from ..diagnosis.search import NEAR, Model, inclusion


@dataclass(frozen=True)
class HeldOut:
    """The fit to the explored recordings, the ladder that it stands on with the others, and what these say of names.

    ``ratios``: log predictive ratio by effect and form; ``changes``: by effect, log odds that it has another size in
    each recording.
    """

    ladder: Ladder
    explored: Bench
    fit: Fit
    ratios: Mapping[str, float]
    changes: Mapping[str, float]


def held_to_account(
    every: Bench,
    whole: Fit,
    named: Sequence[str],
    ladder: Ladder,
    explored: Bench,
    fit: Fit,
    wandering: Mapping[str, float],
) -> tuple[list[Model], dict[str, float], dict[str, float]]:
    """Sets of all recordings, those less likely that hold what makes the confirm recordings worse.

    What is told because the noise scatters by more than its model allows for has its likelihood ratio divided by the
    overdispersion of its score, and what it loses goes to the same set without it: see ``dispersion``.

    The explored recordings are fitted with a named effect and without; both predict the confirm recordings, frozen. One
    whose prediction is clearly the worse, or that by these odds is not there, has the odds that the explored recordings
    gave it times the ratio of the predictive densities (Bayes' rule one part of the data after the other), instead of
    those of all data together. What it loses goes to the same set without it, and where its prediction is the worse
    with a remainder in its place: no other effect has been shown by that. What is named in consequence is held to
    account in turn, and so is a group, for which its likeliest member stands. Where the explored recordings' set as a
    whole predicts worse than without its effects, each is tried by itself.

    Where there is a remainder, or what is left wanders (``wandering``: by equation, log odds that it does), none of the
    sets is the true one, and what the explored recordings give a set is no odds of its truth (the M-open view: Bernardo
    and Smith 1994, Bayesian Theory, 6.1.2): there the predictive densities of the confirm recordings decide by
    themselves, beside the prior.

    What has another size in each recording is held to account likewise: see ``constancy``.

    A described form has been looked for in the explored recordings, and is told only where the others clearly confirm
    it, one of the measuring chain too; so is a remainder, which takes up whatever the model has of the noise wrong, by
    itself and in the place of a form that is not told.

    Returns
    -------
    sets, most probable first, log predictive ratio by effect and form, and by effect the log odds that it has another
    size in each recording
    """
    models = list(whole.models)
    ratios: dict[str, float] = {}
    changes: dict[str, float] = {}
    account = _Account(ladder, explored, fit, named)
    for remainder in _untold(models, ratios, lambda u: whole.search.units[u].kind == "remainder", PRESENT):
        ratios[remainder] = account.of_remainder(remainder)
        if ratios[remainder] < CLEAR:
            moved = _moved(whole, models, remainder, False, _log_mass(models, (remainder,)))
            models[:] = [*(m for m in models if remainder not in m.units), *moved]
    for told, incomplete in _told(whole, models, ratios, wandering):
        effect = max(told, key=lambda u: _log_mass(models, (u,)))  # of a group the likeliest stands for all
        ratio = account.ratio(effect)
        ratios |= dict.fromkeys(told, ratio)
        explored_odds = _log_odds(fit.models, told)
        odds = (_log_prior_odds(whole, _leading(models, effect), effect) if incomplete else explored_odds) + ratio
        decides = incomplete or ratio < -CLEAR or odds < 0.0
        # of what the explored recordings have no columns they say nothing
        if np.isfinite(explored_odds) and decides and odds < _log_odds(models, told):
            models += _moved(whole, models, effect, ratio < -CLEAR, _log_mass(models, told) - odds)
        leading = _leading(models, effect)
        models += _dispersed(every, whole, models, leading, effect, told)
        change = log_odds_of_change(every, whole, leading, effect)
        changes |= dict.fromkeys(told, change)
        other = np.logaddexp(change, log_odds_of_another_cause(whole, leading, effect))
        models += _moved(whole, models, effect, True, _log_mass(models, told) + other)

    for form in _untold(models, ratios, lambda u: whole.search.units[u].kind == "form"):
        ratios[form] = account.ratio(form)
        leading = _leading(models, form)
        models += _dispersed(every, whole, models, leading, form, (form,))
        if ratios[form] < CLEAR:
            left = _less(whole, leading, form, True).log_posterior > _less(whole, leading, form, False).log_posterior
            left = left and account.instead(form) >= CLEAR
            moved = _moved(whole, models, form, left, _log_mass(models, (form,)))
            models[:] = [*(m for m in models if form not in m.units), *moved]
    return sorted(models, key=lambda m: -m.log_posterior), ratios, changes


def _told(
    whole: Fit, models: list[Model], ratios: Mapping[str, float], wandering: Mapping[str, float]
) -> Iterator[tuple[tuple[str, ...], bool]]:
    """Listed effects that the sets, as they are by then, would name, and groups, not yet held to account; and whether
    there is a remainder beside them that is not the controller's own business."""
    while True:
        found = read(models, whole.search.units.values(), wandering=wandering)
        left = [t for t in (*((e,) for e in found.named), *found.groups) if not set(t) <= set(ratios)]
        if not left:
            return
        yield left[0], not set(found.remainders) <= set(OWN_BUSINESS)


def _untold(
    models: list[Model], ratios: Mapping[str, float], which: Callable[[str], bool], told: float = NAMED
) -> Iterator[str]:
    """Units that the sets, as they are by then, would tell, and that have not been held to account."""
    while True:
        left = [u for u, p in inclusion(models).items() if p >= told and u not in ratios and which(u)]
        if not left:
            return
        yield left[0]


class _Account:
    """Log predictive ratios on the confirm recordings."""

    def __init__(self, ladder: Ladder, explored: Bench, fit: Fit, named: Sequence[str]):
        self.ladder, self.explored, self.fit = ladder, explored, fit
        self.leading = next((m for m in fit.models if set(named) <= set(m.units)), fit.models[0])
        kinds = {u.id: u.kind for u in fit.search.units.values()}
        self.base = fit.search.fit(
            tuple((c.unit, c.variant) for c in self.leading.choices if kinds.get(c.unit) not in LISTED)
        )
        self.misfits: dict[tuple, float] = {}

    def ratio(self, unit: str) -> float:
        """Of a set with a unit over the same without it; 0 where the explored recordings never had the unit."""
        inside = self.leading
        if unit not in inside.units or self._misfit(self.leading) > self._misfit(self.base) + 2.0 * CLEAR:
            first = next((m for m in self.fit.models if unit in m.units), None)
            if first is None:
                return 0.0
            mine = [(c.unit, c.variant) for c in self.base.choices if c.unit != unit]
            mine += [(c.unit, c.variant) for c in first.choices if c.unit == unit]
            inside = self.fit.search.fit(tuple(mine))
        return self._over_less(inside, unit)

    def of_remainder(self, unit: str) -> float:
        """Of the likeliest set with a remainder over the same without it; 0 where the explored recordings had none."""
        first = next((m for m in self.fit.models if unit in m.units), None)
        return 0.0 if first is None else self._over_less(first, unit)

    def instead(self, unit: str) -> float:
        """Of the likeliest set with a unit, a remainder in that one's place, over the same with nothing there; 0 where
        the explored recordings never had the unit."""
        first = next((m for m in self.fit.models if unit in m.units), None)
        if first is None:
            return 0.0
        nothing, remainder = (self._misfit(_less(self.fit, first, unit, left)) for left in (False, True))
        return 0.5 * (nothing - remainder)

    def _over_less(self, inside: Model, unit: str) -> float:
        return 0.5 * (self._misfit(self.fit.search.less(inside, unit)) - self._misfit(inside))

    def _misfit(self, model: Model) -> float:
        if model.choices not in self.misfits:
            self.misfits[model.choices] = _misfit(self.ladder, self.explored, self.fit, model)
        return self.misfits[model.choices]


def _log_mass(models: Sequence[Model], units: Collection[str]) -> float:
    """Log mass of the sets that hold one of some units."""
    return float(logsumexp([m.log_posterior for m in models if not set(units).isdisjoint(m.units)]))


def _moved(whole: Fit, models: Sequence[Model], unit: str, left: bool, mass: float) -> list[Model]:
    """The likely sets with a unit, each less that one, with or without a remainder in its place, sharing a mass (log)
    as they did."""
    mine = [m for m in models if unit in m.units]
    top = max(m.log_posterior for m in mine)
    likely = [m for m in mine if m.log_posterior > top - NEAR]
    all_of = logsumexp([m.log_posterior for m in likely])
    return [replace(_less(whole, m, unit, left), log_posterior=float(m.log_posterior - all_of + mass)) for m in likely]


def _dispersed(
    every: Bench, whole: Fit, models: Sequence[Model], leading: Model, unit: str, told: Collection[str]
) -> list[Model]:
    """The likely sets with a unit, each less that one, with what is ``told`` loses where its score is overdispersed.

    Of a unit by itself that is of its odds against all other sets; of a group, whose members stand in for each other,
    of its likelihood ratio against nothing in its place.
    """
    dispersion = overdispersion(every, whole, leading, unit)
    if dispersion == 1.0:
        return []
    gain = leading.log_likelihood - whole.search.less(leading, unit).log_likelihood
    prior = _log_prior_odds(whole, leading, unit)
    if len(told) == 1:
        gain = min(gain, _log_odds(models, told) - prior)
    return _moved(whole, models, unit, False, _log_mass(models, told) - (prior + max(gain, 0.0) / dispersion))


def _less(whole: Fit, model: Model, unit: str, left: bool) -> Model:
    """A set less a unit, with a remainder in its place if asked, in the one of the unit's equations where that explains
    most."""
    members = tuple((c.unit, c.variant) for c in model.choices if c.unit != unit)
    equations = whole.search.units[unit].equations if left else ()
    places = {u for q in equations for u, v in whole.search.candidates if u.startswith(f"remainder:{q}")}
    if not places or places & {u for u, _ in members}:
        return whole.search.fit(members)
    found = [whole.search.fit((*members, (p, 0))) for p in sorted(places)]
    return max(found, key=lambda m: m.log_posterior)


def _misfit(ladder: Ladder, bench: Bench, fit: Fit, model: Model) -> float:
    """-2 log predictive density of the confirm recordings under a set fitted to the explored ones, up to a constant.

    Remainders are integrated: what all recordings share over the posterior of the explored ones, what each has of its
    own over its prior. The noise's part of the misfit, which goes with the coefficients that noise is multiplied by, is
    taken out.
    """
    inserted = bench.inserted(model, fit.normal)
    also = [n for n in model.deviations if is_parameter(n)]
    shared, own = _remainders(fit, model)
    whites = ladder.blocks(
        inserted.values, remainders=bool(shared or own), also=also, inserted=inserted, corrected=True
    )
    found = _occam(ladder, whites, model, fit) + sum(w.misfit for w in whites)
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


def _remainders(fit: Fit, model: Model) -> tuple[dict[str, float], dict[str, float]]:
    """Prior standard deviations of a set's remainders: by column that all recordings share, and by equation of which
    each recording has columns of its own."""
    shared, own = {}, {}
    for c in model.choices:
        candidate = fit.search.candidates[c.unit, c.variant]
        if fit.search.units[c.unit].kind == "remainder":
            for n, sd in zip(candidate.names, c.width * candidate.sd, strict=True):
                if "@" in n:
                    own[n.split(".")[1]] = float(sd)
                else:
                    shared[n] = float(sd)
    return shared, own


def _occam(ladder: Ladder, whites: Sequence[White], model: Model, fit: Fit) -> float:
    """What a model loses for parameters that each confirm recording has its own of: twice the log of how much narrower
    the recording makes them."""
    width: dict[str, float] = {}  # of the parameters of a recording, by name without it
    for c in model.choices:
        for n in fit.search.candidates[c.unit, c.variant].names:
            if is_parameter(n) and "@" in n:
                width[n.rsplit("@", 1)[0]] = c.width
    found = 0.0
    for recording in ladder.recordings if width else ():
        mine = [w for w in whites if w.recording == recording]
        names = [n for n in dict.fromkeys(n for w in mine for n in w.names) if n.rsplit("@", 1)[0] in width]
        sd = np.array([width[n.rsplit("@", 1)[0]] * ladder.parameters[n].sd for n in names])
        H = assemble(mine, names, {}).H
        found += float(np.linalg.slogdet(np.eye(len(names)) + H * np.outer(sd, sd))[1])
    return found


def _leading(models: Sequence[Model], unit: str) -> Model:
    """The likeliest set with a unit."""
    return max((m for m in models if unit in m.units), key=lambda m: m.log_posterior)


def _log_prior_odds(whole: Fit, model: Model, unit: str) -> float:
    """Log prior odds of a set with a unit over the same without it."""
    members = [(c.unit, c.variant) for c in model.choices]
    return whole.search.log_prior(members) - whole.search.log_prior([m for m in members if m[0] != unit])


def _log_odds(models: Sequence[Model], units: Collection[str]) -> float:
    """Log odds, over the sets seen, that one of some units is there."""
    inside = [m.log_posterior for m in models if not set(units).isdisjoint(m.units)]
    outside = [m.log_posterior for m in models if set(units).isdisjoint(m.units)]
    if not inside or not outside:
        return np.inf if inside else -np.inf
    return float(logsumexp(inside) - logsumexp(outside))

"""Whether what was named holds on the recordings that took no part in naming it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.special import logsumexp

from ..diagnosis.closure import Ladder
from ..diagnosis.fit import Bench, Fit
from ..diagnosis.point import is_parameter
from ..diagnosis.search import Model
from ..effects import EFFECTS

CLEAR = 3.0  # nats of predictive density, by which a member has been seen to harm (Kass and Raftery 1995, JASA 90, 773)


def held_to_account(
    whole: Fit, named: Sequence[str], ladder: Ladder, explored: Bench, fit: Fit
) -> tuple[list[Model], dict[str, float]]:
    """Sets of all recordings, those less likely that hold what makes the confirm recordings worse.

    The explored recordings are fitted with a named effect and without; both predict the confirm recordings, frozen. One
    whose prediction is clearly the worse has the odds that the explored recordings gave it times the ratio of the
    predictive densities (Bayes' rule one part of the data after the other), instead of those of all data together. What
    it loses goes to the same set with a remainder in its place: no other effect has been shown by that.

    Returns
    -------
    sets, most probable first, and log predictive ratio by effect
    """
    models = list(whole.models)
    ratios: dict[str, float] = {}
    leading = next((m for m in fit.models if set(named) <= set(m.units)), fit.models[0])
    members = [e for e in named if e in leading.units]
    if not members:
        return models, ratios
    misfit = _misfit(ladder, explored, fit, leading)
    for effect in members:
        less = fit.search.fit(tuple((c.unit, c.variant) for c in leading.choices if c.unit != effect))
        ratios[effect] = 0.5 * (_misfit(ladder, explored, fit, less) - misfit)
        if ratios[effect] < -CLEAR:
            odds = _log_odds(fit.models, effect) + ratios[effect]
            if odds < _log_odds(models, effect):
                mass = logsumexp([m.log_posterior for m in models if effect in m.units])
                models.append(replace(_instead(whole, models, effect), log_posterior=float(mass - odds)))
    return sorted(models, key=lambda m: -m.log_posterior), ratios


def _instead(whole: Fit, models: Sequence[Model], effect: str) -> Model:
    """The leading set with an effect, a remainder in that one's first equation in its place."""
    leading = max((m for m in models if effect in m.units), key=lambda m: m.log_posterior)
    members = [(c.unit, c.variant) for c in leading.choices if c.unit != effect]
    places = [
        u for q in EFFECTS[effect].equations for u, v in whole.search.candidates if u.startswith(f"remainder:{q}")
    ]
    if places and not set(places) & {u for u, _ in members}:
        members.append((places[0], 0))
    return whole.search.fit(tuple(members))


def _misfit(ladder: Ladder, bench: Bench, fit: Fit, model: Model) -> float:
    """Sum of the squared whitened residual on the confirm recordings, at a set's fit to the explored ones.

    What a remainder has in each recording by itself is fitted there, under its prior.
    """
    inserted = bench.inserted(model, fit.normal)
    also = [n for n in model.deviations if is_parameter(n)]
    width = {
        c.unit.split(":", 1)[1]: c.width
        for c in model.choices
        if any("@" in n for n in fit.search.candidates[c.unit, c.variant].names) and c.unit.startswith("remainder:")
    }
    found = 0.0
    for w in ladder.blocks(inserted.values, remainders=bool(width), also=also, inserted=inserted):
        found += float(w.gram[-1, -1])
        own = [k for k, n in enumerate(w.names) if n.startswith("remainder.") and "@" in n]
        if own and w.equation in width:
            M, b = w.gram[np.ix_(own, own)], w.gram[own, -1]
            found -= float(b @ np.linalg.solve(M + np.eye(len(own)) / width[w.equation] ** 2, b))
    return found


def _log_odds(models: Sequence[Model], effect: str) -> float:
    """Log odds of an effect over the sets seen."""
    inside = [m.log_posterior for m in models if effect in m.units]
    outside = [m.log_posterior for m in models if effect not in m.units]
    if not inside or not outside:
        return np.inf if inside else -np.inf
    return float(logsumexp(inside) - logsumexp(outside))

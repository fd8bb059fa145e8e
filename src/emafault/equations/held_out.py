"""Whether what was named holds on the recordings that took no part in naming it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.special import logsumexp

from ..diagnosis.closure import Ladder
from ..diagnosis.fit import Bench, Fit, is_parameter
from ..diagnosis.search import Model

CLEAR = 3.0  # nats of predictive density, by which a member has been seen to harm (Kass and Raftery 1995, JASA 90, 773)


def held_to_account(
    models: Sequence[Model], named: Sequence[str], ladder: Ladder, explored: Bench, fit: Fit
) -> tuple[list[Model], dict[str, float]]:
    """Sets of all recordings, those less likely that hold what makes the confirm recordings worse.

    The explored recordings are fitted with a named effect and without; both predict the confirm recordings, frozen. One
    whose prediction is clearly the worse has the odds that the explored recordings gave it times the ratio of the
    predictive densities (Bayes' rule one part of the data after the other), instead of those of all data together.

    Returns
    -------
    sets, most probable first, and log predictive ratio by effect
    """
    ratios: dict[str, float] = {}
    leading = next((m for m in fit.models if set(named) <= set(m.units)), fit.models[0])
    members = [e for e in named if e in leading.units]
    if not members:
        return list(models), ratios
    whole = _misfit(ladder, explored, fit, leading)
    penalties = {}
    for effect in members:
        less = fit.search.fit(tuple((c.unit, c.variant) for c in leading.choices if c.unit != effect))
        ratios[effect] = 0.5 * (_misfit(ladder, explored, fit, less) - whole)
        if ratios[effect] < -CLEAR:
            one_after_the_other = _log_odds(fit.models, effect) + ratios[effect]
            penalties[effect] = max(0.0, _log_odds(models, effect) - one_after_the_other)
    out = [
        replace(m, log_posterior=m.log_posterior - sum(p for e, p in penalties.items() if e in m.units)) for m in models
    ]
    return sorted(out, key=lambda m: -m.log_posterior), ratios


def _misfit(ladder: Ladder, bench: Bench, fit: Fit, model: Model) -> float:
    """Sum of the squared whitened residual on the confirm recordings, at a set's fit to the explored ones."""
    inserted = bench.inserted(model, fit.normal)
    also = [n for n in model.deviations if is_parameter(n)]
    return float(sum(w.gram[-1, -1] for w in ladder.blocks(inserted.values, also=also, inserted=inserted)))


def _log_odds(models: Sequence[Model], effect: str) -> float:
    """Log odds of an effect over the sets seen."""
    inside = [m.log_posterior for m in models if effect in m.units]
    outside = [m.log_posterior for m in models if effect not in m.units]
    if not inside or not outside:
        return np.inf if inside else -np.inf
    return float(logsumexp(inside) - logsumexp(outside))

"""Whether the noise's model says how far chance carries what a unit is told by.

Evidence is as good as the model of the noise. What comes and goes without a model of its own is coloured and not
stationary, and along a unit's columns it may scatter by more than the weights allow for, so that the evidence of
whatever unit happens to resemble it is too large. The scatter is seen from the unit's score in parts of the recordings,
which a model that holds makes independent with known variances (the sandwich of clustered data: Liang and Zeger 1986,
Biometrika 73, 13).
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from .constancy import prior_of
from .evidence import Definite
from .fit import Bench, Fit
from .linear import white_rows
from .model import SETTINGS
from .point import is_parameter
from .search import Model, inclusion
from .whitening import filtered

LIKELY = 0.02  # inclusion, from which a unit is asked
PARTS = 10  # of a recording
CHANCE = 2.0  # standard deviations of the variance over that expected, up to which it is taken for chance


def tempered(bench: Bench, fit: Fit) -> list[Model]:
    """Sets of a fit, most probable first, whose units' likelihood ratios are divided by their overdispersion.

    Every likely unit is asked, those too that become likely in consequence. In a set with several, the most dispersed
    is taken out first: each has the ratio of what the set is with it to what it is without.
    """
    models = list(fit.models)
    found: dict[str, float] = {}
    while True:
        likely = [u for u, p in inclusion(models).items() if p >= LIKELY and u not in found]
        likely = [u for u in likely if fit.search.units[u].kind != "remainder"]
        if not likely:
            return models
        for unit in likely:
            found[unit] = overdispersion(bench, fit, next(m for m in models if unit in m.units), unit)
        for _ in range(2):  # the sets less their dispersed units are looked at in the first
            models = [_tempered(fit, m, found) for m in fit.search.ranked()]
        models.sort(key=lambda m: -m.log_posterior)


def _tempered(fit: Fit, model: Model, dispersion: Mapping[str, float]) -> Model:
    left, lost = model, 0.0
    for unit in sorted(model.units, key=lambda u: -dispersion.get(u, 1.0)):
        if dispersion.get(unit, 1.0) == 1.0:
            break
        less = fit.search.less(left, unit)
        gain = left.log_likelihood - less.log_likelihood
        lost += max(gain, 0.0) * (1.0 - 1.0 / dispersion[unit])
        left = less
    return replace(model, log_posterior=model.log_posterior - lost)


def overdispersion(bench: Bench, fit: Fit, model: Model, unit: str) -> float:
    """Variance of a unit's score over what the noise's model gives it; 1 where it is not more than by chance.

    The score is that along the unit's fitted columns, what else is free taken out. Log likelihood ratios of the unit
    are to be divided by it (magnitude adjustment: Ribatet, Cooley and Davison 2012, Statistica Sinica 22, 813).

    Parameters
    ----------
    bench : at the point of the fit
    model : a set of the fit that holds the unit
    """
    aliases = bench.columns()[1]
    of_unit = next(c for c in model.choices if c.unit == unit)
    added = {n: model.deviations[n] - bench.prior(n)[2] for n in bench.names_of(of_unit)}
    at_fit = bench.nuisance_deviations(fit.normal, model.deviations) | dict(model.deviations)
    residual = _by_column(at_fit, aliases)
    score = _by_column(_taken_out(bench, fit, model, unit, added) | added, aliases)
    wanted = [n for n in dict.fromkeys([*residual, *score]) if is_parameter(n)]
    acting = [aliases.get(n, n) for n in added]
    own = bench.amounts(model)
    found, known = 0.0, []
    for name in bench.recordings:
        for block in bench.machine.blocks(bench.values(), name, wanted=set(wanted)):
            weights = bench.carried[name].get(block.equation)
            if weights is None or not any(n in block.columns for n in acting):
                continue
            left = any(n.startswith(f"remainder.{block.equation}.") for n in residual)
            names, rows = white_rows(block, wanted, left, own if block.equation not in SETTINGS else None)
            rows = filtered(rows, weights)
            r = rows[:, -1] + rows[:, :-1] @ np.array([residual.get(n, 0.0) for n in names])
            x = rows[:, :-1] @ np.array([score.get(n, 0.0) for n in names])
            for part in np.array_split(np.flatnonzero(weights.usable), PARTS):
                found += float(x[part] @ r[part]) ** 2
                known.append(float(x[part] @ x[part]))
    expected = float(np.sum(known))
    chance = float(np.sqrt(2.0 * np.sum(np.square(known))))  # of squares of independent Gaussian scores
    return found / expected if found > expected + CHANCE * chance else 1.0


def _by_column(amounts: Mapping[str, float], aliases: Mapping[str, str]) -> dict[str, float]:
    """Amounts of parameters by the column that they multiply."""
    out: dict[str, float] = {}
    for n, amount in amounts.items():
        out[aliases.get(n, n)] = out.get(aliases.get(n, n), 0.0) + amount
    return out


def _taken_out(bench: Bench, fit: Fit, model: Model, unit: str, added: Mapping[str, float]) -> dict[str, float]:
    """Amounts of whatever else is free that leave of a unit's columns what the others cannot stand in for."""
    aliases = bench.columns()[1]
    mine = [*added]
    shared = {aliases[n] for n in mine if n in aliases}  # the tolerance of the quantity that the unit is beyond
    prior = {n: bench.prior(n)[:2] for n in bench.nuisances} | prior_of(fit, model)
    free = [n for n in prior if n not in added and n not in shared and not n.startswith(f"own.{unit}.")]
    sd = np.array([prior[n][1] for n in free])
    index = fit.normal.index
    k, m = np.array([index[n] for n in free]), np.array([index[n] for n in mine])
    H = fit.normal.H
    A = H[np.ix_(k, k)] * np.outer(sd, sd) + np.eye(len(k))
    taken = -sd * Definite(A).solve(sd * (H[np.ix_(k, m)] @ np.array([added[n] for n in mine])))
    return dict(zip(free, taken.tolist(), strict=True))

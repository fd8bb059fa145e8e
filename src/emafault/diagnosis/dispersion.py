"""Whether the noise's model says how far chance carries what a unit is told by.

Evidence is as good as the model of the noise. What comes and goes without a model of its own is coloured and not
stationary, and along a unit's columns it may scatter by more than the weights allow for, so that the evidence of
whatever unit happens to resemble it is too large. The scatter is seen from the unit's score in parts of the recordings,
which a model that holds makes independent with known variances (the sandwich of clustered data: Liang and Zeger 1986,
Biometrika 73, 13).
"""

from collections.abc import Mapping

import numpy as np

from .constancy import SCATTER, prior_of
from .evidence import Definite
from .fit import Bench, Fit
from .linear import columns_of_forms, white_rows
from .model import SETTINGS
from .point import is_parameter
from .sets import Model
from .whitening import filtered

PARTS = 10  # of a recording
CHANCE = 2.0  # standard deviations of the variance over that expected, up to which it is taken for chance


def overdispersion(bench: Bench, fit: Fit, model: Model, unit: str) -> float:
    """Variance of a unit's score over what the noise's model gives it; 1 where it is not more than by chance, and by
    the share of its own size by which a unit may scatter from part to part.

    The score is that along the unit's fitted columns, what else is free taken out. Log likelihood ratios of the unit
    are to be divided by it (magnitude adjustment: Ribatet, Cooley and Davison 2012, Statistica Sinica 22, 813).

    Parameters
    ----------
    bench : at the point of the fit
    model : a set of the fit that holds the unit
    """
    found, parts_known = 0.0, []
    for parts in _scores(bench, fit, model, unit).values():
        s, information, rows = np.array(parts).T
        # the noise that columns and residual share biases every row of an equation alike
        found += float(np.sum((s - rows * (s.sum() / max(rows.sum(), 1.0))) ** 2))
        parts_known += information.tolist()
    known = np.array(parts_known)
    # the score is per size of the unit, which may scatter by so much of itself all the same
    scattering = known + (SCATTER * known) ** 2
    chance = float(np.sqrt(2.0 * np.sum(scattering**2)))  # of squares of independent Gaussian scores
    return found / float(known.sum()) if found > float(scattering.sum()) + CHANCE * chance else 1.0


def _scores(bench: Bench, fit: Fit, model: Model, unit: str) -> dict[str, list[tuple[float, float, int]]]:
    """Score of a unit, its variance if the noise's model holds, and number of rows, of each part by equation."""
    aliases = bench.columns()[1]
    of_unit = next(c for c in model.choices if c.unit == unit)
    added = {n: model.deviations[n] - bench.prior(n)[2] for n in bench.names_of(of_unit)}
    residual = bench.own_deviations(model, fit.normal)
    score = _by_column(_taken_out(bench, fit, model, unit, added) | added, aliases)
    wanted = [n for n in dict.fromkeys([*residual, *score]) if is_parameter(n)]
    own = bench.own_forms(model)
    columns = {*wanted} | columns_of_forms(own)
    out: dict[str, list[tuple[float, float, int]]] = {}
    for name in bench.recordings:
        for block in bench.machine.blocks(bench.values(), name, wanted=columns):
            weights = bench.carried[name].get(block.equation)
            if weights is None:
                continue
            left = any(n.startswith(f"remainder.{block.equation}.") for n in residual)
            names, rows = white_rows(block, wanted, left, own if block.equation not in SETTINGS else None)
            rows = filtered(rows, weights)
            r = rows[:, -1] + rows[:, :-1] @ np.array([residual.get(n, 0.0) for n in names])
            x = rows[:, :-1] @ np.array([score.get(n, 0.0) for n in names])
            parts = np.array_split(np.flatnonzero(weights.usable), PARTS)
            mine = [(float(x[p] @ r[p]), float(x[p] @ x[p]), len(p)) for p in parts]
            out.setdefault(block.equation, []).extend(mine)
    return out


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

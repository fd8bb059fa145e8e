"""The posterior of a linear bench as a mixture over sets and widths, and samples of it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy.linalg import cho_solve, solve_triangular

from ..diagnosis.evidence import Normal, marginalise
from ..diagnosis.search import Search
from ..diagnosis.set_prior import OTHER_FORM_PRIOR
from ..diagnosis.sets import OTHER_FORM, Model
from .evidence_draws import SIZE, LinearBench, allowed

NEAR = 12.0  # log posterior within which a set has mass
LEAST = 8.0  # log evidence below the best, from which a width is left out of the sum
ROUNDS = 100  # of the rejection that keeps samples to their side of off
LEADING = 6  # sets that everything is added to where the search is completed
#: ways of computing the posterior that are checked: as the diagnosis does it, and with its approximations undone
ARMS = ("searched", "summed", "completed")
Members = tuple[tuple[str, int], ...]


@dataclass(frozen=True)
class Component:
    """A Gaussian of the posterior: a set, its members' widths, its log weight."""

    members: Members
    widths: tuple[float, ...]
    log_weight: float


def searched(bench: LinearBench, normal: Normal) -> tuple[Search, np.ndarray]:
    """The search of the diagnosis on drawn data; effects that carry their own form do so at the size fitted first.

    Returns
    -------
    the search, and what it multiplies the bench's columns by (reduced column,): other than one for own forms
    """
    reduced = marginalise(normal, bench.nuisances, bench.mean, bench.sd, bench.fixed)
    plain = {m: c for m, c in bench.candidates.items() if m[1] < OTHER_FORM}
    search = Search(reduced, bench.units, plain)
    search.run()
    scale = np.ones(len(reduced.names))
    if not bench.carrying:
        return search, scale
    for (unit, variant), c in bench.candidates.items():
        if variant >= OTHER_FORM:
            best = search.ranked()[0]
            model = best if unit in best.units else search.fit(((unit, variant % OTHER_FORM),))
            k = c.index[0]
            scale[c.extra] = (model.deviations[reduced.names[k]] - reduced.fixed[k]) / (SIZE * c.sd[0])
    reduced = replace(reduced, M=reduced.M * np.outer(scale, scale), b=reduced.b * scale)
    search = Search(reduced, bench.units, bench.candidates)
    search.run()
    return search, scale


def components(search: Search, arm: str, models: Sequence[Model] | None = None) -> list[Component]:
    """The posterior as a sum of Gaussians, over all sets seen or over ``models``.

    ``searched`` has each member's best width, as the diagnosis has it; ``summed`` all of its widths, and gives effects
    and forms without an own form the share of the prior back that own forms would have; ``completed`` is the same over
    more sets: everything that there is added to each of the leading ones.
    """
    if arm == "completed" and models is None:
        _complete(search)
    ranked = search.ranked() if models is None else list(models)
    top = max(m.log_posterior for m in ranked)
    out: list[Component] = []
    for model in ranked:
        if model.log_posterior < top - NEAR:
            continue
        members = tuple((c.unit, c.variant) for c in model.choices)
        widths = tuple(c.width for c in model.choices)
        if arm == "searched":
            out.append(Component(members, widths, model.log_posterior))
        else:
            out += _summed(search, model, members, widths)
    return out


def _complete(search: Search) -> None:
    for model in search.ranked()[:LEADING]:
        inside = tuple((c.unit, c.variant) for c in model.choices)
        widths = {(c.unit, c.variant): c.width for c in model.choices}
        for m in search.candidates:
            if m[0] not in model.units and np.isfinite(search.log_prior((*inside, m))):
                search.fit((*inside, m), widths)


def _summed(search: Search, model: Model, members: Members, widths: tuple[float, ...]) -> list[Component]:
    base = model.log_posterior - _value(search, members, widths)
    for unit, variant in members:
        plain = search.units[unit].kind != "remainder" and variant < OTHER_FORM
        if plain and (unit, variant + OTHER_FORM) not in search.candidates:
            base -= np.log(1.0 - OTHER_FORM_PRIOR)
    grids = []
    for k, m in enumerate(members):
        tried = [(_value(search, members, (*widths[:k], w, *widths[k + 1 :])), w) for w in search.candidates[m].widths]
        best = max(tried)[0]
        grids.append([w for value, w in tried if value > best - LEAST])
    return [Component(members, chosen, base + _value(search, members, chosen)) for chosen in product(*grids)]


def _value(search: Search, members: Members, widths: Sequence[float]) -> float:
    """Log evidence of a set under these widths, their own prior left out."""
    width = dict(zip(members, widths, strict=True))
    value, index, mean, deviation = search.factored(members, width).log_evidence()
    holes = [m for m in members if search.candidates[m].hole.size]
    return float(value + sum(search._outside(m, width[m], index, mean, deviation) for m in holes))


def shares(parts: Sequence[Component]) -> np.ndarray:
    """(component,) probabilities."""
    logs = np.array([p.log_weight for p in parts])
    weights = np.exp(logs - logs.max())
    return weights / weights.sum()


def sample(
    bench: LinearBench,
    normal: Normal,
    found: tuple[Search, np.ndarray],
    parts: Sequence[Component],
    count: int,
    rng: np.random.Generator,
) -> np.ndarray:
    """Samples (count, column) of the posterior, in the normal matrix' columns; ``found`` is what ``searched`` gives."""
    numbers = rng.multinomial(count, shares(parts))
    each = [_sample_part(bench, normal, *found, p, int(k), rng) for p, k in zip(parts, numbers, strict=True) if k]
    return np.concatenate(each)


def _sample_part(bench, normal, search, scale, part, count, rng) -> np.ndarray:
    r = search.reduced
    cs = [search.candidates[m] for m in part.members]
    free = np.concatenate([np.zeros(0, int), *(np.concatenate([c.index, c.extra]) for c in cs)]).astype(int)
    mean = np.concatenate([np.zeros(0), *(np.concatenate([c.mean, np.zeros(len(c.extra))]) for c in cs)])
    sd = np.concatenate(
        [np.zeros(0), *(np.concatenate([w * c.sd, c.extra_sd]) for c, w in zip(cs, part.widths, strict=True))]
    )
    base = r.fixed.copy()
    base[free] = mean
    A = r.M[np.ix_(free, free)] * np.outer(sd, sd) + np.eye(len(free))
    lower = np.linalg.cholesky(A)
    at = mean + sd * cho_solve((lower, True), sd * (r.b - r.M @ base)[free])
    across = normal.H[np.ix_(bench.rest, bench.n)]
    kept: list[np.ndarray] = []
    have = 0
    for turn in range(ROUNDS):
        more = 2 * count if turn else count
        d = np.tile(bench.fixed, (more, 1))
        white = solve_triangular(lower, rng.standard_normal((len(free), more)), lower=True, trans="T")
        reduced = np.tile(r.fixed, (more, 1))
        reduced[:, free] = at + (sd[:, None] * white).T
        d[:, bench.rest] = reduced * scale
        gradient = normal.g[bench.n] + d[:, bench.rest] @ across
        right = bench.mean / bench.sd - gradient * bench.sd
        centre = cho_solve(bench.factor, right.T).T
        scatter = solve_triangular(bench.factor[0], rng.standard_normal((len(bench.n), more)), lower=True, trans="T").T
        d[:, bench.n] = bench.sd * (centre + scatter)
        good = np.ones(more, bool)
        for c in cs:
            good &= allowed(bench, c, d)
        if turn == ROUNDS - 1:
            good[:] = True  # a set far on the wrong side of off, which has no mass to speak of
        kept.append(d[good])
        have += int(good.sum())
        if have >= count:
            break
    return np.concatenate(kept)[:count]

"""Simulation-based calibration of the evidence: parameters drawn from its priors, data from its linear model.

Talts et al. 2018 (arXiv 1804.06788) for the ranks, Lemos et al. 2023 (PMLR 202, 19256) for the coverage about random
points (TARP), both in closed form up to the samples of the posterior. No recording is made but those whose equations
give the normal matrices.
"""

import json
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular

from ..actuator.parameters import ActuatorParameters
from ..actuator.sensors import SensorNoise
from ..diagnosis.evidence import Normal, Reduced, marginalise
from ..diagnosis.fit import CARRYING, Bench
from ..diagnosis.model import LISTED, WORDS, Unit
from ..diagnosis.search import (
    ONE_MORE_FORM,
    OTHER_FORM,
    OTHER_FORM_PRIOR,
    REMAINDER_PRIOR,
    SIZE_PRIOR,
    Candidate,
    Model,
    Search,
)  # fmt: skip
from ..equations.machine import ReferenceActuator
from ..equations.signals import Signals, estimated_noise
from ..io.atomic import write_text
from ..io.bench import read_bench
from ..progress import say
from ..reporting.evidence import draw_page
from ..withheld.benches import write_bench
from ..withheld.cases import draw_case
from .evidence_scores import scores

Z = 1.645  # standard deviations of a told 90 % interval
SIZE = 0.3  # prior standard deviations, of which an own form's columns are first made
INFORMED = 0.7  # posterior over prior standard deviation, below which data tell of a nuisance
NEAR = 12.0  # log posterior within which a set has mass
LEAST = 8.0  # log evidence below the best, from which a width is left out of the sum
ROUNDS = 100  # of the rejection that keeps samples to their side of off
LEADING = 6  # sets that everything is added to where the search is completed
#: ways of computing the posterior that are checked: as the diagnosis does it, and with its approximations undone
ARMS = ("searched", "summed", "completed")
Members = tuple[tuple[str, int], ...]


@dataclass
class LinearBench:
    """A bench's linear model at the nominal point.

    ``normal`` has the matrix H (column, column), ``root`` its square root L, L L' = H; ``mean`` and ``sd`` (nuisance,)
    are the nuisances' prior, ``fixed`` (column,) where each column is off; ``tolerance`` is the nuisance's column of a
    column that is beyond a tolerance.
    """

    normal: Normal
    root: np.ndarray
    nuisances: list[str]
    mean: np.ndarray
    sd: np.ndarray
    fixed: np.ndarray
    reduced: Reduced
    units: list[Unit]
    candidates: dict[tuple[str, int], Candidate]
    tolerance: dict[int, int]
    carrying: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        self.n = np.array([self.normal.index[x] for x in self.nuisances])
        self.rest = np.setdiff1d(np.arange(len(self.normal.names)), self.n)
        A = self.normal.H[np.ix_(self.n, self.n)] * np.outer(self.sd, self.sd) + np.eye(len(self.n))
        self.factor = cho_factor(A, lower=True)
        shrunk = np.sqrt(np.diag(cho_solve(self.factor, np.eye(len(A)))))
        self.informed = np.flatnonzero(shrunk < INFORMED)
        unit = [self.rest[c.index] for m, c in self.candidates.items() if not m[0].startswith("remainder:")]
        widths = [c.sd for m, c in self.candidates.items() if not m[0].startswith("remainder:")]
        columns, first = np.unique(np.concatenate(unit), return_index=True)
        #: columns that a distance is taken over, and the unit of each
        self.over = np.concatenate([self.n[self.informed], columns])
        self.scale = np.concatenate([(shrunk * self.sd)[self.informed], np.concatenate(widths)[first]])


@dataclass
class Drawn:
    """A draw from the prior: members with widths, deviations (column,) from the point."""

    members: dict[tuple[str, int], float]
    deviations: np.ndarray

    @property
    def units(self) -> set[str]:
        """What is on."""
        return {u for u, _ in self.members}


@dataclass(frozen=True)
class Component:
    """A Gaussian of the posterior: a set, its members' widths, its log weight."""

    members: Members
    widths: tuple[float, ...]
    log_weight: float


def linear_bench(
    seed: int, recordings: int, actuator: ActuatorParameters, noise: SensorNoise, own_forms: bool = False
) -> LinearBench:
    """The linear model of the first recordings of an effect-free blind case.

    ``own_forms``: some of the effects with one parameter, drawn by the seed, may take another form than the library's.
    """
    case = draw_case("T0", seed)
    case = replace(case, recordings=case.recordings[:recordings])
    with tempfile.TemporaryDirectory() as scratch:
        write_bench(case, Path(scratch) / "bench", actuator, noise)
        read = read_bench(Path(scratch) / "bench", actuator).recordings
    own = estimated_noise(list(read.values()), noise)
    machine = ReferenceActuator(actuator, {n: Signals.of(n, r, actuator, own) for n, r in read.items()})
    bench = Bench(machine, list(read))
    carrying: tuple[str, ...] = ()
    if own_forms:
        single = [u for u in bench.units if u.kind == "structural" and len(u.variants) == 1 == len(u.parameters)]
        picked = np.random.default_rng(seed).permutation(len(single))[:CARRYING]
        bench.sizes = {
            single[k].id: {p.name: SIZE * bench.prior(p.name)[1] for p in single[k].parameters} for k in picked
        }
        carrying = tuple(bench.sizes)
    bench.linearise(renew=True)
    # the columns as they are, noise in the regressors and all: the check is of the linear model alone
    normal = bench.normal(bench.linearise(corrected=False))
    power = np.diag(normal.H)
    scale = np.sqrt(np.where(power > 0.0, power, 1.0))
    values, vectors = np.linalg.eigh(normal.H / np.outer(scale, scale))
    root = scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
    normal = Normal(normal.names, root @ root.T, np.zeros(len(power)), 0.0)
    reduced = bench.reduce(normal)
    units, candidates = bench.candidates(reduced)
    prior = np.array([bench.prior(n) for n in normal.names])
    n = np.array([normal.index[x] for x in bench.nuisances])
    tolerance = {
        normal.index[name]: normal.index[p.alias]
        for name, p in bench.parameters.items()
        if p.alias is not None and name in normal.index and p.alias in normal.index
    }
    return LinearBench(
        normal, root, bench.nuisances, prior[n, 0], prior[n, 1], prior[:, 2], reduced, units, candidates, tolerance,
        carrying,
    )  # fmt: skip


def draw_truth(bench: LinearBench, rng: np.random.Generator, width: float = 1.0) -> Drawn:
    """Draw from the prior of the model; ``width`` multiplies every prior's standard deviation."""
    kinds = {u.id: u.kind for u in bench.units}
    listed = [u for u, k in kinds.items() if k in LISTED]
    chosen = [
        *rng.choice(listed, rng.choice(len(SIZE_PRIOR), p=SIZE_PRIOR), replace=False),
        *_drawn_forms([u for u in bench.units if u.kind == "form" and not u.of_controller], rng),
        *(u.id for u in bench.units if u.of_controller and rng.random() < REMAINDER_PRIOR),
        *(u for u, k in kinds.items() if k == "remainder" and rng.random() < REMAINDER_PRIOR),
    ]
    d = bench.fixed.copy()
    d[bench.n] = bench.mean + width * bench.sd * rng.standard_normal(len(bench.n))
    members: dict[tuple[str, int], float] = {}
    for unit in map(str, chosen):
        variants = [v for u, v in bench.candidates if u == unit and v < OTHER_FORM]
        m = unit, int(rng.choice(variants))
        others = [v for u, v in bench.candidates if u == unit and v >= OTHER_FORM and v % OTHER_FORM == m[1]]
        other = bool(others) and rng.random() < OTHER_FORM_PRIOR
        m = (unit, int(rng.choice(others))) if other else m
        c = bench.candidates[m]
        members[m] = float(rng.choice(c.widths))
        k = bench.rest[c.index]
        held = np.array([bench.tolerance[q] for q in k.tolist() if c.hole.size and q in bench.tolerance], int)
        position = np.searchsorted(bench.n, held, sorter=np.argsort(bench.n))
        position = np.argsort(bench.n)[position] if len(held) else position
        while True:
            d[k] = c.mean + width * members[m] * c.sd * rng.standard_normal(len(k))
            if len(held):
                d[held] = bench.mean[position] + width * bench.sd[position] * rng.standard_normal(len(held))
            if _allowed(bench, c, d[None])[0]:
                break
        if other:  # in proportion to the effect, as a fit has it
            share = (d[k] - bench.fixed[k]) / (SIZE * c.sd)
            d[bench.rest[c.extra]] = share * c.extra_sd * rng.standard_normal(len(c.extra))
    return Drawn(members, d)


def _drawn_forms(forms: Sequence[Unit], rng: np.random.Generator) -> tuple[str, ...]:
    """Ids of forms drawn from those of the prior's sets that are among these."""
    share = np.array([1.0 / (len(WORDS) * u.among) for u in forms])
    while True:
        count = rng.geometric(1.0 - ONE_MORE_FORM * share.sum()) - 1
        drawn = set(rng.choice(len(forms), count, p=share / share.sum()).tolist())
        if len(drawn) == count:  # sets hold a form once
            return tuple(forms[k].id for k in sorted(drawn))


def _allowed(bench: LinearBench, c: Candidate, d: np.ndarray) -> np.ndarray:
    """Whether deviations (sample, column) are on a candidate's side of off and outside its hole."""
    k = bench.rest[c.index]
    apart = d[:, k] - bench.fixed[k]
    good = np.all((c.signs == 0) | (apart * c.signs >= 0.0), axis=1)
    if c.hole.size:
        low, high = c.hole * c.sd
        off = apart + np.column_stack([d[:, bench.tolerance[q]] if q in bench.tolerance else 0.0 * d[:, q] for q in k])
        good &= np.any((off <= low) | (off >= high), axis=1)
    return good


def data_of(bench: LinearBench, truth: Drawn, rng: np.random.Generator, noise: float = 1.0) -> Normal:
    """What the rows y = e - J d, d the truth's deviations, leave: g = J'y = -H d + L z, z white times ``noise``."""
    z = noise * rng.standard_normal(len(bench.root))
    return replace(bench.normal, g=bench.root @ z - bench.normal.H @ truth.deviations)


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
    value, index, mean, deviation = search._evidence(members, width)
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
            good &= _allowed(bench, c, d)
        if turn == ROUNDS - 1:
            good[:] = True  # a set far on the wrong side of off, which has no mass to speak of
        kept.append(d[good])
        have += int(good.sum())
        if have >= count:
            break
    return np.concatenate(kept)[:count]


def check_draw(
    bench: LinearBench, rng: np.random.Generator, samples: int, width: float, noise: float
) -> dict[str, Any]:
    """One draw: ranks, coverage and inclusion probabilities by every way of computing the posterior.

    Returns
    -------
    ``on`` (unit,) bool; ``units`` their ids; ``seen`` whether the search looked at the true set, ``missed`` whether it
    is more probable than all that were; ``inside`` whether told 90 % intervals of the true set's parameters hold the
    truth; by arm ``inclusion`` (unit,), ``nuisance`` and ``effect`` (ranks, None: no effect), ``nearer`` (share of the
    samples nearer to a random point than the truth is)
    """
    truth = draw_truth(bench, rng, width)
    normal = data_of(bench, truth, rng, noise)
    search, scale = searched(bench, normal)
    members = tuple(sorted(truth.members))
    ranked = search.ranked()
    seen = members in search.seen
    arms = {arm: components(search, arm) for arm in ARMS}
    told = search.fit(members)
    picked = rng.choice(bench.informed) if len(bench.informed) else 0
    named = [m for m in members if not m[0].startswith("remainder:") and m[1] < OTHER_FORM]
    column = -1
    if named:
        c = bench.candidates[named[rng.integers(len(named))]]
        column = int(rng.choice(c.index))
    reference = draw_truth(bench, rng).deviations
    out: dict[str, Any] = {
        "units": list(search.units), "on": [u in truth.units for u in search.units], "seen": seen,
        "missed": not seen and told.log_posterior > ranked[0].log_posterior,
        "inside": _inside(bench, search, told, truth),
    }  # fmt: skip
    for arm, parts in arms.items():
        drawn = sample(bench, normal, (search, scale), parts, samples, rng)
        known = components(search, arm, [told])
        weights = shares(parts)
        chances = dict.fromkeys(search.units, 0.0)
        for p, w in zip(parts, weights, strict=True):
            for u, _ in p.members:
                chances[u] += float(w)
        found: dict[str, Any] = {"inclusion": [min(c, 1.0) for c in chances.values()]}
        at = bench.n[picked]
        found["nuisance"] = _rank(drawn[:, at], truth.deviations[at], rng)
        found["effect"] = None
        if column >= 0:
            at = bench.rest[column]
            given = sample(bench, normal, (search, scale), known, samples, rng)
            found["effect"] = _rank(given[:, at], truth.deviations[at], rng)
        apart = [
            np.sqrt((((x[..., bench.over] - reference[bench.over]) / bench.scale) ** 2).sum(axis=-1))
            for x in (drawn, truth.deviations)
        ]
        found["nearer"] = (_rank(apart[0], float(apart[1]), rng) + float(rng.random())) / (samples + 1)
        out[arm] = found
    return out


def _rank(drawn: np.ndarray, value: float, rng: np.random.Generator) -> int:
    """Rank of a value among samples (sample,), ties broken at random (both at off)."""
    ties = int(np.sum(drawn == value))
    return int(np.sum(drawn < value)) + (int(rng.integers(ties + 1)) if ties else 0)


def _inside(bench: LinearBench, search: Search, told: Model, truth: Drawn) -> list[bool]:
    """Whether the 90 % intervals that a verdict would tell of the true set's listed effects hold the truth."""
    wide = search.wide(told)
    out = []
    for m in truth.members:
        if search.units[m[0]].kind in LISTED:
            for k in search.candidates[m].index:
                name = search.reduced.names[k]
                error = wide.deviations[name] - truth.deviations[bench.rest[k]]
                out.append(bool(abs(error) <= Z * wide.spread[name]))
    return out


def run_draws(
    benches: Sequence[LinearBench], draws: int, samples: int, seed: int, width: float = 1.0, noise: float = 1.0
) -> list[dict[str, Any]]:
    """Draws over benches in turn; ``width`` and ``noise`` other than one make data that the model is wrong about."""
    out = []
    for k in range(draws):
        out.append(check_draw(benches[k % len(benches)], np.random.default_rng([seed, k]), samples, width, noise))
        if (k + 1) % 100 == 0:
            say(f"{k + 1} of {draws} draws")
    return out


def check_evidence(spec: Mapping[str, Any], report: Path, figures: Path, result: Path) -> None:
    """Check the evidence by draws from its own priors: a page with pictures, and scores.

    Parameters
    ----------
    spec : ``evidence`` (draws, samples, seed, benches, recordings), ``actuator`` and ``sensors``
    report, figures, result : the page, the folder of its pictures, the scores; written
    """
    said = spec["evidence"]
    actuator, noise = ActuatorParameters(**spec["actuator"]), SensorNoise(**spec["sensors"])
    out: dict[str, Any] = {}
    for kind, own in (("library", False), ("own_forms", True)):
        benches = [linear_bench(b, said["recordings"], actuator, noise, own) for b in said["benches"]]
        out[kind] = scores(run_draws(benches, said["draws"], said["samples"], said["seed"]), said["samples"], ARMS)
    write_text(result, json.dumps(out, indent=1) + "\n")
    draw_page(out, Path(report), Path(figures))

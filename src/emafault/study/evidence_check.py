"""Simulation-based calibration of the evidence: parameters drawn from its priors, data from its linear model.

Talts et al. 2018 (arXiv 1804.06788) for the ranks, Lemos et al. 2023 (PMLR 202, 19256) for the coverage about random
points (TARP), both in closed form up to the samples of the posterior. No recording is made but those whose equations
give the normal matrices.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..actuator.sensors import SensorNoise
from ..diagnosis.model import LISTED
from ..diagnosis.search import Search
from ..diagnosis.sets import OTHER_FORM, Model
from ..io.atomic import write_text
from ..progress import say
from ..reporting.evidence import draw_page
from .evidence_draws import Drawn, LinearBench, data_of, draw_truth, linear_bench
from .evidence_posterior import ARMS, components, sample, searched, shares
from .evidence_scores import scores

Z = 1.645  # standard deviations of a told 90 % interval


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

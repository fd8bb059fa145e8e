"""Statistics of draws whose truth is known: are ranks uniform, is coverage as expected, are probabilities shares."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from scipy import stats

BINS = 20  # of ranks
BAND = 0.99
EDGES = (0.0, 0.003, 0.01, 0.03, 0.1, 0.25, 0.5, 0.75, 0.9, 0.97, 1.0)  # of inclusion probabilities
LEVELS = 50  # of the curve of coverage
TINY = 1e-4  # smallest probability that the logarithmic score believes
NAMED = 0.9
SURE = 0.97
KINDS = ("listed", "form", "remainder")


def scores(rows: Sequence[Mapping[str, Any]], samples: int, arms: Sequence[str]) -> dict[str, Any]:
    """Scores of draws as ``evidence_check.check_draw`` returns them.

    Returns
    -------
    ``draws``; ``seen``, ``missed`` shares of true sets; ``told_90`` share and number of told intervals that hold the
    truth; by arm ``nuisance``, ``effect`` (ranks, see ``uniform``), ``coverage`` (see ``coverage``), ``inclusion`` (see
    ``reliability``)
    """
    inside = [x for r in rows for x in r["inside"]]
    out: dict[str, Any] = {
        "draws": len(rows), "samples": samples,
        "seen": float(np.mean([r["seen"] for r in rows])), "missed": float(np.mean([r["missed"] for r in rows])),
        "told_90": {"share": float(np.mean(inside)) if inside else None, "count": len(inside)},
    }  # fmt: skip
    for arm in arms:
        found = [r[arm] for r in rows]
        out[arm] = {
            "nuisance": uniform([f["nuisance"] for f in found], samples),
            "effect": uniform([f["effect"] for f in found if f["effect"] is not None], samples),
            "coverage": coverage(np.array([f["nearer"] for f in found])),
            "inclusion": reliability(rows, arm),
        }
    return out


def uniform(ranks: Sequence[int], samples: int) -> dict[str, Any]:
    """Counts of ranks in ``BINS`` bins, their binomial band, and the probability of a chi-squared as large.

    Parameters
    ----------
    ranks : of the truth among the samples, 0 to ``samples``; ``samples`` + 1 is a multiple of ``BINS``
    """
    counts = np.bincount(np.array(ranks, int) * BINS // (samples + 1), minlength=BINS)
    tail = 0.5 * (1.0 - BAND)
    low, high = stats.binom.ppf([tail, 1.0 - tail], len(ranks), 1.0 / BINS)
    p = float(stats.chisquare(counts).pvalue) if len(ranks) else None
    return {"counts": counts.tolist(), "low": float(low), "high": float(high), "count": len(ranks), "p": p}


def coverage(nearer: np.ndarray) -> dict[str, Any]:
    """Expected coverage by credibility, from the shares (draw,) of samples nearer to a random point than the truth.

    A region about the random point that holds a share of the posterior holds the truth as often (TARP). ``p`` is that
    of a Kolmogorov-Smirnov distance as large, ``apart`` the largest difference.
    """
    level = np.arange(LEVELS + 1) / LEVELS
    held = np.searchsorted(np.sort(nearer), level, side="right") / len(nearer)
    test = stats.kstest(nearer, "uniform")
    tail = 0.5 * (1.0 - BAND)
    low, high = (stats.binom.ppf(q, len(nearer), level) / len(nearer) for q in (tail, 1.0 - tail))
    return {
        "credibility": level.tolist(), "coverage": held.tolist(), "low": low.tolist(), "high": high.tolist(),
        "apart": float(test.statistic), "p": float(test.pvalue),
    }  # fmt: skip


def reliability(rows: Sequence[Mapping[str, Any]], arm: str) -> dict[str, Any]:
    """Shares of what is truly on by inclusion probability, all units together, and scores.

    Returns
    -------
    ``bins`` with ``mean`` probability, ``share`` on, ``count`` and half width ``band``; ``z`` by kind of unit, the sum
    over draws of what is on less what is expected, over its standard deviation from draw to draw; ``named`` shares of
    listed effects with 0.9 or more, and how many of the wrong are in draws whose true set the search missed; ``sure``
    the same of everything with 0.97 or more; ``brier`` and ``log_score`` (nat) a draw
    """
    units = list(dict.fromkeys(u for r in rows for u in r["units"]))
    place = {u: k for k, u in enumerate(units)}
    p, on = np.zeros((len(rows), len(units))), np.zeros((len(rows), len(units)))
    for n, r in enumerate(rows):
        k = [place[u] for u in r["units"]]
        p[n, k], on[n, k] = r[arm]["inclusion"], r["on"]
    clipped = np.clip(p, TINY, 1.0 - TINY)
    kind = np.array([_kind(u) for u in units])
    bins = []
    for low, high in pairwise(EDGES):
        inside = (p >= low) & ((p < high) | (high == 1.0))
        count = int(inside.sum())
        if count:
            spread = np.sqrt(float(np.sum((p * (1.0 - p))[inside])))
            bins.append(
                {
                    "low": low, "high": high, "mean": float(p[inside].mean()), "share": float(on[inside].mean()),
                    "count": count, "band": float(stats.norm.ppf(0.5 + 0.5 * BAND) * spread / count),
                }
            )  # fmt: skip
    z = {}
    for name in KINDS:
        more = (on - p)[:, kind == name].sum(axis=1)
        z[name] = float(more.sum() / max(np.sqrt(len(more)) * more.std(ddof=1), 1e-9)) if len(more) > 1 else 0.0
    named = (p >= NAMED) & (kind == "listed")
    return {
        "bins": bins, "z": z,
        "expected": {k: float(p[:, kind == k].sum()) for k in KINDS},
        "on": {k: float(on[:, kind == k].sum()) for k in KINDS},
        "named": {
            "count": int(named.sum()), "mean": float(p[named].mean()) if named.any() else None,
            "share": float(on[named].mean()) if named.any() else None,
            **_wrong(rows, named, on),
        },
        "sure": {"count": int((p >= SURE).sum()), **_wrong(rows, p >= SURE, on)},
        "brier": float(((p - on) ** 2).sum(axis=1).mean()),
        "log_score": float(-(on * np.log(clipped) + (1.0 - on) * np.log(1.0 - clipped)).sum(axis=1).mean()),
    }  # fmt: skip


def _wrong(rows: Sequence[Mapping[str, Any]], told: np.ndarray, on: np.ndarray) -> dict[str, int]:
    """How much of what is ``told`` (draw, unit) is not on, and how much of that in draws that the search missed."""
    wrong = (told & (on == 0.0)).sum(axis=1)
    return {"wrong": int(wrong.sum()), "wrong_where_missed": int(wrong[[bool(r["missed"]) for r in rows]].sum())}


def _kind(unit: str) -> str:
    return "remainder" if unit.startswith("remainder:") else "form" if unit.startswith("~") else "listed"

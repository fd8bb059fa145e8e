"""Scores of the withheld check: every metric with its bootstrap interval, over the rows of judged cases."""

import json
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from itertools import pairwise
from pathlib import Path

import numpy as np

from ..effects import EFFECTS
from .described import change_without
from .metrics import METRICS, Metric, Rows, reliability, share
from .verdicts import IN_GROUP, judge, read_verdict

LEVEL = 0.90  # of the bootstrap intervals
RESAMPLES = 500


def score(folder: str | Path, seed: int = 0, processes: int = 1) -> dict:
    """Score what a folder holds: ``keys/NAME.json`` against ``diagnoses/NAME/diagnosis.json``.

    ``oracles/NAME/diagnosis.json``, where present, is a diagnosis that was told the effects. Over so many ``processes``
    the cases are shared out.

    Returns
    -------
    metrics (value, 90 % bootstrap interval, number of cases, whether a good result and the aim are met), confusion,
    reliability, power, hardest confusions, the judged rows and the names of cases without a verdict

    Raises
    ------
    InputError : a verdict file that cannot be read
    """
    keys = sorted((Path(folder) / "keys").glob("*.json"))
    if processes > 1:
        with ProcessPoolExecutor(processes) as pool:
            judged = list(pool.map(_judged, keys))
    else:
        judged = [_judged(key) for key in keys]
    missing = [key.stem for key, row in zip(keys, judged, strict=True) if row is None]
    return score_rows([row for row in judged if row is not None], seed) | {"missing": missing}


def _judged(key: Path) -> dict | None:
    """Row of one case, from the path of its key; None where it has no verdict."""
    folder = key.parent.parent
    verdict, oracle = (folder / kind / key.stem / "diagnosis.json" for kind in ("diagnoses", "oracles"))
    if not verdict.exists():
        return None
    told = read_verdict(oracle) if oracle.exists() else None
    return judge(json.loads(key.read_text()), read_verdict(verdict), told) | {"name": key.stem}


def score_rows(every: Rows, seed: int = 0) -> dict:
    """Everything that the scoreboard shows, from judged rows; plain twins are compared with and not counted."""
    rng = np.random.default_rng(seed)
    rows = compared(every)
    return {
        "metrics": [_measure(metric, rows, rng) for metric in METRICS],
        "confusion": confusion(rows),
        "reliability": reliability(rows),
        "power": power(rows),
        "rivals": by_rival(rows),
        "hardest": hardest(rows),
        "by_effect": by_effect(rows),
        "by_unlisted": by_unlisted(rows),
        "rows": rows,
    }


def compared(rows: Rows) -> list[dict]:
    """Rows of the cases, each with what changes against its plain twin where it has one."""
    plain = {r["bench"]: r for r in rows if r["plain"]}
    cases = [r for r in rows if not r["plain"]]
    return [r | change_without(r, plain[r["bench"]]) if r["bench"] in plain else r for r in cases]


def _measure(metric: Metric, rows: Rows, rng: np.random.Generator) -> dict:
    """Value of a metric with its interval, of benches drawn again: the cases of one bench are not independent."""
    chosen = [r for r in rows if metric.select(r)]
    value = metric.statistic(chosen)
    low = high = None
    if value is not None:
        benches: dict[str, list[dict]] = {}
        for r in chosen:
            benches.setdefault(r["bench"], []).append(r)
        each = list(benches.values())
        draws = []
        for _ in range(RESAMPLES):
            again = metric.statistic([r for i in rng.integers(0, len(each), len(each)) for r in each[i]])
            if again is not None:
                draws.append(again)
        low, high = (float(x) for x in np.quantile(draws, [0.5 - LEVEL / 2.0, 0.5 + LEVEL / 2.0]))
    return {
        "id": metric.id,
        "title": metric.title,
        "value": value,
        "low": low,
        "high": high,
        "cases": len(chosen),
        "good": metric.good,
        "aim": metric.aim,
        "good_met": _met(metric, value, metric.good),
        "aim_met": _met(metric, value, metric.aim),
    }


def _met(metric: Metric, value: float | None, bound) -> bool | None:
    if value is None or bound is None:
        return None
    if metric.sense == 0:
        return bool(bound[0] <= value <= bound[1])
    return bool(metric.sense * value >= metric.sense * bound)


def _said(row: dict) -> str:
    """What a row's answer counts as in the confusion matrix."""
    if row["answer"] in ("unknown", "no_gap", "described", "failed"):
        return str(row["answer"])
    if row["right"]:
        return str(row["truth"][0])
    if row["answer"] == "group":
        return "wrong group"
    structural = [e for e in row["named"] if EFFECTS[e].kind == "structural"] or row["named"]
    return str(structural[0]) if len(structural) == 1 else "several"


def confusion(rows: Rows) -> dict:
    """Counts of what detectable single effects of T1 were called."""
    labels = [*EFFECTS, "several", "wrong group", "described", "unknown", "no_gap", "failed"]
    counts = np.zeros((len(EFFECTS), len(labels)), int)
    for row in rows:
        if row["rung"] == "T1" and row["detectable"]:
            counts[labels.index(row["truth"][0]), labels.index(_said(row))] += 1
    return {"truth": list(EFFECTS), "said": labels, "counts": counts.tolist()}


def hardest(rows: Rows, most: int = 12) -> list[dict]:
    """The commonest wrong answers to detectable single effects, T1 and T4, with the median distance between the two."""
    found: dict[tuple[str, str], list[dict]] = {}
    for row in rows:
        if row["rung"] in ("T1", "T4") and row["detectable"] and not row["right"]:
            found.setdefault((row["truth"][0], _said(row)), []).append(row)
    out = []
    for (truth, said), those in sorted(found.items(), key=lambda item: -len(item[1]))[:most]:
        apart = [r["rivals"][said] for r in those if said in r["rivals"]]
        distance = float(np.median([r["distance"] for r in those]))
        out.append(
            {"truth": truth, "said": said, "cases": len(those), "distance": distance,
             "apart": float(np.median(apart)) if apart else None}
        )  # fmt: skip
    return out


def by_effect(rows: Rows) -> list[dict]:
    """Share right per effect and rung, over detectable cases."""
    out = []
    for effect in EFFECTS:
        line: dict = {"effect": effect}
        for rung in ("T1", "T3", "T4"):
            those = [r for r in rows if r["rung"] == rung and r["truth"] == [effect]]
            seen = [r for r in those if r["detectable"]]
            line[rung] = {"cases": len(those), "detectable": len(seen), "right": sum(bool(r["right"]) for r in seen)}
        out.append(line)
    return out


def by_unlisted(rows: Rows) -> list[dict]:
    """Each thing unlisted: cases, how often the listed ones are named beside it, another beside, itself described."""
    out = []
    for name in sorted({u["name"] for r in rows for u in r["unlisted"]}):
        those = [(r, u) for r in rows for u in r["unlisted"] if u["name"] == name]
        mixed = [r for r, _ in those if r["rung"] == "T7" and r["detectable"]]
        beside = Counter(e for r, _ in those for e in r["beside"]).most_common(3)
        out.append(
            {"unlisted": name, "inside": those[0][1]["inside"], "cases": len(those), "mixed": len(mixed),
             "named": share("all_named")(mixed), "another": share("another")([r for r, _ in those]),
             "equation": float(np.mean([u["equation_right"] for _, u in those])),
             "form": float(np.mean([u["form_right"] for _, u in those])), "beside": [e for e, _ in beside]}
        )  # fmt: skip
    return out


def by_rival(rows: Rows) -> list[dict]:
    """Share right and wrongly named of detectable single effects against the distance to their nearest rival."""
    edges = [0.0, IN_GROUP, 25.0, 100.0, 1e3, np.inf]
    known = [r for r in rows if r["rung"] in ("T1", "T4") and r["detectable"] and r["nearest_rival"]]
    out = []
    for low, high in pairwise(edges):
        those = [r for r in known if low <= r["nearest_rival"]["distance"] < high]
        if those:
            out.append(
                {"low": low, "high": None if np.isinf(high) else high, "cases": len(those),
                 "right": share("right")(those), "wrong_name": share("wrong_name")(those)}
            )  # fmt: skip
    return out


def power(rows: Rows) -> list[dict]:
    """Share right and wrongly named against the squared distance to the nominal model, single effects of T1."""
    edges = [0.0, 5.0, 10.0, 25.0, 50.0, 100.0, 300.0, 1e3, 3e3, 1e4, 1e5, np.inf]
    singles = [r for r in rows if r["rung"] == "T1"]
    out = []
    for low, high in pairwise(edges):
        those = [r for r in singles if low <= r["distance"] < high]
        if those:
            out.append(
                {
                    "low": low,
                    "high": None if np.isinf(high) else high,
                    "cases": len(those),
                    "right": float(np.mean([r["right"] for r in those])),
                    "wrong_name": float(np.mean([r["wrong_name"] for r in those])),
                    "amplitude": float(np.median([r["amplitude"] for r in those])),
                }
            )
    return out

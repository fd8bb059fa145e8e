"""One diagnosis, from a twin to the verdict: where, which, how far, groups, biased outputs, what to record next."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from .decide import Calibration, Decision, decide, is_named, share_left
from .gaussian import Point
from .groups import confusability
from .how_far import Ladder, Rung, climb, closed
from .inference import Candidate, Problem
from .twin import INTERVAL, Twin
from .where import beyond_specification, equation_of, where
from .which import Search, search

CONFUSED = 0.9  # cosine of two signatures from which the report calls them hard to tell apart


@dataclass(frozen=True)
class Diagnosis:
    """The verdict (see ``verdict``), and what the report draws."""

    verdict: dict
    twin: Twin
    explore: Problem
    found: Search
    decision: Decision
    ladder: Ladder | None
    details: dict = field(default_factory=dict)


def diagnose(
    twin: Twin,
    bench: str,
    explore: Sequence[str],
    confirm: Sequence[str],
    calibration: Calibration,
    truths: Mapping[str, np.ndarray] | None = None,
) -> Diagnosis:
    """Diagnose a bench; the verdict is fixed, and its digest taken, before the confirm recordings are predicted.

    Parameters
    ----------
    twin : the machine and its recordings
    bench : name of the bench
    explore, confirm : names of the recordings that fit and choose, and of those that only check
    calibration : frozen curves of probability
    truths : recording -> true fault vector where known, for scoring only

    Returns
    -------
    the verdict as a plain dictionary in the format of ``diagnosis.json``, with what the report needs
    """
    problem = Problem(twin, explore)
    hypotheses = list(twin.hypotheses)
    by_id = {h.effect: h for h in hypotheses}
    found = search(problem, hypotheses, calibration.addition)
    decision = decide(problem, found, hypotheses, calibration)
    named = decision.verdict in ("explained", "group", "partly")
    best = found.candidates[0] if found.candidates and named else None
    after = best.point if best is not None else found.null
    verdict: dict = {"bench": bench, "verdict": decision.verdict, "twin": twin.name}
    verdict["recordings"] = {"explore": list(explore), "confirm": list(confirm)}
    verdict["where"] = where(problem, found.null_families)
    verdict["beyond_specification"] = beyond_specification(found.null_families)
    verdict["remains"] = where(problem, found.families) if best is not None else verdict["where"]
    verdict["which"] = _which(twin, problem, found, decision, by_id)
    verdict["groups"] = [sorted({e for c in decision.group for e in c.effects})] if len(decision.group) > 1 else []
    verdict["confusable"] = [
        {"effects": list(pair), "cosine": round(cosine, 3)}
        for pair, cosine in sorted(confusability(problem, found.null, found.singles).items(), key=lambda kv: -kv[1])
        if cosine > CONFUSED
    ]
    verdict["detectable_from"] = detectable(problem, found)
    verdict["digest"] = hashlib.sha256(json.dumps(verdict, sort_keys=True).encode()).hexdigest()[:16]
    # from here on the confirm recordings are open
    ladder = climb(twin, confirm, problem, found.null, best) if confirm else None
    sealed, left = verdict["verdict"], None
    # the recalibrated model has what a calibration effect names already: only what is structural can help beyond it
    if ladder is not None and best is not None and any(by_id[e].kind != "calibration" for e in best.effects):
        recalibrated, named_set = ladder.misfit(ladder.recalibrated), ladder.misfit(ladder.after)
        left = share_left(recalibrated, named_set, len(ladder.problem.cells))
        decision = decide(problem, found, hypotheses, calibration, left)
        verdict["verdict"] = decision.verdict
        verdict["which"] = _which(twin, problem, found, decision, by_id)
    verdict["before_confirm"] = sealed
    verdict["evidence"] = asdict(decision.evidence) | {
        "held_out": left,
        "candidates": [[list(c.effects), round(c.gain, 2)] for c in found.candidates[:6]],
    }
    mixture = _mixture(problem, found, decision, best)
    before_faults = fault_vectors(problem, found.null, (ladder.problem, ladder.recalibrated) if ladder else None)
    after_faults = fault_vectors(problem, after, (ladder.problem, ladder.after) if ladder else None, mixture)
    verdict["fault_vector"] = {
        name: {"before": before_faults[name], "after": after_faults[name]} for name in before_faults
    }
    verdict["biased_outputs"] = biased(before_faults, after_faults)
    verdict["shrinks"] = {"signal": ladder.signal() if ladder else None, "features": None, "fault_vector": None}
    if ladder is not None and truths:
        verdict["shrinks"]["fault_vector"] = fault_ladder(
            {n: before_faults[n] for n in confirm if n in before_faults},
            {n: after_faults[n] for n in confirm if n in after_faults},
            truths,
        )
    verdict["next_experiment"] = []
    return Diagnosis(verdict, twin, problem, found, decision, ladder)


def _which(twin: Twin, problem: Problem, found: Search, decision: Decision, by_id: Mapping) -> list[dict]:
    """The entries of ``which``: sets with their parameters, the empty set, unknown."""
    entries: list[dict[str, Any]] = []
    group_id = "group 1" if len(decision.group) > 1 else None
    inside = {c.effects for c in decision.group}
    for candidate, probability in decision.sets:
        members = [e for e in candidate.effects if is_named(problem, by_id[e], candidate)]
        entries.append(
            {
                "effects": members,
                "probability": round(probability, 5),
                "group": group_id if candidate.effects in inside else None,
                "parameters": _parameters(twin, problem, candidate, by_id),
                "log_evidence_gain": round(candidate.gain, 2),
            }
        )
    entries.append({"effects": [], "probability": round(decision.empty, 5), "group": None})
    families = found.null_families
    unknown: dict[str, Any] = {"effects": ["unknown"], "equation": equation_of(families) if families else "electrical"}
    entries.append(unknown | {"probability": round(decision.unknown, 5), "group": None})
    total = sum(e["probability"] for e in entries)
    for e in entries:
        e["probability"] = round(e["probability"] / total, 5)
    lead = {"explained": 0, "group": 0, "partly": 0}
    if decision.verdict in lead:
        return entries
    first = [e for e in entries if e["effects"] == ([] if decision.verdict == "no_gap" else ["unknown"])]
    return first + [e for e in entries if e not in first]


def _parameters(twin: Twin, problem: Problem, candidate: Candidate, by_id: Mapping) -> dict:
    """Fitted parameters of a set with 90 % intervals, prefixed by the effect where two share a name."""
    point = candidate.point
    deviation = {m: float(np.sqrt(point.covariance[c, c])) for c, m in enumerate(point.free)}
    out: dict[str, dict] = {}
    for effect in candidate.effects:
        own = problem.effect_parameters(by_id[effect])
        values = {problem.parameters[m].name: float(point.values[m]) for m in own}
        sds = {problem.parameters[m].name: deviation.get(m, 0.0) for m in own}
        report = getattr(twin, "report", None)
        if report is not None:
            reported = report(effect, values, sds)
        else:
            reported = {
                n.split(".", 1)[-1]: (
                    v, v - INTERVAL * sds[n], v + INTERVAL * sds[n], problem.parameters[problem.names[n]].units
                )
                for n, v in values.items()
            }  # fmt: skip
        for name, (value, low, high, units) in reported.items():
            key = name if name not in out else f"{effect}.{name}"
            out[key] = {"value": value, "low": low, "high": high, "units": units, "effect": effect}
    return out


def detectable(problem: Problem, found: Search) -> dict:
    """Effect -> smallest size of its first parameter that these recordings would have shown at five sigma."""
    out = {}
    for c in found.singles:
        if not c.signature.size:
            continue
        signature = problem.whiten(c.signature)
        strength = np.einsum("sc,sc->c", signature, problem.projected(found.null, signature))
        m = [p.name for p in problem.parameters if p.effect == c.effects[0]]
        if m and strength[0] > 0:
            out[c.effects[0]] = {"parameter": m[0].split(".", 1)[-1], "size": float(5.0 / np.sqrt(strength[0]))}
    return out


def _mixture(problem: Problem, found: Search, decision: Decision, best: Candidate | None) -> list[tuple[Point, float]]:
    """Fits over which a fault is averaged: the group and every other believable reading, by probability."""
    points = [(c.point, p) for c, p in decision.sets if p > 0.01]
    if best is None or decision.empty > 0.01:
        points.append((found.null, decision.empty + (decision.unknown if best is None else 0.0)))
    total = sum(p for _, p in points)
    return [(q, p / total) for q, p in points] if total > 0 else [(found.null, 1.0)]


def fault_vectors(
    problem: Problem,
    point: Point,
    confirm: tuple[Problem, Rung] | None,
    mixture: Sequence[tuple[Point, float]] = (),
) -> dict[str, dict]:
    """Recording -> fault component -> value with 90 % interval, widened by what else is believable."""
    deviation = {m: float(np.sqrt(point.covariance[c, c])) for c, m in enumerate(point.free)}
    spread = {m: 0.0 for m in deviation}
    for m in spread:
        spread[m] = sum(w * (q.values[m] - point.values[m]) ** 2 for q, w in mixture)
    out: dict[str, dict] = {}

    def add(m: int, value: float, sd: float) -> None:
        p = problem.parameters[m]
        for name in p.recordings or ():
            interval = {
                "value": float(value),
                "low": float(value - INTERVAL * sd),
                "high": float(value + INTERVAL * sd),
            }
            out.setdefault(name, {})[str(p.fault)] = interval

    for m, sd in deviation.items():
        if problem.parameters[m].fault is not None:
            add(m, point.values[m], float(np.hypot(sd, np.sqrt(spread[m]))))
    if confirm is not None:
        other, rung = confirm
        for m in other.nuisances:
            p = problem.parameters[m]
            if p.fault is None or m in deviation:
                continue
            # what the unit's own uncertainty brings, as in the explored recordings, and what this recording leaves
            typical = [sd for k, sd in deviation.items() if problem.parameters[k].fault == p.fault]
            common = float(np.median(typical)) if typical else 0.0
            add(m, rung.values[m], float(np.hypot(common, rung.deviations.get(m, p.sd))))
    return out


def biased(before: Mapping[str, dict], after: Mapping[str, dict]) -> dict[str, float]:
    """Component -> mean estimate before less after, where it is more than a quarter of the interval."""
    out = {}
    for component in dict.fromkeys(c for f in before.values() for c in f):
        shifts = [f[component]["value"] - after[n][component]["value"] for n, f in before.items() if component in f]
        widths = [after[n][component]["high"] - after[n][component]["low"] for n, f in before.items() if component in f]
        if abs(np.mean(shifts)) > 0.25 * np.mean(widths):
            out[component] = float(np.mean(shifts))
    return out


#: 1 % of the default sampling range of each fault component
FAULT_SCALE = {"Na": 1e-3, "Nb": 1e-3, "Nc": 1e-3, "xi_x": 2e-3, "xi_y": 2e-3, "dT": 1.2}


def fault_ladder(
    before: Mapping[str, dict], after: Mapping[str, dict], truths: Mapping[str, np.ndarray]
) -> dict | None:
    """Root mean square fault error on confirm recordings with a truth, in percent of range, before and after."""
    names = list(FAULT_SCALE)

    def rms(faults: Mapping[str, dict]) -> float:
        errors = [
            (f[c]["value"] - truths[n][names.index(c)]) / FAULT_SCALE[c]
            for n, f in faults.items()
            if n in truths
            for c in f
        ]
        return float(np.sqrt(np.mean(np.square(errors)))) if errors else float("nan")

    if not any(n in truths for n in before):
        return None
    recalibrated, reached = rms(before), rms(after)
    typical = [(v["high"] - v["low"]) / (2 * INTERVAL) / FAULT_SCALE[c] for f in after.values() for c, v in f.items()]
    floor = float(np.sqrt(np.mean(np.square(typical))))
    entry = {"nominal": None, "recalibrated": recalibrated, "placebo": None, "after": reached, "floor": floor}
    return entry | {"closed": closed(recalibrated, reached, floor, 6 * len(before))}

"""What of a verdict survives the recordings that took no part in it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .diagnose import Diagnosis
from .how_far import own_nuisances, refit
from .sizes import outside

RIVALS = 12
VISIBLE = 1.3  # root mean square from which a misfit on the confirm recordings is more than their noise
CLEAR_DROP = 25.0  # of chi-square: a set that takes away more has been seen to help, however small the misfit
WORSE = 0.95  # of the recalibrated residual: a named set that leaves more than this has not helped
BETTER = 0.7  # of the named set's residual: a rival that leaves less than this is preferred


@dataclass(frozen=True)
class Rival:
    """A fitted set: gain in log evidence where it was fitted, root mean square on the confirm recordings."""

    effects: tuple[str, ...]
    gain: float
    rms: float


def held_out(diagnosis: Diagnosis, most: int = RIVALS) -> dict:
    """Outcome of the named set on the confirm recordings, beside the other sets that were fitted (``most`` in all).

    Returns
    -------
    ``outcome``: ``holds``; ``contradicted``, the named set leaves these recordings no better than the recalibrated
    nominal model does; ``rival``, a set that fitted the explore recordings less well leaves them much better;
    ``not seen``, they show no gap; ``no claim``, nothing was named.
    ``before``: the rung that this counts from: ``recalibrated``, or ``nominal`` for a set of calibration effects, which
    the former has.
    ``claimed``: the effects that are left to claim: the named set, or what it shares with the rivals that hold better.
    ``rivals``: effects, gain in log evidence on the explore recordings and root mean square on these, best first.
    """
    ladder, decision = diagnosis.ladder, diagnosis.decision
    candidates = diagnosis.found.candidates[:most]
    if ladder is None or not candidates:
        return {"outcome": "no claim", "claimed": [], "rivals": []}
    problem = ladder.problem
    free = own_nuisances(problem)
    rivals = [Rival(c.effects, c.gain, refit(problem, c.point.values, free).rms) for c in candidates]
    best = rivals[0]
    by_id = {h.effect: h for h in diagnosis.twin.hypotheses}
    structural = any(by_id[e].kind != "calibration" for e in best.effects)
    before = (ladder.recalibrated if structural else ladder.nominal).rms
    named = decision.verdict in ("explained", "group", "partly")
    better = [r for r in rivals[1:] if r.rms < BETTER * best.rms and r.rms < WORSE * before]
    visible = max(VISIBLE, 1.0 + 2.0 / np.sqrt(2.0 * len(problem.cells)))
    claimed: Sequence[str] = ()
    if not named:
        outcome = "no claim"
    elif before < visible and best.rms < visible and before**2 - best.rms**2 < CLEAR_DROP / len(problem.cells):
        outcome, claimed = "not seen", best.effects
    elif best.rms > VISIBLE and better:
        fits = {c.effects: c.point for c in candidates}
        held = [(*r.effects, *outside(diagnosis.explore, fits[r.effects], by_id)) for r in better]
        outcome, claimed = "rival", shared([best.effects, *held])
        if set(claimed) == set(best.effects):
            outcome = "holds"
    elif best.rms > WORSE * before:
        outcome = "contradicted"
    else:
        outcome, claimed = "holds", best.effects
    listed = [
        {"effects": list(r.effects), "log_evidence_gain": round(r.gain, 2), "rms": round(r.rms, 4)}
        for r in sorted(rivals, key=lambda r: r.rms)
    ]
    rung = "recalibrated" if structural else "nominal"
    return {"outcome": outcome, "before": rung, "claimed": list(claimed), "rivals": listed}


def contested(diagnosis: Diagnosis) -> bool:
    """Whether the named set leaves enough of the confirm recordings for a rival to be preferred."""
    return diagnosis.ladder is not None and diagnosis.ladder.after.rms > VISIBLE


def claim(diagnosis: Diagnosis, outcome: dict) -> None:
    """Let the confirm recordings decide what a verdict claims.

    Where a rival holds much better there, the first entry of ``which`` becomes what it shares with the named set, with
    that set's probability, the verdict ``partly``; the named set stays in second place. ``unknown`` if they share
    nothing.
    """
    verdict = diagnosis.verdict
    if outcome["outcome"] != "rival":
        return
    first, rest = verdict["which"][0], verdict["which"][1:]
    claimed = list(outcome["claimed"])
    same = [e for e in rest if sorted(e["effects"]) == sorted(claimed)]
    if not claimed:
        unknown = next(e for e in rest if e["effects"] == ["unknown"])
        unknown["probability"], first["probability"] = first["probability"], unknown["probability"]
        verdict["which"] = [unknown, first, *(e for e in rest if e is not unknown)]
        verdict["verdict"] = "unknown"
        return
    parameters = {k: p for k, p in first.get("parameters", {}).items() if p.get("effect") in claimed}
    entry = same[0] if same else {"effects": claimed, "probability": 0.0, "group": None, "parameters": parameters}
    entry["probability"], first["probability"] = first["probability"], entry["probability"]
    verdict["which"] = [entry, first, *(e for e in rest if e is not entry)]
    verdict["verdict"] = "partly"


def shared(sets: Sequence[Sequence[str]]) -> list[str]:
    """Effects that all sets have, in the order of the first."""
    return [e for e in sets[0] if all(e in other for other in sets[1:])]

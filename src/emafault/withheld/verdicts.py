"""Reads verdict files and judges each against its key: one flat row a case.

In verdicts from schema 2.0 on a listed effect is named by its inclusion probability or as one of a group; older ones
name the first set of ``which``.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..effects import EFFECTS
from ..errors import InputError
from ..faults import FAULT_NAMES
from .benches import rival_distances
from .described import claims, matches
from .detectability import FAULT_SCALE

DETECTABLE = 25.0  # squared distance to the nominal model
IN_GROUP = 6.0  # squared distance within which a group's member may lie of the truth
CALIBRATION = {e for e, effect in EFFECTS.items() if effect.kind == "calibration"}
UNKNOWN = "unknown"
KINDS = ("signal", "features")
NAMED = 0.9  # inclusion probability from which a listed effect is named


@dataclass(frozen=True)
class Answer:
    """What a verdict says first: a named set, a group of alternatives, or a word that names no listed effect."""

    kind: str  # named | group | described | unknown | no_gap | failed
    effects: tuple[str, ...]
    probability: float


def read_verdict(path: Path) -> dict:
    """Read a ``diagnosis.json``.

    Raises
    ------
    InputError : not a verdict file
    """
    try:
        verdict = json.loads(path.read_text())
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: not a readable verdict file ({error})") from error
    if not isinstance(verdict, dict) or "verdict" not in verdict or not isinstance(verdict.get("which"), list):
        raise InputError(f"{path}: not a verdict file; the keys 'verdict' and 'which' are needed")
    return verdict


def group_members(verdict: Mapping, entry: Mapping) -> tuple[str, ...]:
    """Members of an entry's group, which it gives as a list, by its number in ``groups``, or by being in one."""
    group = entry.get("group")
    groups = verdict.get("groups") or []
    if isinstance(group, int) and not isinstance(group, bool) and 0 <= group < len(groups):
        return tuple(groups[group])
    if isinstance(group, list):
        return tuple(group)
    for members in groups:
        if set(entry["effects"]) & set(members):
            return tuple(members)
    return tuple(entry["effects"])


def merged_probabilities(verdict: Mapping) -> list[tuple[tuple[str, ...], float]]:
    """Hypotheses with their probabilities, members of a declared group added up, most probable first."""
    total: dict[tuple[str, ...], float] = {}
    for entry in verdict["which"]:
        members = tuple(sorted(entry["effects"]))
        if entry.get("group") is not None:
            members = ("group", *sorted({*entry["effects"], *group_members(verdict, entry)}))
        total[members] = total.get(members, 0.0) + float(entry["probability"])
    return sorted(total.items(), key=lambda item: -item[1])


def by_inclusion(verdict: Mapping) -> bool:
    """Whether a verdict names by inclusion probabilities."""
    return "inclusion" in verdict


def named_by_inclusion(verdict: Mapping) -> tuple[str, ...]:
    """Listed effects whose inclusion probability names them."""
    return tuple(sorted(e for e, p in verdict["inclusion"].items() if e in EFFECTS and p >= NAMED))


def listed_groups(verdict: Mapping) -> list[tuple[str, ...]]:
    """Groups that hold a listed effect."""
    return [tuple(g) for g in verdict.get("groups") or [] if set(g) & set(EFFECTS)]


def listed_names(verdict: Mapping) -> tuple[str, ...]:
    """Listed effects that a verdict names, alone or in a group."""
    if not by_inclusion(verdict):
        answer = first_answer(verdict)
        return tuple(sorted(set(answer.effects) & set(EFFECTS)))
    grouped = {e for g in listed_groups(verdict) for e in g if e in EFFECTS}
    return tuple(sorted({*named_by_inclusion(verdict), *grouped}))


def first_answer(verdict: Mapping) -> Answer:
    """What the verdict says, with the probability that it gives to it."""
    merged = dict(merged_probabilities(verdict))
    kind = verdict["verdict"]
    if kind in ("no_gap", "described", "failed"):
        return Answer(kind, (), merged.get((), 0.0))
    if kind == "unknown":
        return Answer("unknown", (UNKNOWN,), merged.get((UNKNOWN,), 0.0))
    if by_inclusion(verdict):
        return _answer_by_inclusion(verdict, merged)
    entry = next((e for e in verdict["which"] if e["effects"] and UNKNOWN not in e["effects"]), None)
    if entry is None:
        return Answer("unknown", (UNKNOWN,), merged.get((UNKNOWN,), 0.0))
    if kind == "group":
        members = group_members(verdict, entry)
        return Answer("group", members, merged.get(("group", *sorted(members)), float(entry["probability"])))
    return Answer("named", tuple(entry["effects"]), float(entry["probability"]))


def _answer_by_inclusion(verdict: Mapping, merged: Mapping[tuple[str, ...], float]) -> Answer:
    named, groups = named_by_inclusion(verdict), listed_groups(verdict)
    if groups:
        members = tuple(sorted({*named, *(e for g in groups for e in g)}))
        return Answer("group", members, merged.get(("group", *members), 0.0))
    if named:
        return Answer("named", named, merged.get(named, 0.0))
    return Answer("unknown", (UNKNOWN,), merged.get((UNKNOWN,), 0.0))


def names_truth(named: tuple[str, ...], truth: tuple[str, ...]) -> bool:
    """Whether a named set's structural part is the truth's and the truth's calibration effects are all named."""
    structural = set(named) - CALIBRATION
    return structural == set(truth) - CALIBRATION and set(truth) & CALIBRATION <= set(named)


def is_right(answer: Answer, key: Mapping, rivals: Mapping[str, float]) -> bool:
    """Whether an answer is right; of one effect a group is if it holds the truth and nothing that lies far from it."""
    truth = tuple(key["case"]["effects"])
    if key["case"]["left_out"]:
        return answer.kind in ("unknown", "described")
    if not truth:
        return answer.kind == "no_gap"
    if answer.kind == "named":
        return names_truth(answer.effects, truth)
    return len(truth) == 1 and in_group(answer, truth, rivals)


def in_group(answer: Answer, truth: tuple[str, ...], rivals: Mapping[str, float]) -> bool:
    """Whether an answer is a group that holds the truth and nothing that lies far from it."""
    if answer.kind != "group" or not set(truth) <= set(answer.effects):
        return False
    return all(rivals.get(m, np.inf) <= IN_GROUP for m in answer.effects if m not in truth)


def judge(key: Mapping, verdict: Mapping, oracle: Mapping | None = None) -> dict:
    """Compare one verdict with its key.

    Parameters
    ----------
    key : the case's key
    verdict : the case's ``diagnosis.json``
    oracle : the same from a diagnosis that was told the effects

    Returns
    -------
    a flat row of everything that the metrics need
    """
    case = key["case"]
    truth, left_out = tuple(case["effects"]), bool(case["left_out"])
    answer, merged = first_answer(verdict), merged_probabilities(verdict)
    best, confidence = merged[0] if merged else ((), 0.0)
    detectability = key["detectability"] or {"nominal": 0.0, "members": {}}
    detectable = bool(truth) and min(detectability["members"].values()) >= DETECTABLE
    rivals = _rivals(key, verdict, answer, best, detectable)
    right = is_right(answer, key, rivals)
    unknown = sum(float(e["probability"]) for e in verdict["which"] if UNKNOWN in e["effects"])
    if answer.kind == "described":
        unknown += dict(merged).get((), 0.0)  # no listed effect, and yet a gap
    unlisted = [_unlisted(u, verdict) for u in key.get("unlisted") or ()]
    row = {
        "name": Path(verdict.get("bench", "")).name,
        "bench": f"{'T1' if case['rung'] == 'T3' else case['rung']} {case['seed']}",
        "rung": case["rung"],
        "seed": case["seed"],
        "plain": bool(case.get("plain")),
        "truth": list(truth),
        "left_out": list(case["left_out"]),
        "amplitude": case["amplitude"],
        "strong_faults": case["strong_faults"],
        "distance": detectability["nominal"],
        "detectable": detectable,
        "nearest_rival": key.get("nearest_rival"),
        "unlisted": unlisted,
        "controller": dict(case.get("controller") or {}),
        "verdict": verdict["verdict"],
        "answer": answer.kind,
        "failed": answer.kind == "failed",
        "named": list(answer.effects),
        "inclusion": dict(verdict.get("inclusion") or {}),
        "right": right,
        "in_group": right or in_group(answer, truth, rivals),
        "wrong_name": answer.kind in ("named", "group") and not right,
        "rivals": rivals,
        "confidence": min(1.0, confidence),
        "confident_right": bool(merged) and _hypothesis_right(best, truth, left_out, answer.kind, rivals),
        "unknown": min(1.0, unknown),
        "equation_right": _equation_right(verdict, truth)
        if answer.kind in ("unknown", "described") and truth
        else None,
        "covered": _coverage(verdict, case) if answer.kind == "named" and not case["forms"] else [],
    }
    row |= _listed(verdict, truth, rivals) | claims(verdict, key.get("unlisted") or (), truth)
    shrinks = verdict.get("shrinks") or {}
    for kind in KINDS:
        row[kind] = _ladder(shrinks.get(kind))
    row["fault_vector"] = _fault_errors(key, verdict, oracle)
    return row


def _rivals(
    key: Mapping, verdict: Mapping, answer: Answer, best: tuple[str, ...], detectable: bool
) -> dict[str, float]:
    """Squared distances from the truth of what was named beside it or in its place, where the judgement asks."""
    truth = tuple(key["case"]["effects"])
    if not truth or answer.kind not in ("named", "group"):
        return {}
    asked = {m for g in listed_groups(verdict) if by_inclusion(verdict) and set(g) & set(truth) for m in g}
    if answer.kind == "group" and set(truth) <= set(answer.effects):
        asked |= set(answer.effects)
    if best[:1] == ("group",) and set(truth) <= set(best):
        asked |= set(best[1:])
    if len(truth) == 1 and detectable and len(answer.effects) == 1:
        asked |= set(answer.effects)
    others = [m for m in EFFECTS if m in asked and m not in truth]
    rivals = rival_distances(dict(key), others) if others else {}
    # a fault in the group is the nominal model, in which faults are free
    nominal = (key["detectability"] or {"nominal": 0.0})["nominal"]
    return rivals | {m: nominal for m in answer.effects if m in FAULT_NAMES}


def _listed(verdict: Mapping, truth: tuple[str, ...], rivals: Mapping[str, float]) -> dict:
    """Whether every true effect is named, alone or in a group whose members lie near it, and what is named beside."""
    if not by_inclusion(verdict):
        answer = first_answer(verdict)
        groups = [answer.effects] if answer.kind == "group" else []
        named = set(answer.effects) & set(EFFECTS) if answer.kind == "named" else set()
    else:
        groups, named = listed_groups(verdict), set(named_by_inclusion(verdict))
    beside = named - set(truth)
    for group in groups:
        near = all(rivals.get(m, np.inf) <= IN_GROUP for m in group if m not in truth)
        if near and set(group) & set(truth):
            named |= set(group) & set(truth)
        else:
            beside |= (set(group) & set(EFFECTS)) - set(truth)
    return {"all_named": bool(truth) and set(truth) <= named, "beside": sorted(beside), "another": bool(beside),
            "another_structural": bool(beside - CALIBRATION)}  # fmt: skip


def _unlisted(told: Mapping, verdict: Mapping) -> dict:
    """What is unlisted in a case, whether it shows, and what of it the verdict describes rightly."""
    kept = {n: told[n] for n in ("name", "inside", "distance", "size")}
    return kept | {"detectable": told["distance"] >= DETECTABLE} | matches(verdict, told)


def _hypothesis_right(
    hypothesis: tuple[str, ...], truth: tuple[str, ...], left_out: bool, kind: str, rivals: Mapping[str, float]
) -> bool:
    """Whether the most probable hypothesis is the truth; a group by the same distances as an answer's."""
    if left_out:
        return hypothesis == (UNKNOWN,) or (kind == "described" and not hypothesis)
    if hypothesis[:1] == ("group",):
        return bool(truth) and in_group(Answer("group", hypothesis[1:], 0.0), truth, rivals)
    if not truth or not hypothesis:
        return hypothesis == truth
    return names_truth(hypothesis, truth)


def _equation_right(verdict: Mapping, truth: tuple[str, ...]) -> bool:
    """Whether the likeliest unknown, or something described, is in an equation in which an effect is to be found."""
    if verdict["verdict"] == "described":
        found = [str(d["equation"]) for d in verdict.get("discovered") or ()]
    else:
        entries = [e for e in verdict["which"] if UNKNOWN in e["effects"] and e.get("equation")]
        found = [str(max(entries, key=lambda e: e["probability"])["equation"])] if entries else []
    places = {place for effect in truth for place in EFFECTS[effect].equations}
    return any(equation == place or equation.startswith(f"{place}_") for equation in found for place in places)


def _coverage(verdict: Mapping, case: Mapping) -> list[bool]:
    """Per reported parameter of an exactly named set: whether its interval holds the true value."""
    entry = next((e for e in verdict["which"] if e["effects"] and UNKNOWN not in e["effects"]), None)
    if entry is None or not names_truth(tuple(entry["effects"]), tuple(case["effects"])):
        return []
    covered = []
    for effect, values in case["effects"].items():
        for name, value in values.items():
            found = entry.get("parameters", {}).get(name) or entry.get("parameters", {}).get(f"{effect}.{name}")
            if found is None or not found["low"] < found["high"]:
                continue
            if name == "psi":
                middle = 0.5 * (found["low"] + found["high"])
                value = middle + (value - middle + np.pi) % (2.0 * np.pi) - np.pi
            covered.append(bool(found["low"] <= value <= found["high"]))
    return covered


def _ladder(shrinks: Mapping | None) -> dict | None:
    """Squares of the ladder of how far, null where the verdict itself could not tell."""
    if not shrinks or shrinks.get("closed") is None:
        return None
    kept = {rung: shrinks.get(rung) for rung in ("recalibrated", "placebo", "after", "floor")}
    return {rung: None if value is None else float(value) ** 2 for rung, value in kept.items()}


def _fault_errors(key: Mapping, verdict: Mapping, oracle: Mapping | None) -> dict | None:
    """Squared errors of the fault vectors of faulty recordings, in units of the ranges, summed over a bench.

    ``oracle`` is None where no told diagnosis was run, ``bound`` (the best possible) where the key has none.
    """
    vectors = verdict.get("fault_vector") or {}
    total = {"before": 0.0, "after": 0.0, "oracle": 0.0, "bound": 0.0}
    whole = {"oracle": oracle is not None, "bound": True}
    count = 0
    for m, plan in enumerate(key["case"]["recordings"]):
        entry = vectors.get(f"recording_{m}.nc") or vectors.get(f"recording_{m}")
        if plan["health"] == "healthy" or entry is None:
            continue
        if any(name not in (entry.get(stage) or {}) for stage in ("before", "after") for name in FAULT_NAMES):
            continue
        told = ((oracle or {}).get("fault_vector") or {}).get(f"recording_{m}.nc")
        bound = key["fault_sd"][m] if key["fault_sd"] else None
        whole["oracle"] &= told is not None
        whole["bound"] &= bound is not None
        for c, name in enumerate(FAULT_NAMES):
            true, scale = plan["fault"][c], FAULT_SCALE[c]
            for stage in ("before", "after"):
                total[stage] += ((entry[stage][name]["value"] - true) / scale) ** 2
            if told is not None:
                total["oracle"] += ((told["after"][name]["value"] - true) / scale) ** 2
            if bound is not None:
                total["bound"] += bound[c] ** 2
            count += 1
    if not count:
        return None
    return {n: v for n, v in total.items() if whole.get(n, True)} | {n: None for n in whole if not whole[n]}

"""Reads verdict files and judges each against its key: one flat row a case."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..effects import EFFECTS
from ..errors import InputError
from ..faults import FAULT_NAMES
from .benches import rival_distances
from .detectability import FAULT_SCALE

DETECTABLE = 25.0  # squared distance to the nominal model
IN_GROUP = 6.0  # squared distance within which a group's member may lie of the truth
CALIBRATION = {e for e, effect in EFFECTS.items() if effect.kind == "calibration"}
UNKNOWN = "unknown"
KINDS = ("signal", "features")


@dataclass(frozen=True)
class Answer:
    """What a verdict says first: a named set, a group of alternatives, ``unknown`` or ``no_gap``."""

    kind: str  # named | group | unknown | no_gap
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
            members = ("group", *sorted(group_members(verdict, entry)))
        total[members] = total.get(members, 0.0) + float(entry["probability"])
    return sorted(total.items(), key=lambda item: -item[1])


def first_answer(verdict: Mapping) -> Answer:
    """What the verdict says, with the probability that it gives to it."""
    merged = dict(merged_probabilities(verdict))
    kind = verdict["verdict"]
    if kind == "no_gap":
        return Answer("no_gap", (), merged.get((), 0.0))
    if kind == "unknown":
        return Answer("unknown", (UNKNOWN,), merged.get((UNKNOWN,), 0.0))
    entry = next((e for e in verdict["which"] if e["effects"] and UNKNOWN not in e["effects"]), None)
    if entry is None:
        return Answer("unknown", (UNKNOWN,), merged.get((UNKNOWN,), 0.0))
    if kind == "group":
        members = group_members(verdict, entry)
        return Answer("group", members, merged.get(("group", *sorted(members)), float(entry["probability"])))
    return Answer("named", tuple(entry["effects"]), float(entry["probability"]))


def names_truth(named: tuple[str, ...], truth: tuple[str, ...]) -> bool:
    """Whether a named set's structural part is the truth's and the truth's calibration effects are all named."""
    structural = set(named) - CALIBRATION
    return structural == set(truth) - CALIBRATION and set(truth) & CALIBRATION <= set(named)


def is_right(answer: Answer, key: Mapping, rivals: Mapping[str, float]) -> bool:
    """Whether an answer is right; of one effect a group is if it holds the truth and nothing that lies far from it."""
    truth = tuple(key["case"]["effects"])
    if key["case"]["left_out"]:
        return answer.kind == "unknown"
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
    oracle : the same from a diagnosis that was told the effect; None takes the best possible error instead

    Returns
    -------
    a flat row of everything that the metrics need
    """
    case = key["case"]
    truth = tuple(case["effects"])
    answer = first_answer(verdict)
    rivals: dict[str, float] = {}
    detectability = key["detectability"] or {"nominal": 0.0, "members": {}}
    detectable = bool(truth) and min(detectability["members"].values()) >= DETECTABLE
    if truth and answer.kind in ("named", "group"):
        others = [m for m in answer.effects if m in EFFECTS and m not in truth]
        ask = answer.kind == "group" and set(truth) <= set(answer.effects)
        ask |= len(truth) == 1 and detectable and len(answer.effects) == 1
        rivals = rival_distances(dict(key), others) if ask else {}
        # a fault in the group is the nominal model, in which faults are free
        rivals |= {m: detectability["nominal"] for m in answer.effects if m in FAULT_NAMES}
    right = is_right(answer, key, rivals)
    unknown = sum(float(e["probability"]) for e in verdict["which"] if UNKNOWN in e["effects"])
    merged = merged_probabilities(verdict)
    best, confidence = merged[0] if merged else ((), 0.0)
    row = {
        "name": Path(verdict.get("bench", "")).name,
        "rung": case["rung"],
        "seed": case["seed"],
        "truth": list(truth),
        "left_out": list(case["left_out"]),
        "amplitude": case["amplitude"],
        "strong_faults": case["strong_faults"],
        "distance": detectability["nominal"],
        "detectable": detectable,
        "answer": answer.kind,
        "named": list(answer.effects),
        "right": right,
        "in_group": right or in_group(answer, truth, rivals),
        "wrong_name": answer.kind in ("named", "group") and not right,
        "rivals": rivals,
        "confidence": min(1.0, confidence),
        "confident_right": _hypothesis_right(best, truth, bool(case["left_out"])),
        "unknown": min(1.0, unknown),
        "equation_right": _equation_right(verdict, truth) if answer.kind == "unknown" and truth else None,
        "covered": _coverage(verdict, case) if answer.kind == "named" and not case["forms"] else [],
    }
    shrinks = verdict.get("shrinks") or {}
    for kind in KINDS:
        row[kind] = _ladder(shrinks.get(kind))
    row["fault_vector"] = _fault_errors(key, verdict, oracle)
    return row


def _hypothesis_right(hypothesis: tuple[str, ...], truth: tuple[str, ...], left_out: bool) -> bool:
    if left_out:
        return hypothesis == (UNKNOWN,)
    if hypothesis[:1] == ("group",):
        return bool(truth) and set(truth) <= set(hypothesis[1:])
    if not truth or not hypothesis:
        return hypothesis == truth
    return names_truth(hypothesis, truth)


def _equation_right(verdict: Mapping, truth: tuple[str, ...]) -> bool:
    """Whether the likeliest unknown is placed in an equation in which one of the effects is to be found."""
    entries = [e for e in verdict["which"] if UNKNOWN in e["effects"] and e.get("equation")]
    if not entries:
        return False
    equation = str(max(entries, key=lambda e: e["probability"])["equation"])
    places = {place for effect in truth for place in EFFECTS[effect].equations}
    return any(equation == place or equation.startswith(f"{place}_") for place in places)


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
    return {rung: float(shrinks[rung]) ** 2 for rung in ("recalibrated", "placebo", "after", "floor")}


def _fault_errors(key: Mapping, verdict: Mapping, oracle: Mapping | None) -> dict | None:
    """Squared errors of the fault vectors of faulty recordings, in units of the ranges, summed over a bench."""
    vectors = verdict.get("fault_vector") or {}
    total = {"before": 0.0, "after": 0.0, "oracle": 0.0}
    count = 0
    for m, plan in enumerate(key["case"]["recordings"]):
        entry = vectors.get(f"recording_{m}.nc") or vectors.get(f"recording_{m}")
        if plan["health"] == "healthy" or entry is None:
            continue
        told = None
        if oracle is not None:
            told = (oracle.get("fault_vector") or {}).get(f"recording_{m}.nc")
        bound = key["fault_sd"][m] if key["fault_sd"] else None
        if told is None and bound is None:
            continue
        for c, name in enumerate(FAULT_NAMES):
            true, scale = plan["fault"][c], FAULT_SCALE[c]
            if any(name not in (entry.get(stage) or {}) for stage in ("before", "after")):
                continue
            for stage in ("before", "after"):
                total[stage] += ((entry[stage][name]["value"] - true) / scale) ** 2
            if told is not None:
                total["oracle"] += ((told["after"][name]["value"] - true) / scale) ** 2
            else:
                assert bound is not None
                total["oracle"] += bound[c] ** 2
            count += 1
    return total | {"count": count} if count else None

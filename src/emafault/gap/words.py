"""A verdict in plain words: the finding, its certainty, and what these recordings cannot tell."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

#: excess of a family from which "clearly" is said
_CLEAR = 10.0
MOST = 3  # parameters named in a sentence


def effect_words(effects: Sequence[str]) -> str:
    """Effects in words: ``friction asymmetry and load constant``."""
    names = [e.replace("_", " ") for e in effects]
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}" if names else "nothing"


def number(value: float, width: float = 0.0) -> str:
    """A value to three digits, or to two of the ``width`` that it is known to where those are more."""
    digits = 3
    if value and 0.0 < width < abs(value):
        digits = max(digits, int(np.floor(np.log10(abs(value))) - np.floor(np.log10(width))) + 2)
    return f"{value:.{digits}g}"


def interval(p: Mapping[str, Any]) -> tuple[str, str, str]:
    """Value, lower and upper bound of a fitted parameter."""
    width = p["high"] - p["low"]
    return number(p["value"], width), number(p["low"], width), number(p["high"], width)


def parameter_words(parameters: Mapping[str, Mapping[str, Any]]) -> str:
    """The first parameters with units and 90 % intervals."""
    parts = []
    for name, p in list(parameters.items())[:MOST]:
        units = "" if p["units"] == "1" else f" {p['units']}"
        value, low, high = interval(p)
        parts.append(f"{name} = {value}{units} ({low} to {high})")
    more = len(parameters) - MOST
    return ", ".join(parts) + (f" and {more} more" if more > 0 else "")


def finding(verdict: Mapping[str, Any]) -> str:
    """The finding and its certainty, in two or three sentences."""
    first = verdict["which"][0]
    kind, where = verdict["verdict"], verdict["where"]
    if kind == "no_gap":
        text = (
            f"The nominal simulator reproduces these recordings within the unit's tolerances (probability "
            f"{_percent(first['probability'])}); no effect needs to be added."
        )
        seen = [w for w in where if w["z"] > _CLEAR]
        return text + (f" What is left is largest in {_place(seen[0])}." if seen else "")
    if kind == "unknown":
        text = (
            f"The simulator and these recordings differ, and nothing in the library explains it (probability "
            f"{_percent(first['probability'])} that the cause is not in the library)."
        )
        if verdict.get("before_confirm") in ("explained", "group", "partly"):
            best = next((e for e in verdict["which"] if e.get("parameters")), None)
            signal = verdict["shrinks"]["signal"]
            if best is not None and signal is not None:
                text += (
                    f" The explored recordings alone spoke for {effect_words(best['effects'])}, but those that took no "
                    f"part contradict it: their misfit goes from {number(signal['recalibrated'])} to "
                    f"{number(signal['after'])} times the noise."
                )
        moved = (verdict.get("beyond_specification") or [{"z": 0.0}])[0]
        if moved["z"] > (where[0]["z"] if where else 0.0):
            return text + f" To come near, the fit moves {moved_words(moved)}."
        return text + (f" The difference is largest in {_place(where[0])}." if where else "")
    claimed, held_out = _held_out(verdict)
    names = effect_words(first["effects"])
    if kind == "group":
        members = [e for e in verdict["which"] if e.get("group")]
        total = sum(e["probability"] for e in members)
        listed = "; or ".join(effect_words(e["effects"]) for e in members)
        verb = "explains the gap" if claimed else "would explain the explored recordings"
        text = f"One of these {verb}, these recordings cannot say which: {listed} (together {_percent(total)})."
    else:
        several = len(first["effects"]) > 1
        verb = f"explain{'' if several else 's'} the gap" if claimed else "would explain the explored recordings"
        text = f"{names[0].upper()}{names[1:]} {verb} with probability {_percent(first['probability'])}: "
        text += f"{parameter_words(first['parameters'])}."
    if kind == "partly" and claimed:
        remains = verdict.get("remains") or []
        text += " A remainder stays unexplained" + (f", largest in {_place(remains[0])}." if remains else ".")
    return text + held_out


def moved_words(entry: Mapping[str, Any]) -> str:
    """One entry of ``beyond_specification`` in words."""
    name = entry["parameter"].replace(".", " ").replace("_", " ")
    return f"{name} {number(entry['deviations'])} standard deviations from its specification"


def _held_out(verdict: Mapping[str, Any]) -> tuple[bool, str]:
    """Whether anything is claimed once the confirm recordings are seen, and what they say."""
    signal = verdict["shrinks"]["signal"]
    if signal is None:
        return True, " No recording was held out, so nothing confirms it."
    held_out = verdict.get("held_out", {})
    before, after, placebo = signal[held_out.get("before", "recalibrated")], signal["after"], signal["placebo"]
    outcome = held_out.get("outcome", "holds")
    if outcome == "contradicted":
        return False, (
            f" The recordings that took no part contradict it: there the misfit goes from {number(before)} to "
            f"{number(after)} times the noise, so it is not claimed."
        )
    if outcome == "not seen":
        return True, " The recordings that took no part show too little of the gap to confirm or refute it."
    if outcome == "rival":
        kept = held_out["claimed"]
        left = f"only {effect_words(kept)} is claimed" if kept else "nothing is claimed"
        return bool(kept), f" On the recordings that took no part another set does better; {left}."
    figures = f"the misfit falls from {number(before)} to {number(after)} times the noise"
    return True, f" On recordings that took no part {figures} (with a random effect: {number(placebo)})."


def consequence(verdict: Mapping[str, Any]) -> str:
    """What the gap does to the identified fault."""
    biased = verdict.get("biased_outputs") or {}
    if not biased or verdict["verdict"] in ("no_gap", "unknown"):
        return ""
    parts = [f"{name} by {number(value)}{' K' if name == 'dT' else ''}" for name, value in sorted(biased.items())]
    return f"Left out of the simulator, it shifts the identified fault: {', '.join(parts)}."


def cannot_tell(verdict: Mapping[str, Any], hidden: Mapping[str, float] | None = None) -> list[str]:
    """What these recordings cannot tell, one sentence each.

    Parameters
    ----------
    hidden : effects that would not have shown -> smallest visible size over the prior's width
    """
    out = [w["message"] for w in verdict.get("warnings", [])]
    for group in verdict["groups"]:
        out.append(f"Leave the same trace here: {effect_words(group)}.")
    named = {e for entry in verdict["which"][:1] for e in entry["effects"]}
    for pair in verdict.get("confusable", []):
        if named & set(pair["effects"]) and set(pair["effects"]) not in [set(g) for g in verdict["groups"]]:
            out.append(f"Hard to tell apart here: {effect_words(pair['effects'])} (cosine {pair['cosine']:.2f}).")
    if hidden:
        detail = []
        for effect in sorted(hidden, key=lambda e: -hidden[e])[:6]:
            entry = verdict["detectable_from"][effect]
            detail.append(f"{effect.replace('_', ' ')} ({entry['parameter']} below {number(entry['size'])})")
        out.append("Would hardly have shown: " + ", ".join(detail) + ".")
    return out


def summary(verdict: Mapping[str, Any]) -> str:
    """The few lines that the command prints."""
    explore, confirm = verdict["recordings"]["explore"], verdict["recordings"]["confirm"]
    lines = [f"{verdict['bench']}: {verdict['verdict']} ({len(explore)} recordings explored, {len(confirm)} confirmed)"]
    lines.append(f"  {finding(verdict)}")
    text = consequence(verdict)
    if text:
        lines.append(f"  {text}")
    for entry in verdict["which"]:
        if entry["probability"] >= 0.005:
            label = "+".join(entry["effects"]) or "no gap"
            lines.append(f"  {100 * entry['probability']:5.1f} %  {label}")
    for entry in verdict.get("warnings", []):
        if entry["kind"] == "set aside":
            lines.append(f"  {entry['message']}")
    for entry in verdict["next_experiment"][:1]:
        ambient = entry["ambient_temperature"]
        lines.append(f"  next: {entry['command']}" + ("" if ambient is None else f", at {ambient:g} degC"))
    return "\n".join(lines)


def _percent(probability: float) -> str:
    return "over 99.9 %" if probability > 0.999 else f"{100 * probability:.3g} %"


def _place(entry: Mapping[str, Any]) -> str:
    """One entry of ``where`` in words."""
    along = entry["along"].replace("_", " ")
    span = ""
    if entry["from"] != entry["to"]:
        span = f" from {number(entry['from'])} to {number(entry['to'])}"
    elif entry["along"] == "order":
        span = f" {number(entry['from'])}"
    return f"the equation {entry['equation'].replace('_', ' ')}, along {along}{span}"

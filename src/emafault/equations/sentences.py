"""What a diagnosis of the reference actuator has found, in sentences."""

from collections.abc import Mapping, Sequence
from typing import Any

from ..diagnosis.naming import NAMED, POSSIBLE
from .electrical import NAMES
from .telling import differing_settings, setting
from .terms import TERMS


def finding(verdict: Mapping[str, Any]) -> list[str]:
    """What was found, a sentence each: the measuring chain first, then the machine, then the controller."""
    out = [_said(d) for d in verdict["discovered"] if d["form"] != "remainder"]
    kind, first = verdict["verdict"], verdict["which"][0]
    if kind in ("explained", "partly") and first["effects"]:
        sentences = [TERMS[e].SENTENCE for e in first["effects"] if e in TERMS]
        text = "; ".join(sentences)
        out.append(f"{text[0].upper()}{text[1:]} ({fitted(first)}; posterior probability {first['probability']:.3g}).")
    if verdict["groups"]:
        names = "; ".join(" or ".join(g).replace("_", " ") for g in verdict["groups"])
        out.append(f"One of a group that these recordings do not distinguish: {names}.")
    if kind == "no_gap":
        p = first["probability"]
        out.append(
            "The nominal model within the unit's tolerances accounts for these recordings "
            f"(posterior probability {p:.3g})."
        )
    if kind == "unknown":
        possible = sorted((-p, e) for e, p in verdict["inclusion"].items() if p >= POSSIBLE and e in TERMS)
        none = sum(w["probability"] for w in verdict["which"] if w["effects"] in ([], ["unknown"]))
        likely = "".join(f"{e.replace('_', ' ')} {-p:.2g}, " for p, e in possible)
        out.append(
            f"Recordings and model differ in the {_equation(str(first['equation']))}; no listed effect reaches a "
            f"probability of {NAMED} ({likely}none of them {none:.2g})."
        )
    out += _remainders([d for d in verdict["discovered"] if d["form"] == "remainder"])
    for name, g in differing_settings(verdict).items():
        out.append(f"The controller's {setting(name)} is {g['value']:.3g} {g['units']} and not {g['nominal']:.3g}.")
    signal = verdict["shrinks"]["signal"]
    if signal and signal["closed"] is not None:
        share = 100 * min(signal["closed"], 1.0)
        out.append(
            f"On the validation recordings this closes {share:.0f} % of the gap."
            if share > 0.0
            else "On the validation recordings this closes nothing of the gap."
        )
    return out


def _remainders(found: Sequence[Mapping[str, Any]]) -> list[str]:
    """Their sentences, those that say the same of several phases in one."""
    phases: dict[str, list[str]] = {}
    rest = []
    for d in found:
        if d["equation"] in NAMES:
            phases.setdefault(d["sentence"].partition(" leaves ")[2], []).append(d["equation"][-1])
        else:
            rest.append(str(d["sentence"]))
    said = [
        f"The electrical equations of phases {_listed(sorted(p))} leave {what}"
        if len(p) > 1
        else f"The electrical equation of phase {p[0]} leaves {what}"
        for what, p in phases.items()
    ]
    return [*said, *rest]


def _equation(name: str) -> str:
    """An equation in words."""
    return f"electrical equation of phase {name[-1]}" if name in NAMES else f"{name.replace('_', ' ')} equation"


def _listed(words: list[str]) -> str:
    """Words with commas and an "and"."""
    return " and ".join([*([", ".join(words[:-1])] if len(words) > 1 else []), words[-1]])


def _said(found: Mapping[str, Any]) -> str:
    if found["another_form_of"] is None:
        return str(found["sentence"])
    return f"{found['sentence'][:-1]}: much like another form of {found['another_form_of'].replace('_', ' ')}."


def fitted(entry: Mapping[str, Any]) -> str:
    """Parameters of a set or a described form, each with its 90 % interval."""
    parts = []
    for name, p in entry["parameters"].items():
        units = "" if p["units"] == "1" else f" {p['units']}"
        parts.append(f"{name} = {p['value']:z.4g}{units} ({p['low']:z.4g} to {p['high']:z.4g})")
    return ", ".join(parts)


def decides(entry: Mapping[str, Any]) -> bool:
    """Whether a recording of the menu is expected to distinguish anything, in the digits that are told."""
    return float(f"{entry['expected_odds']:.3g}") > 1.0


def separated(sets: Sequence[str]) -> str:
    """What a recording distinguishes: the leading set from a rival, each as the verdict file joins its effects."""
    first, rival = (s.split("+") for s in sets)
    leading = _joined(first)
    more = [e for e in rival if e not in first]
    return f"{leading} from {f'{leading} with {_joined(more)}' if set(first) < set(rival) else _joined(rival)}"


def _joined(effects: Sequence[str]) -> str:
    return " and ".join(e.replace("_", " ") for e in effects)

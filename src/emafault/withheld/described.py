"""What a verdict describes that no catalogue lists, against what the key says was put in."""

from collections.abc import Mapping, Sequence

import numpy as np

from ..effects import EFFECTS

WITHIN = 0.10  # of a described parameter's true value
OF_A_TURN = 0.2  # rad, of an angle, for which a share of the value means nothing
#: what the controller does is told, and no gap of the machine
OWN_BUSINESS = "control"


def _same_equation(said: str, places: Sequence[str]) -> bool:
    return any(said == p or p.startswith(f"{said}_") or said.startswith(f"{p}_") for p in places)


def matches(verdict: Mapping, told: Mapping) -> dict:
    """What of one thing unlisted a verdict has right.

    Returns
    -------
    ``equation_right``, from what is described or else from where the unknown is placed; ``form_right``, form, equation
    and coordinate of one and the same description; ``parameters_right``, None where no parameter is given
    """
    found = [d for d in verdict.get("discovered") or () if _same_equation(str(d["equation"]), told["equation"])]
    placed = [str(e["equation"]) for e in verdict["which"] if "unknown" in e["effects"] and e.get("equation")]
    unknown = verdict["verdict"] == "unknown" and any(_same_equation(p, told["equation"]) for p in placed)
    right = [d for d in found if d["form"] == told["form"] and d["along"] in told["along"]]
    values = [_near(d.get("parameters") or {}, told["parameters"]) for d in right]
    given = [v for v in values if v is not None]
    return {
        "equation_right": bool(found) or unknown,
        "form_right": bool(right),
        "parameters_right": any(given) if given else None,
    }


def _near(said: Mapping, true: Mapping) -> bool | None:
    """Whether all parameters that both have are near; None where they share none."""
    shared = [(n, said[n]["value"], p["value"]) for n, p in true.items() if n in said]
    if not shared:
        return None
    return all(
        bool(abs(np.angle(np.exp(1j * (v - t)))) < OF_A_TURN)
        if n == "centre"
        else abs(abs(v) - abs(t)) <= WITHIN * abs(t)  # which sign a jump or a gain has is a matter of convention
        for n, v, t in shared
    )


def claims(verdict: Mapping, unlisted: Sequence[Mapping], truth: Sequence[str]) -> dict:
    """How many forms a verdict describes in the machine and its measuring chain, and how many of them are not there.

    A remainder counts as a claim about its equation, and so does any form where the thing there has none. Another form
    of a true effect is there, and so is a remainder in an equation of one.
    """
    places = {p for e in truth for p in EFFECTS[e].equations}
    described = [d for d in verdict.get("discovered") or () if d["equation"] != OWN_BUSINESS]
    false = 0
    for d in described:
        near = [u for u in unlisted if _same_equation(str(d["equation"]), u["equation"])]
        there = any(u["form"] is None or d["form"] in (u["form"], "remainder") for u in near)
        own = d.get("another_form_of") in truth or (
            d["form"] == "remainder" and _same_equation(str(d["equation"]), sorted(places))
        )
        false += not (there or own)
    return {"claims": len(described), "false_claims": false, "claimed": bool(described)}


def change_without(row: Mapping, plain: Mapping) -> dict:
    """What something unlisted, or another controller, changes against the same bench without it.

    Returns
    -------
    ``named_without``, ``another_without``; ``inclusion_change``, the largest of an effect of the plant; ``same``,
    whether the verdict on the plant is the same: its word but for what is said of the controller, and its names
    """
    effects = [e for e in EFFECTS if set(EFFECTS[e].equations) != {OWN_BUSINESS}]
    one, other = row["inclusion"], plain["inclusion"]
    moved = [abs(one.get(e, 0.0) - other.get(e, 0.0)) for e in effects if e in one or e in other]
    return {
        "named_without": plain["all_named"],
        "another_without": plain["another"],
        "inclusion_change": max(moved) if one and other and moved else None,
        "same": _of_the_plant(row) == _of_the_plant(plain),
    }


def _of_the_plant(row: Mapping) -> tuple[str, tuple[str, ...]]:
    word = row["verdict"]
    if not row["claims"]:  # nothing but the controller is described
        word = {"described": "no_gap", "partly": "group" if row["answer"] == "group" else "explained"}.get(word, word)
    return word, tuple(sorted(row["named"]))

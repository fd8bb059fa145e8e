"""The page of a measured machine's diagnosis, and what was found in sentences."""

import html
import json
from collections.abc import Mapping
from typing import Any

from ..reporting import diagnosis as figures
from ..reporting.numbers import add_numbers
from ..reporting.page import Page
from ..reporting.regions import add_regions
from .diagnose import Diagnosed
from .shown import numbers, panels

MOST = 8  # sets in the table
TOLD = 6  # parameters in a sentence
OPEN = 0.05  # probability from which an effect that is not named is worth a line


def finding(verdict: Mapping[str, Any]) -> list[str]:
    """What was found, a sentence each."""
    first, kind = verdict["which"][0], verdict["verdict"]
    out = []
    sure = [e for e, p in verdict["inclusion"].items() if p >= 0.9]
    if kind in ("explained", "partly", "group") and sure:
        names = ", ".join(sure).replace("_", " ")
        fitted = {n: p for n, p in first.get("parameters", {}).items() if p["effect"] in sure}
        sizes = f": {_fitted(fitted)}" if 0 < len(fitted) <= TOLD else ""  # the table has them all
        out.append(f"{names[0].upper()}{names[1:]}{sizes}.")
    for group in verdict["groups"]:
        out.append(f"One of a group that these recordings do not distinguish: {_words(group)}.")
    if kind == "no_gap":
        out.append(f"The base model accounts for these recordings (posterior probability {first['probability']:.3g}).")
    if kind == "unknown":
        out.append(
            f"Recordings and model differ in the {str(first['equation']).replace('_', ' ')} equation; no listed effect "
            "reaches a probability of 0.9."
        )
    out += [d["sentence"] for d in verdict["discovered"]]
    held, signal = verdict["held_out"], verdict["shrinks"]["signal"]
    if signal and signal["closed"] is not None and kind != "no_gap":
        share = 100 * signal["closed"]
        said = f"closes {share:.0f} % of the gap" if share > 0.5 else "leaves all of the gap, or more"
        out.append(f"On the validation recordings, what was sealed {said}.")
    if held["outcome"] in ("contradicted", "rival"):
        out.append("The validation recordings changed what is claimed: the seal says what was found before.")
    return out


def cannot_tell(verdict: Mapping[str, Any]) -> list[str]:
    """What is left open: groups, effects neither named nor ruled out, effects that leave no trace here."""
    out = [f"{_words(g)}: one of them acts" for g in verdict["groups"]]
    grouped = {e for g in verdict["groups"] for e in g}
    for effect, p in sorted(verdict["inclusion"].items(), key=lambda x: -x[1]):
        if OPEN < p < 0.9 and effect not in grouped:
            out.append(f"{effect.replace('_', ' ')} has a posterior probability of {p:.2g}")
    if verdict["untold"]:
        out.append(f"of {', '.join(verdict['untold']).replace('_', ' ')} these recordings say nothing")
    return out or ["No listed effect is left between named and ruled out."]


def draw(found: Diagnosed) -> Page:
    """The page of one diagnosis."""
    page = Page(f"Where model and machine {found.verdict['bench']} disagree")
    for sentence in finding(found.verdict):
        page.paragraph(sentence, "lead")
    for note in found.verdict["notes"]:
        page.paragraph(note, "small")
    body(page, found, "", 2)
    page.heading("Sealed before the validation recordings were opened")
    page.parts.append(f"<pre>{html.escape(json.dumps(found.verdict['sealed'], indent=1))}</pre>")
    return page


def body(page: Page, found: Diagnosed, key: str, level: int = 3) -> None:
    """Tables and pictures of one diagnosis under headings of a level; ``key`` begins the names of its pictures."""
    verdict = found.verdict
    page.heading("What these recordings leave open", level)
    page.parts.append("<ul>" + "".join(f"<li>{html.escape(t)}</li>" for t in cannot_tell(verdict)) + "</ul>")
    if verdict["where"]:
        page.heading("Residual by equation and operating region", level)
        add_regions(page, verdict["where"], found.machine.words)
    page.heading("Measured and predicted, equation by equation", level)
    page.paragraph(
        "Before is the base model fitted by itself, after the leading set of effects. From top to bottom: the residual "
        "averaged over all recordings, measured and predicted signals, single residuals. Residuals are in standard "
        "deviations (sd) of the noise, which puts nineteen in twenty into the shaded band."
    )
    page.panels(panels(found), key)
    rows = [
        [" + ".join(e["effects"]).replace("_", " "), f"{e['probability']:.4f}", _fitted(e.get("parameters", {}))]
        for e in verdict["which"][:MOST]
        if e["probability"] > 0.0005 and e["effects"]
    ]
    if rows:
        page.heading("Posterior probability of each set of effects", level)
        page.table(["set of effects", "posterior probability", "parameters with 90 % intervals"], rows)
    if verdict["shrinks"]["signal"]:
        page.heading("How far the gap closes on the validation recordings", level)
        page.figure(
            f"{key}how_far",
            figures.draw_ladder(verdict["shrinks"]),
            "Residual on the validation recordings, everything frozen. Placebo: random signatures of equal freedom.",
            figures.ladder_in_words(verdict["shrinks"]),
        )
    add_numbers(page, numbers(found), level)
    rows = [
        [e["command"], _words(e["separates"], " from ").replace("+", " + "), f"{e['expected_odds']:.3g}"]
        for e in verdict["next_experiment"]
    ]
    if rows:
        page.heading("What to record next", level)
        page.table(["recording", "distinguishes", "expected Bayes factor"], rows)


def _words(names, between: str = " or ") -> str:
    return between.join(names).replace("_", " ")


def _fitted(parameters: Mapping[str, Any]) -> str:
    parts = []
    for name, p in parameters.items():
        units = "" if p.get("units", "1") == "1" else f" {p['units']}"
        parts.append(f"{name} = {p['value']:z.4g}{units} ({p['low']:z.4g} to {p['high']:z.4g})")
    return ", ".join(parts)

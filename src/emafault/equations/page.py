"""The page of a diagnosis of the reference actuator."""

import html
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..faults import FAULT_NAMES
from ..reporting import diagnosis as figures
from ..reporting.numbers import Numbers, add_numbers
from ..reporting.page import Page
from ..reporting.panels import Panel
from ..reporting.regions import add_regions
from ..reporting.retrained import MARK
from .probabilities import basis
from .quality import in_cells
from .sentences import decides, finding, fitted, separated
from .telling import setting

SHOWN = 4  # fault vectors in the picture
OPEN = 0.05  # probability from which an effect that is not named is worth a line
MOST = 8  # sets in the table
TOLD_OF = 0.01  # probability from which a set behind the first has its parameters told


@dataclass(frozen=True)
class Detail:
    """What the page shows beside the verdict: charts of the equations and every fitted number."""

    panels: Sequence[Panel]
    numbers: Numbers


def draw(
    verdict: Mapping[str, Any],
    truths: Mapping[str, Any],
    detail: Detail | None = None,
    following: Callable[[], Sequence[Mapping[str, Any]]] | None = None,
) -> Page:
    """The page of one diagnosis; ``following`` gives what to record next, asked once all else is drawn."""
    page = Page(f"Where the simulator and bench {verdict['bench']} disagree")
    for sentence in finding(verdict):
        page.paragraph(sentence, "lead")
    page.heading("What these recordings leave open")
    page.parts.append("<ul>" + "".join(f"<li>{html.escape(t)}</li>" for t in _cannot_tell(verdict)) + "</ul>")
    _add_described(page, [d for d in verdict["discovered"] if d["form"] != "remainder"])
    _add_quality(page, verdict["quality"])
    page.heading("Where: residual by equation and operating region")
    add_regions(page, verdict["where"])
    if detail is not None:
        _add_charts(page, detail.panels)
    _add_sets(page, verdict)
    _add_ladder(page, verdict["shrinks"])
    _add_controller(page, verdict["controller"])
    if detail is not None:
        add_numbers(page, detail.numbers)
    _add_fault_vectors(page, fault_vectors(verdict, truths))
    page.parts.append(MARK)
    _add_next(page, verdict["next_experiment"] if following is None else following())
    page.heading("Sealed before the validation recordings were opened")
    page.preformatted(json.dumps(verdict["sealed"], indent=1))
    return page


def _add_described(page: Page, described: Sequence[Mapping[str, Any]]) -> None:
    if not described:
        return
    page.heading("What no catalogue lists")
    rows = [
        [
            d["form"].replace("_", " "), d["equation"].replace("_", " "), d["along"].replace("_", " "),
            fitted(d), f"{d['probability']:.3f}", "" if d["closed"] is None else f"{d['closed']:.1%}",
        ]
        for d in described
    ]  # fmt: skip
    columns = ["form", "equation", "along", "parameters with 90 % intervals", "probability", "closes alone"]
    page.table(columns, rows)
    curves = [
        d["curve"] | {"title": f"{d['equation']}: {d['form']}".replace("_", " ")} for d in described if "curve" in d
    ]
    if curves:
        page.figure(
            "described", figures.draw_described(curves),
            "What the equation leaves along the form, without it in the model and with it, with 90 % bands.",
            figures.described_in_words(curves),
        )  # fmt: skip


def _add_quality(page: Page, quality: Mapping[str, Any]) -> None:
    page.heading("How good the recordings are")
    cells = in_cells(quality)
    page.figure(
        "quality", figures.draw_quality(*cells),
        "Noise of each channel (of the voltages, with the inverter's ripple). Colours compare it with the median of "
        "the recordings: white is the same, orange more (deepest from four times), purple less (deepest from a "
        "quarter). Bold and framed is what share of the samples is no measurement: clipped, held, spikes, or in steps.",
        figures.quality_in_words(*cells),
    )  # fmt: skip


def _add_charts(page: Page, panels: Sequence[Panel]) -> None:
    page.heading("Measured and predicted, equation by equation")
    page.paragraph(
        "Before is the nominal model with this unit's tolerances fitted, after the leading set of effects. From "
        "top to bottom: the residual averaged over all recordings, which shows what noise hides in single samples; "
        "measured and predicted signals; single residuals. Residuals are in standard deviations (sd) of the noise, "
        "which puts nineteen in twenty into the shaded band. Drag to zoom in, double-click to see everything."
    )
    page.panels(panels)


def _add_sets(page: Page, verdict: Mapping[str, Any]) -> None:
    page.heading("Which: posterior probability of each set of effects")
    about = (
        "Posterior probabilities are exclusive and sum to one. The gain is that of all recordings fitted together: "
        "what the validation recordings, or another size in each recording, speak against has lost its probability all "
        "the same."
    )
    if "calibration" in verdict:
        about += f" {basis(verdict['calibration'])}"
    entries = ranked(verdict)
    page.figure(
        "which", figures.draw_ranking(entries), about,
        "; ".join(f"{e['label']}: {100 * e['probability']:.1f} %" for e in entries),
    )  # fmt: skip
    rows = [
        [" + ".join(e["effects"]).replace("_", " ") or "no effect", f"{e['probability']:.4f}", fitted(e)]
        for m, e in enumerate(verdict["which"][:MOST])
        if e.get("parameters") and (m == 0 or e["probability"] >= TOLD_OF)
    ]
    if rows:
        page.table(["set of effects", "posterior probability", "parameters with 90 % intervals"], rows, (0,))


def _add_ladder(page: Page, shrinks: Mapping[str, Any]) -> None:
    if not any(shrinks.values()):
        return
    page.heading("How far the gap closes on the validation recordings")
    page.figure(
        "how_far",
        figures.draw_ladder(shrinks),
        "On recordings that took no part. Nominal: no tolerance fitted. Recalibrated: tolerances fitted. "
        "Placebo: random signatures with as many parameters, fitted. After: with what was found. Floor: the noise.",
        figures.ladder_in_words(shrinks),
    )


def _add_controller(page: Page, settings: Mapping[str, Mapping[str, Any]]) -> None:
    page.heading("Controller")
    rows = [
        [
            setting(n), f"{g['nominal']:.4g}", f"{g['value']:.4g}", f"{g['low']:.4g} to {g['high']:.4g}",
            g["units"],
        ]
        for n, g in settings.items()
    ]  # fmt: skip
    page.table(["setting", "nominal", "fitted", "90 % interval", "unit"], rows)


def _add_fault_vectors(page: Page, groups: Sequence[Mapping[str, Any]]) -> None:
    if not groups:
        return
    page.heading("Fault vector before and after")
    page.figure(
        "faults",
        figures.draw_faults(groups),
        "Estimated jointly with the unit and what was found; 90 % intervals. The line is the truth, where known.",
        figures.faults_in_words(groups),
    )


def _add_next(page: Page, experiments: Sequence[Mapping[str, Any]]) -> None:
    page.heading("What to record next")
    rows = [
        [
            *([e["command"], f"{e['ambient_temperature']:g} °C"] if decides(e) else ["none of the menu", ""]),
            separated(e["separates"]), f"{e['expected_odds']:.3g}",
        ]
        for e in experiments
    ]  # fmt: skip
    page.table(["command", "ambient temperature", "distinguishes", "expected Bayes factor"], rows)


def ranked(verdict: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Entries of the picture of probabilities."""
    named = verdict["verdict"] in ("explained", "group", "partly")
    out = []
    for m, entry in enumerate(verdict["which"][:MOST]):
        unknown = entry["effects"] == ["unknown"]
        kind = "unknown" if unknown else "rival" if entry["effects"] else "empty"
        if kind == "rival" and named and (m == 0 or entry.get("group")):
            kind = "named"
        label = " + ".join(e.replace("_", " ") for e in entry["effects"])
        if unknown:
            label = f"none of the library ({entry['equation'].replace('_', ' ')})"
        out.append(
            {
                "label": label or "no gap", "probability": entry["probability"], "kind": kind,
                "gain": entry.get("log_evidence_gain"),
                "group": entry.get("group"),
            }
        )  # fmt: skip
    return out


def _cannot_tell(verdict: Mapping[str, Any]) -> list[str]:
    """What is left open: groups, listed effects neither named nor ruled out, and what the recordings cannot tell."""
    out = [f"{' or '.join(g).replace('_', ' ')}: one of them acts" for g in verdict["groups"]]
    grouped = {e for g in verdict["groups"] for e in g}
    named = set(verdict["which"][0]["effects"])
    for effect, p in sorted(verdict["inclusion"].items(), key=lambda x: -x[1]):
        if OPEN < p < 0.9 and effect not in grouped | named:
            out.append(f"{effect.replace('_', ' ')} has a posterior probability of {p:.2g}")
    out = out or ["No listed effect is left between named and ruled out."]
    return [*out, *(_capital(w["message"], w["file"]) for w in verdict["warnings"])]


def _capital(message: str, file: str | None) -> str:
    """A message as a sentence, which begins with a file's name as that is."""
    return f"{message}." if file else f"{message[0].upper()}{message[1:]}."


def fault_vectors(verdict: Mapping[str, Any], truths: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Rows of the picture of the fault vector, recordings of one fault together."""
    groups: dict[tuple, dict[str, Any]] = {}
    for name, entry in verdict["fault_vector"].items():
        key = tuple(round(entry["after"][c]["value"], 9) for c in FAULT_NAMES[:5])
        truth = truths.get(name)
        known = {c: float(truth[m]) for m, c in enumerate(FAULT_NAMES)} if truth is not None else {}
        group = groups.setdefault(key, {**entry, "label": name, "truth": known, "more": -1})
        group["more"] += 1
    for group in groups.values():
        if group["more"]:
            group["label"] += f"\nand {group['more']} more"
    return list(groups.values())[:SHOWN]

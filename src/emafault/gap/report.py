"""The page of one diagnosis: what was found, how sure that is, what these recordings cannot tell, and the pictures."""

import html
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..faults import FAULT_NAMES
from ..figures import gap as figures
from ..figures.page import Page
from .diagnose import Diagnosis
from .inference import Problem
from .misfit import Family
from .retrained import MARKS
from .words import cannot_tell, consequence, effect_words, finding, interval, moved_words, number

NAMED = ("explained", "group", "partly")
MANY = 12  # regions of one coordinate in the map
TABLED = 14  # parameters in the table
WEAK_ODDS = 3.0  # below this a recording does not tell two readings apart
HARDLY = 1.0  # of the prior's width: smallest visible size from which an effect would hardly have shown


def write_report(
    diagnosis: Diagnosis,
    path: str | Path,
    truths: Mapping[str, np.ndarray] | None = None,
    region: Any = None,
    retrained: str = "",
    labels: Mapping[str, str] | None = None,
) -> None:
    """Draw and write the page.

    Parameters
    ----------
    truths : recording -> true fault vector, where known
    region : what ``figures.gap.draw_region`` shows; None draws the statistics of the worst equation instead
    retrained : section on the retrained network, once made
    labels : recording -> how figures call it

    Raises
    ------
    InputError : the page cannot be written
    """
    verdict = diagnosis.verdict
    page = Page(f"Where the simulator and bench {verdict['bench']} disagree")
    page.paragraph(" ".join(t for t in (finding(verdict), consequence(verdict)) if t), "lead")
    page.heading("What these recordings cannot tell")
    sizes = visible_from(diagnosis)
    named = {e for entry in verdict["which"][:1] for e in entry["effects"]}
    limits = cannot_tell(verdict, {e: s for e, s in sizes.items() if s > HARDLY and e not in named})
    limits = limits or ["Nothing stands out: every effect of the library would have shown at a common size."]
    page.parts.append(
        "<ul>" + "".join(f"<li>{html.escape(text[0].upper() + text[1:])}</li>" for text in limits) + "</ul>"
    )
    _where(page, diagnosis, labels or {})
    _which(page, diagnosis)
    if region is not None:
        page.heading("Measured against simulated, where they differ most")
        page.figure("region", figures.draw_region(region), _region_caption(region))
    else:
        _statistics(page, diagnosis)
    _how_far(page, diagnosis)
    if verdict["fault_vector"]:
        _faults(page, verdict, truths or {}, labels or {})
    page.parts.append(f"{MARKS[0]}{retrained}{MARKS[1]}")
    _next(page, verdict)
    if sizes:
        page.heading("What would have shown")
        page.figure(
            "visible", figures.draw_visibility(sizes), "Left of the line, an effect of usual size would have shown."
        )
    _record(page, diagnosis)
    page.write(path)


def visible_from(diagnosis: Diagnosis) -> dict[str, float]:
    """Structural effect -> smallest size that would have shown, over its prior's width."""
    problem = diagnosis.explore
    by_id = {h.effect: h for h in diagnosis.twin.hypotheses}
    out = {}
    for effect, entry in diagnosis.verdict["detectable_from"].items():
        if effect in by_id and by_id[effect].kind != "calibration":
            out[effect] = float(entry["size"] / problem.parameters[problem.effect_parameters(by_id[effect])[0]].sd)
    return out


def _after(diagnosis: Diagnosis) -> np.ndarray | None:
    """Prediction on the explore recordings with the named set."""
    named = diagnosis.decision.verdict in NAMED
    return diagnosis.found.candidates[0].point.prediction if named else None


def _z(problem: Problem, prediction: np.ndarray) -> np.ndarray:
    return (problem.observed - prediction) / problem.deviations()


def _coordinates(diagnosis: Diagnosis) -> Mapping[str, str]:
    """Coordinates in words, as the twin calls them."""
    return figures.COORDINATES | dict(getattr(diagnosis.twin, "coordinates", {}))


def _where(page: Page, diagnosis: Diagnosis, labels: Mapping[str, str]) -> None:
    problem, after = diagnosis.explore, _after(diagnosis)
    rows = list(dict.fromkeys(c.equation for c in problem.cells))
    columns, place = regions(problem)
    before_z = _z(problem, diagnosis.found.null.prediction)
    maps: list[Any] = [_excess(problem, rows, place, len(columns), before_z)]
    maps.append(_excess(problem, rows, place, len(columns), _z(problem, after)) if after is not None else None)
    page.heading("Where")
    worst = diagnosis.verdict["where"][:1]
    lead = (
        f"The largest share, {100 * worst[0]['share']:.0f} %, is in {worst[0]['equation'].replace('_', ' ')} "
        f"({worst[0]['statistic']})."
        if worst
        else "Nothing stands out of the noise."
    )
    moved = diagnosis.verdict["beyond_specification"]
    if moved:
        lead += f" Without an effect the fit moves {', '.join(map(moved_words, moved))}."
    page.paragraph(
        lead + " Pale fields agree within the noise; grey ones hold no statistic.",
    )
    drawn = figures.draw_map(rows, columns, maps[0], maps[1], _coordinates(diagnosis))
    page.figure("where", drawn, "Equation by region, explored recordings.")
    names = [*problem.part]
    ladder = diagnosis.ladder
    held = list(ladder.problem.part) if ladder is not None else []
    tables: list[Any] = [_by_recording(problem, rows, names, before_z)]
    tables.append(_by_recording(problem, rows, names, _z(problem, after)) if after is not None else None)
    if ladder is not None:
        for m, rung in enumerate((ladder.recalibrated, ladder.after)):
            if tables[m] is not None:
                prediction = ladder.problem.predict(rung.values)[0]
                extra = _by_recording(ladder.problem, rows, held, _z(ladder.problem, prediction))
                tables[m] = np.concatenate([tables[m], extra], axis=1)
    shown = [labels.get(n, n) for n in (*names, *held)]
    if len(shown) > 1:
        page.figure(
            "recordings",
            figures.draw_recordings(rows, shown, len(held), tables[0], tables[1]),
            "Equation by recording; those to the right of the line took no part in fitting or choosing.",
        )


def regions(problem: Problem) -> tuple[list[tuple[str, str]], np.ndarray]:
    """Columns (coordinate, region) of the map and the column of every statistic."""
    columns: list[tuple[str, str]] = []
    place = np.zeros(len(problem.cells), int)
    order = ("rotor_angle", "rotor_speed", "current", "direction", "order", "temperature", "time")
    alongs = sorted({c.along for c in problem.cells}, key=lambda a: order.index(a) if a in order else 99)
    for along in alongs:
        own = [m for m, c in enumerate(problem.cells) if c.along == along]
        plain = [m for m in own if problem.cells[m].low == problem.cells[m].high == 0.0]
        ranged = [m for m in own if m not in set(plain)]
        if plain:
            place[plain] = len(columns)
            columns.append((along, "overall"))
        spans = sorted({(float(problem.cells[m].low), float(problem.cells[m].high)) for m in ranged})
        pieces = np.array_split(np.arange(len(spans)), min(MANY, len(spans))) if spans else []
        for piece in pieces:
            inside = {spans[k] for k in piece}
            members = [m for m in ranged if (problem.cells[m].low, problem.cells[m].high) in inside]
            place[members] = len(columns)
            columns.append((along, _span(along, spans[piece[0]][0], spans[piece[-1]][1])))
    return columns, place


def _span(along: str, low: float, high: float) -> str:
    if along == "rotor_angle" and high <= 7.0:
        return f"{np.rad2deg(low):.0f}-{np.rad2deg(high):.0f}°"
    if along == "direction":
        return "forward" if low >= 0 else "backward"
    if abs(high) > 1e6:
        return f"> {low:.3g}"
    if abs(low) > 1e6:
        return f"< {high:.3g}"
    return f"{low:.3g}" if low == high else f"{low:.3g} to {high:.3g}"


def _excess(problem: Problem, rows: Sequence[str], place: np.ndarray, width: int, z: np.ndarray) -> np.ndarray:
    """(row, column) of (chi2 - n)/sqrt(2 n); NaN where there is nothing."""
    out = np.full((len(rows), width), np.nan)
    row = np.array([rows.index(c.equation) for c in problem.cells])
    for r in range(len(rows)):
        for column in range(width):
            own = z[(row == r) & (place == column)]
            if len(own):
                out[r, column] = (np.sum(own**2) - len(own)) / np.sqrt(2.0 * len(own))
    return out


def _by_recording(problem: Problem, rows: Sequence[str], names: Sequence[str], z: np.ndarray) -> np.ndarray:
    """(row, recording) root mean square of z."""
    out = np.full((len(rows), len(names)), np.nan)
    for m, name in enumerate(names):
        for r, equation in enumerate(rows):
            own = [z[k] for k in problem.rows.get(name, ()) if problem.cells[k].equation == equation]
            if own:
                out[r, m] = float(np.sqrt(np.mean(np.square(own))))
    return out


def _counted(diagnosis: Diagnosis) -> str:
    """What the gains over no effect do not show where the named one is a unit far outside its specification."""
    found = diagnosis.found
    if diagnosis.verdict["verdict"] not in NAMED or found.candidates[0].gain >= max(c.gain for c in found.candidates):
        return ""
    pulled = found.null.log_evidence - found.within.log_evidence
    names = effect_words([h.effect for h in diagnosis.twin.hypotheses if h.effect in found.candidates[0].effects])
    return (
        f" All of them have {names} as far outside the specification, named or not, which alone gains "
        f"{number(pulled)}; the others compete for what that leaves."
    )


def _which(page: Page, diagnosis: Diagnosis) -> None:
    verdict = diagnosis.verdict
    named = verdict["verdict"] in NAMED
    entries = []
    for m, entry in enumerate(verdict["which"]):
        unknown = entry["effects"] == ["unknown"]
        kind = "unknown" if unknown else "empty" if not entry["effects"] and "parameters" not in entry else "rival"
        if kind == "rival" and named and (m == 0 or entry.get("group")):
            kind = "named"
        label = " + ".join(e.replace("_", " ") for e in entry["effects"])
        if unknown:
            label = f"none of the library ({entry['equation'].replace('_', ' ')})"
        entries.append(
            {
                "label": label or "no gap",
                "probability": entry["probability"],
                "gain": entry.get("log_evidence_gain"),
                "group": entry.get("group"),
                "kind": kind,
            }
        )
    page.heading("Which effect")
    page.figure(
        "which",
        figures.draw_ranking(entries),
        "Every reading that was fitted with the simulator; probabilities are exclusive and sum to one."
        + _counted(diagnosis),
    )
    rows = []
    for entry in verdict["which"]:
        if entry.get("parameters") and (entry["probability"] > 1e-3 or entry is verdict["which"][0]):
            for name, p in entry["parameters"].items():
                units = "" if p["units"] == "1" else p["units"]
                value, low, high = interval(p)
                rows.append([effect_words([p["effect"]]), name, value, f"{low} to {high}", units])
    if rows:
        page.table(["effect", "parameter", "value", "90 % interval", "unit"], rows[:TABLED])
    if len(rows) > TABLED:
        page.paragraph(f"{len(rows) - TABLED} more parameters stand in the verdict file.", "small")
    rivals = verdict.get("held_out", {}).get("rivals") or []
    if len(rivals) > 1:
        page.paragraph("The same readings on the recordings that took no part, best first:")
        page.table(
            ["effects", "misfit over noise, held out", "gain in log evidence, explored"],
            [[effect_words(r["effects"]), number(r["rms"]), number(r["log_evidence_gain"])] for r in rivals[:6]],
        )


def _how_far(page: Page, diagnosis: Diagnosis) -> None:
    page.heading("How far the gap shrinks")
    shrinks = diagnosis.verdict["shrinks"]
    if not any(shrinks.values()):
        page.paragraph("No recording could be held out, so this cannot be said.")
        return
    page.figure(
        "how_far",
        figures.draw_ladder(shrinks),
        "On recordings that took no part. Nominal: no tolerance fitted. Recalibrated: the unit's tolerances fitted. "
        "Placebo: a random effect with as many parameters. After: with the named effects. Floor: the noise.",
    )


def _faults(
    page: Page, verdict: Mapping[str, Any], truths: Mapping[str, np.ndarray], labels: Mapping[str, str]
) -> None:
    page.heading("Fault vector before and after")
    groups: dict[tuple, dict[str, Any]] = {}
    for name, entry in verdict["fault_vector"].items():
        after = entry["after"]
        key = tuple(round(after[c]["value"], 9) for c in FAULT_NAMES[:5] if c in after)
        truth = {c: float(truths[name][m]) for m, c in enumerate(FAULT_NAMES)} if name in truths else {}
        group = groups.setdefault(key, {**entry, "names": [], "truth": truth})
        group["names"].append(name)
    ordered = sorted(
        groups.values(), key=lambda g: -max(abs(g["after"][c]["value"]) for c in FAULT_NAMES[:5] if c in g["after"])
    )
    for group in ordered:
        first, more = labels.get(group["names"][0], group["names"][0]), len(group["names"]) - 1
        group["label"] = first + (f"\nand {more} more" if more else "")
    page.figure(
        "faults",
        figures.draw_faults(ordered[:4]),
        "Estimated jointly with the unit and the effects; 90 % intervals. Recordings of one fault share a row (dT is "
        "that of the first)." + (" The line is the truth." if truths else ""),
    )


def _statistics(page: Page, diagnosis: Diagnosis) -> None:
    families: Sequence[Family] = diagnosis.found.regions
    if not families:
        return
    problem, worst, after = diagnosis.explore, families[0], _after(diagnosis)
    own = np.array([c.equation == worst.equation and c.along == worst.along for c in problem.cells])
    deviations = problem.deviations()[own]
    centres = np.array([0.5 * (c.low + c.high) for c in problem.cells])[own]
    page.heading("Measured against predicted, where they differ most")
    page.figure(
        "statistics",
        figures.draw_statistics(
            worst.equation.replace("_", " "),
            _coordinates(diagnosis).get(worst.along, worst.along.replace("_", " ")),
            centres,
            problem.observed[own] / deviations,
            diagnosis.found.null.prediction[own] / deviations,
            after[own] / deviations if after is not None else None,
        ),
        "Every statistic of the equation with the largest misfit; the band is two standard deviations.",
    )


def _region_caption(region: Any) -> str:
    return (
        f"Recording {region.recording}, equation {region.equation.replace('_', ' ')}, statistic '{region.statistic}'. "
        "Left: the residual with nominal parameters. Right: signals where the misfit is largest; switching "
        "loops drift apart sample by sample even with identical physics, so compare shapes, not traces."
    )


def _next(page: Page, verdict: Mapping[str, Any]) -> None:
    page.heading("What to record next")
    entries = verdict["next_experiment"]
    if not entries:
        page.paragraph("No further recording is proposed for this machine.")
        return
    rows = []
    for e in entries:
        ambient, separates = e.get("ambient_temperature"), e.get("separates") or []
        odds = e.get("expected_odds")
        rows.append(
            [
                e["command"],
                "" if ambient is None else f"{ambient:g} °C",
                " from ".join(s.replace("_", " ").replace("+", " + ") for s in separates),
                "" if odds is None else ("over 10⁶" if odds >= 999_999 else f"{odds:.3g}"),
            ]
        )
    if all((e.get("expected_odds") or 1.0) < WEAK_ODDS for e in entries):
        page.paragraph("None of the recordings that could be made would tell these readings apart; the best are:")
    page.table(["command", "soak", "would tell", "expected odds"], rows)


def _record(page: Page, diagnosis: Diagnosis) -> None:
    verdict = diagnosis.verdict
    page.heading("For the record")
    parts = verdict["recordings"]
    page.paragraph(
        f"Explored: {', '.join(parts['explore'])}. Held out: {', '.join(parts['confirm']) or 'none'}.", "small"
    )
    for note in verdict.get("notes", ()):
        page.paragraph(str(note), "small")
    page.paragraph(
        f"The verdict was fixed before the held-out recordings were opened; its digest is {verdict['digest']}.", "small"
    )

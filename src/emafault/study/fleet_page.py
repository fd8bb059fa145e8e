"""The page of a fleet: effects over all units, units ranked, what changed, what was refused."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

from ..effects import EFFECTS
from ..reporting.page import Page
from .fleet import COMPONENTS, NAMED
from .history import changes, histories, ranked, since

MOST = 200  # units listed; the table has all


def write_page(rows: Sequence[Mapping[str, Any]], name: str, path: str | Path) -> None:
    """Write the page.

    Raises
    ------
    InputError : the file cannot be written
    """
    units = histories(rows)
    refused = [row for row in rows if row["verdict"] == "refused"]
    page = Page(f"Fleet {name}")
    some = sum(bool(history[-1]["named"]) for history in units.values())
    page.paragraph(
        f"{len(rows)} benches of {len(units)} units: on the last bench of {some} units an effect is named, with an "
        f"inclusion probability of {NAMED:g} or more; {len(refused)} benches could not be diagnosed.",
        "lead",
    )
    _effects(page, units)
    _units(page, units)
    _changes(page, units)
    if refused:
        page.heading("Refused")
        page.table(("bench", "why"), [(row["bench"], row["reason"]) for row in refused[:MOST]])
    page.write(path)


def _effects(page: Page, units: Mapping[str, Sequence[Mapping[str, Any]]]) -> None:
    page.heading("Effects over the fleet")
    lines = []
    for effect in EFFECTS:
        having = [unit for unit, history in units.items() if history[-1][f"p_{effect}"] >= NAMED]
        expected = sum(history[-1][f"p_{effect}"] for history in units.values())
        if having or expected >= 0.5:
            shown = ", ".join(having[:8]) + (f" and {len(having) - 8} more" if len(having) > 8 else "")
            lines.append((len(having), expected, (effect, str(len(having)), f"{expected:.1f}", shown)))
    lines.sort(key=lambda line: (-line[0], -line[1]))
    page.table(("effect", "units it is named on", "expected number", "which"), [cells for _, _, cells in lines])


def _units(page: Page, units: Mapping[str, Sequence[Mapping[str, Any]]]) -> None:
    page.heading("Units, the most conspicuous first")
    page.paragraph(
        "Gap: the largest disagreement of an equation with the nominal simulator, in standard deviations.", "small"
    )
    lines = []
    for unit in ranked(units)[:MOST]:
        last = units[unit][-1]
        named = [f"{effect} (since {_when(since(units[unit], effect))})" for effect in last["named"]]
        worst = max((n for n in COMPONENTS if last[n] is not None), key=lambda n: abs(last[n]), default=None)
        fault = f"{worst} {last[worst]:.4f} ± {last[f'{worst}_sd']:.4f}" if worst else ""
        gap = "" if last["gap"] is None else f"{last['gap']:.1f}"
        lines.append((unit, str(len(units[unit])), last["verdict"], ", ".join(named + last["described"]), gap, fault))
    page.table(("unit", "benches", "verdict of the last", "named or described", "gap", "largest fault"), lines)


def _changes(page: Page, units: Mapping[str, Sequence[Mapping[str, Any]]]) -> None:
    page.heading("What changed")
    lines = []
    for unit, history in units.items():
        for before, after in pairwise(history):
            told = "; ".join(change.sentence() for change in changes(before, after))
            lines.append((unit, f"{_when(before)} to {_when(after)}", told or "nothing reported"))
    if not lines:
        page.paragraph("No unit has a second bench.")
        return
    page.paragraph("With the probability of each change; posteriors are taken for independent.", "small")
    page.table(("unit", "from, to", "what changed"), lines[-MOST:])


def _when(row: Mapping[str, Any] | None) -> str:
    return "" if row is None else row["recorded"] or row["bench"]

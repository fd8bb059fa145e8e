"""The section of the report that shows what retraining with what a diagnosis found has brought."""

import html
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..io.atomic import write_text

FILE = "retrained.json"
#: what the section stands between in the page
MARKS = ("<!-- retrained -->", "<!-- /retrained -->")


def section(folder: Path, verdict: Mapping[str, Any]) -> str:
    """HTML of the section; empty where nothing was retrained for this very verdict."""
    try:
        found = json.loads((folder / FILE).read_text())
    except (OSError, ValueError):
        return ""
    return section_of(found) if found.get("digest") == verdict["digest"] else ""


def section_of(found: Mapping[str, Any]) -> str:
    """HTML of the section: errors of the two networks, component by component."""
    before, after = found["before"], found["after"]
    against = (
        "the true fault vectors" if found["reference"] == "truth" else "the diagnosis' joint fit (no truth is known)"
    )
    times = before["rms"] / max(after["rms"], 1e-12)
    text = (
        "Two networks were trained for this bench, on simulations of its unit without and with what was found. On "
        f"{len(found['recordings'])} recordings, against {against}, the error is {before['rms']:.3g} % of range "
        f"without and {after['rms']:.3g} % with them: {times:.2g} times smaller."
    )
    names = list(before["components"])
    head = "".join(f"<th>{html.escape(n)}</th>" for n in ["rms error, % of range", "all", *names])
    rows = ""
    for label, entry in (("without what was found", before), ("with it", after)):
        cells = [f"{entry['rms']:.3g}", *(f"{entry['components'][n]:.3g}" for n in names)]
        rows += f"<tr><td>{label}</td>" + "".join(f"<td>{c}</td>" for c in cells) + "</tr>"
    table = f'<div class="scroll"><table><tr>{head}</tr>{rows}</table></div>'
    return f"<h2>What retraining brought</h2><p>{html.escape(text)}</p>{table}"


def show_in_report(path: Path, found: Mapping[str, Any]) -> None:
    """Put the section into a report that stands already.

    Raises
    ------
    InputError : the report cannot be written
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError:
        return
    start, end = text.find(MARKS[0]), text.find(MARKS[1])
    if start >= 0 and end >= 0:
        whole = text[: start + len(MARKS[0])] + section_of(found) + text[end:]
        write_text(path, whole)

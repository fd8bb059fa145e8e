"""The section of the report that shows what retraining with what a diagnosis found has brought."""

import html
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..io.atomic import write_text

#: where the section belongs in a report
MARK = "<!-- retrained -->"


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


def write_with_section(report: str | Path, found: Mapping[str, Any], page: str | Path) -> None:
    """Write a report once more, with the section.

    Raises
    ------
    InputError : no report of a diagnosis, or a page that cannot be written
    """
    try:
        text = Path(report).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{report}: not a report ({error})") from error
    if MARK not in text:
        raise InputError(f"{report}: not the report of a diagnosis of the actuator")
    write_text(page, text.replace(MARK, section_of(found), 1))

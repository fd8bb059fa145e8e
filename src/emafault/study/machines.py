"""Measured machines by their equations: verdict files, the withheld check, and the page that shows them."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import yaml

from ..figures.page import Page
from ..machines.diagnose import Diagnosed, diagnose
from ..machines.library import build, read_cases, stated
from ..machines.page import body, finding
from ..machines.run import checked
from ..machines.withheld import Withheld, check_file, names_of
from ..recording import replace_atomically
from ..written import file_name

KINDS = {
    "put in": "Changes put in by hand, whose cause is known",
    "left out": "The strongest effect left out of the library: what counts as true is what the diagnosis itself named",
}
HEADER = (
    "case", "sealed", "verdict", "named", "held-out residual: before → after (placebo)", "closed", "held-out says",
    "against simulation",
)  # fmt: skip


def diagnose_machines(
    listed: Path, older: tuple[Path, Path], report: Path, figures: Path, verdicts: Path, withheld: Path
) -> None:
    """Diagnose every set of ``data/measured/sets.yaml`` into one page, with the withheld check beside it.

    Parameters
    ----------
    older : verdicts and rows of the withheld check of the diagnosis against simulation, shown beside

    Raises
    ------
    InputError : a file that is not what its machine needs
    """
    folder = Path(listed).parent
    found: dict[str, dict[str, Diagnosed]] = {}
    rows: list[Withheld] = []
    for entry in yaml.safe_load(Path(listed).read_text()):
        machine = stated(entry["twin"])
        for file in entry["files"]:
            cases = read_cases(machine, folder / entry["folder"] / file)
            found[f"{entry['folder']}/{file}"] = {c: diagnose(build(machine, c, a)) for c, a in cases.items()}
        rows += check_file(machine, folder / entry["folder"] / entry["files"][0])
    together = {name: {c: json.loads(checked(d.verdict)) for c, d in cases.items()} for name, cases in found.items()}
    before, checks = (json.loads(Path(p).read_text()) for p in older)
    write_json(verdicts, together)
    write_json(withheld, [asdict(row) for row in rows])
    draw_page(found, rows, before, checks, report, figures)


def write_json(path: Path, value: object) -> None:
    """Write JSON, whole or not at all."""
    replace_atomically(Path(path), lambda temporary: temporary.write_text(json.dumps(value, indent=1) + "\n"))


def summary(case: str, verdict: Mapping[str, Any], older: Mapping[str, Any] | None) -> list[str]:
    """One line of the closing table, in the order of ``HEADER``."""
    signal = verdict["shrinks"]["signal"]
    named = [e for e in names_of(verdict) if not any(e in g for g in verdict["groups"])]
    words = " + ".join([*named, *(f"({' or '.join(g)})" for g in verdict["groups"])])
    ladder, share = "-", "-"
    if signal is not None:
        ladder = f"{signal['recalibrated']:.1f} → {signal['after']:.1f} ({signal['placebo']:.1f})"
        share = "-" if signal["closed"] is None else f"{signal['closed']:.2f}"
    beside = "-"
    if older is not None:
        beside = f"{older['verdict']}: {' + '.join(older['which'][0]['effects']) or 'no effect'}"
    return [
        case, verdict["sealed"]["verdict"], verdict["verdict"], words.replace("_", " ") or "-", ladder, share,
        verdict["held_out"]["outcome"], beside.replace("_", " "),
    ]  # fmt: skip


def draw_page(
    found: Mapping[str, Mapping[str, Diagnosed]],
    withheld: Sequence[Withheld],
    older: Mapping[str, Mapping[str, Any]],
    checks: Sequence[Mapping[str, Any]],
    report: Path,
    figures: Path | None,
) -> None:
    """The page: closing table, the withheld check by kind, then each case."""
    page = Page("Measured machines by their equations", figures)
    page.paragraph(
        "Residuals are in standard deviations of what instruments and scatter allow, on recordings that took no part "
        "in fitting or choosing. Before is the base model recalibrated on the explored recordings."
    )
    lines = [
        summary(f"{name.split('/')[0]}: {case}", d.verdict, older.get(name, {}).get(case))
        for name, cases in found.items()
        for case, d in cases.items()
    ]
    page.table(HEADER, lines)
    for kind, title in KINDS.items():
        rows = [r for r in withheld if r.kind == kind]
        if not rows:
            continue
        page.heading(f"{title}: {sum(r.right for r in rows)} of {len(rows)} right")
        page.table(
            (
                "machine", "case", "what", "verdict", "named", "also named", "remainder in", "right",
                "against simulation",
            ),
            [
                [
                    r.twin, r.case, r.what.replace("_", " "), r.verdict, ", ".join(r.named) or "-",
                    ", ".join(r.beside) or "-", ", ".join(r.placed) or "-", "yes" if r.right else "no",
                    _older(r, checks),
                ]
                for r in rows
            ],
        )  # fmt: skip
    for name, cases in found.items():
        for case, diagnosed in cases.items():
            page.heading(f"{name}: {case}")
            for sentence in finding(diagnosed.verdict):
                page.paragraph(sentence)
            for note in diagnosed.verdict["notes"]:
                page.paragraph(note, "small")
            body(page, diagnosed, f"{file_name(f'{name}_{case}')}_")
    page.write(report)


def _older(row: Withheld, checks: Sequence[Mapping[str, Any]]) -> str:
    """What the other diagnosis says of the same change; left out, each leaves out what it named itself."""
    for c in checks:
        same = c["what"] == row.what if row.kind == "put in" else c["what"].startswith("left out")
        if c["twin"] == row.twin and same:
            return f"{'yes' if c['right'] else 'no'}: {c['verdict']}"
    return "-"

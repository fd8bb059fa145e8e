"""Measured machines: verdict files, the withheld check, and the page that shows them."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import yaml

from ..io.atomic import write_text
from ..machines.diagnose import Diagnosed, diagnose
from ..machines.library import build, read_cases, stated
from ..machines.page import body, finding
from ..machines.reconstructed import Reconstructed, reconstruct_measured
from ..machines.withheld import Withheld, check_file, names_of
from ..places import file_name
from ..reporting.page import Page
from ..reporting.written import checked

KINDS = {
    "put in": "Changes put in by hand, whose cause is known",
    "left out": "The strongest effect left out of the library: what counts as true is what the diagnosis itself named",
}
HEADER = (
    "case", "sealed", "verdict", "named", "held-out residual: before → after (placebo)", "closed", "held-out says",
)  # fmt: skip


def diagnose_machines(listed: Path, plates: Path, report: Path, figures: Path, verdicts: Path, withheld: Path) -> None:
    """Diagnose every set of ``data/measured/sets.yaml`` into one page, with the withheld check beside it.

    Parameters
    ----------
    plates : speed constants of nameplates, which reconstructed R and k are compared with

    Raises
    ------
    InputError : a file that is not what its machine needs
    """
    folder = Path(listed).parent
    constants = yaml.safe_load(Path(plates).read_text())
    found: dict[str, dict[str, Diagnosed]] = {}
    features: dict[tuple[str, str], list[Reconstructed]] = {}
    rows: list[Withheld] = []
    for entry in yaml.safe_load(Path(listed).read_text()):
        machine = stated(entry["twin"])
        for file in entry["files"]:
            name, plate = f"{entry['folder']}/{file}", constants.get(entry["folder"], {})
            cases = read_cases(machine, folder / entry["folder"] / file)
            found[name] = {c: diagnose(build(machine, c, a)) for c, a in cases.items()}
            features |= {(name, c): reconstruct_measured(machine.name, a, plate.get(c)) for c, a in cases.items()}
        rows += check_file(machine, folder / entry["folder"] / entry["files"][0])
    together = {name: {c: json.loads(checked(d.verdict)) for c, d in cases.items()} for name, cases in found.items()}
    write_json(verdicts, together)
    write_json(withheld, [asdict(row) for row in rows])
    draw_page(found, rows, features, report, figures)


def write_json(path: Path, value: object) -> None:
    """Write JSON, whole or not at all."""
    write_text(path, json.dumps(value, indent=1) + "\n")


def summary(case: str, verdict: Mapping[str, Any]) -> list[str]:
    """One line of the closing table, in the order of ``HEADER``."""
    signal = verdict["shrinks"]["signal"]
    named = [e for e in names_of(verdict) if not any(e in g for g in verdict["groups"])]
    words = " + ".join([*named, *(f"({' or '.join(g)})" for g in verdict["groups"])])
    ladder, share = "-", "-"
    if signal is not None:
        ladder = f"{signal['recalibrated']:.1f} → {signal['after']:.1f} ({signal['placebo']:.1f})"
        share = "-" if signal["closed"] is None else f"{signal['closed']:.2f}"
    return [
        case, verdict["sealed"]["verdict"], verdict["verdict"], words.replace("_", " ") or "-", ladder, share,
        verdict["held_out"]["outcome"],
    ]  # fmt: skip


def draw_page(
    found: Mapping[str, Mapping[str, Diagnosed]],
    withheld: Sequence[Withheld],
    features: Mapping[tuple[str, str], Sequence[Reconstructed]],
    report: Path,
    figures: Path | None,
) -> None:
    """The page: closing table, the withheld check by kind, then each case with its R and k where these can be had."""
    page = Page("Measured machines", figures)
    page.paragraph(
        "Residuals are in standard deviations of what instruments and scatter allow, on recordings that took no part "
        "in fitting or choosing. Before is the base model recalibrated on the explored recordings."
    )
    lines = [
        summary(f"{name.split('/')[0]}: {case}", d.verdict)
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
            ("machine", "case", "what", "verdict", "named", "also named", "remainder in", "right"),
            [
                [
                    r.twin, r.case, r.what.replace("_", " "), r.verdict, ", ".join(r.named) or "-",
                    ", ".join(r.beside) or "-", ", ".join(r.placed) or "-", "yes" if r.right else "no",
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
            if features.get((name, case)):
                page.table(
                    ("R and k by the paper's recipe", "R (ohm)", "k (V s/rad)", "spread of i/w", "bias of k"),
                    [
                        [
                            f.source, f"{f.R:.4f}", f"{f.k:.6f}", f"{f.spread:.2f}",
                            ", ".join(f"{100 * f.bias(q):+.1f} % against {q}" for q in f.references) or "-",
                        ]
                        for f in features[name, case]
                    ],
                )  # fmt: skip
    page.write(report)

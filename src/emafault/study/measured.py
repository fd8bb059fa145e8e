"""Measured machines: verdict files and the page that shows them."""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

import yaml

from ..gap.diagnose import Diagnosis
from ..recording import replace_atomically
from ..twins.diagnosed import Withheld, check_file, diagnose_cases
from ..twins.library import calibration_of


def diagnose_sets(listed: Path, report: Path, figures: Path, verdicts: Path, withheld: Path) -> None:
    """Diagnose every set of ``data/measured/sets.yaml`` into one page, with the withheld check beside it.

    Raises
    ------
    InputError : a file that is not what its twin needs
    """
    folder = Path(listed).parent
    plates = yaml.safe_load((folder / "nameplate.yaml").read_text())
    found: dict[str, dict[str, Diagnosis]] = {}
    rows: list[Withheld] = []
    for entry in yaml.safe_load(Path(listed).read_text()):
        calibration = calibration_of(entry["twin"])
        for file in entry["files"]:
            path = folder / entry["folder"] / file
            name = f"{entry['folder']}/{file}"
            found[name] = diagnose_cases(entry["twin"], path, calibration, plates.get(entry["folder"]))
        rows += check_file(entry["twin"], folder / entry["folder"] / entry["files"][0], calibration)
    write_json(verdicts, {name: {c: d.verdict for c, d in cases.items()} for name, cases in found.items()})
    write_json(withheld, [asdict(row) for row in rows])
    draw_page("Measured machines", found, rows, report, figures)


def write_json(path: Path, value: object) -> None:
    """Write JSON, whole or not at all."""
    replace_atomically(Path(path), lambda temporary: temporary.write_text(json.dumps(value, indent=1) + "\n"))


def file_name(text: str) -> str:
    """Text as the name of a file."""
    return re.sub(r"[^A-Za-z0-9_.-]+", "_", text)


def summary(case: str, verdict: Mapping) -> list[str]:
    """One line of the closing table, in the order of ``HEADER``."""
    first, held, signal = verdict["which"][0], verdict["held_out"], verdict["shrinks"]["signal"]
    if verdict["verdict"] == "group":
        certainty = sum(e["probability"] for e in verdict["which"] if e["group"])
        sets = [" + ".join(e["effects"]) for e in verdict["which"] if e["group"]]
        named = " or ".join(sets)
    else:
        certainty, named = first["probability"], " + ".join(first["effects"])
    share = signal["closed"]
    return [
        case,
        verdict["verdict"],
        f"{certainty:.2f}",
        named.replace("_", " ") or "-",
        f"{signal['recalibrated']:.1f} → {signal['after']:.1f} ({signal['placebo']:.1f})",
        "-" if share is None else f"{share:.2f}",
        held["outcome"] + (f": {', '.join(held['claimed'])}".replace("_", " ") if held["outcome"] == "rival" else ""),
    ]


HEADER = (
    "case",
    "verdict",
    "certainty",
    "named",
    "held-out residual: before → after (placebo)",
    "closed",
    "held-out says",
)


def draw_page(
    title: str,
    found: Mapping[str, Mapping[str, Diagnosis]],
    withheld: Sequence[Withheld],
    report: Path,
    figures: Path | None,
) -> None:
    """The page: closing table, then each set with its residuals, rivals, R and k, and what the data cannot tell."""
    from ..figures.measured import draw_residuals, draw_rivals
    from ..figures.page import Page

    page = Page(title, figures)
    page.paragraph(
        "Residuals are in standard deviations of what instruments and scatter allow, on recordings that took no "
        "part in fitting or choosing. Before is the base model recalibrated on the same explored part."
    )
    rows = [summary(f"{name.split('/')[0]}: {c}", d.verdict) for name, cases in found.items() for c, d in cases.items()]
    page.table(HEADER, rows)
    for title, left_out in (
        ("Known distortions put in by hand", False),
        ("The strongest effect left out: what counts as true is what the diagnosis itself named", True),
    ):
        rows_of = [r for r in withheld if r.what.startswith("left out") == left_out]
        if rows_of:
            page.heading(f"{title}: {sum(r.right for r in rows_of)} of {len(rows_of)} right")
            page.table(
                ("twin", "case", "what", "verdict", "named", "remainder in", "right"),
                [
                    [r.twin, r.case, r.what, r.verdict, ", ".join(r.named) or "-", r.placed, "yes" if r.right else "no"]
                    for r in rows_of
                ],
            )
    for name, cases in found.items():
        for case, diagnosis in cases.items():
            _section(page, name, case, diagnosis, draw_residuals, draw_rivals)
    page.write(report)


def _section(page, name: str, case: str, diagnosis: Diagnosis, draw_residuals, draw_rivals) -> None:
    verdict = diagnosis.verdict
    page.heading(f"{name}: {case}")
    for note in verdict["notes"]:
        page.paragraph(note, "small")
    key = file_name(f"{name}_{case}")
    caption = "Residuals before (grey) and with the named set (blue); filled: fitted, hollow: held out."
    page.figure(f"{key}_residuals", draw_residuals(diagnosis), caption)
    if verdict["held_out"]["rivals"]:
        page.figure(
            f"{key}_rivals",
            draw_rivals(diagnosis),
            "Every fitted set: evidence where it was fitted, residual where not.",
        )
    named = [e for e in verdict["which"] if e.get("parameters")][:1]
    if named and verdict["verdict"] in ("explained", "group", "partly"):
        page.table(
            ("parameter", "value", "90 % interval", "unit"),
            [
                [k, f"{p['value']:.4g}", f"{p['low']:.4g} to {p['high']:.4g}", p["units"]]
                for k, p in named[0]["parameters"].items()
            ],
        )
    if verdict["reconstructed"]:
        page.table(
            ("R and k by the paper's recipe", "R (ohm)", "k (V s/rad)", "spread of i/w", "bias of k"),
            [
                [
                    r["source"], f"{r['R']:.4f}", f"{r['k']:.6f}", f"{r['spread']:.2f}",
                    ", ".join(f"{100 * b:+.1f} % against {q}" for q, b in r["bias"].items()) or "-",
                ]
                for r in verdict["reconstructed"]
            ],
        )  # fmt: skip
    if verdict["next_experiment"]:
        entry = verdict["next_experiment"][0]
        told = " from ".join(name.replace("_", " ").replace("+", " + ") for name in entry["separates"])
        page.paragraph(f"To record next: {entry['command']}. It would tell {told}.")
    untold = [" or ".join(g) for g in verdict["groups"]]
    untold += [" and ".join(c["effects"]) for c in verdict["confusable"] if c["cosine"] > 0.99][:8]
    if untold:
        page.paragraph("What these data cannot tell apart: " + "; ".join(untold).replace("_", " ") + ".")

"""A bench of the reference actuator diagnosed by equation errors: read, diagnosed, written with a page."""

import html
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..actuator.parameters import ActuatorParameters
from ..actuator.sensors import SensorNoise
from ..figures.page import Page
from ..gap.bench import read_bench, split_bench
from ..recording import replace_atomically
from .diagnose import TELLING, TOLD, diagnose
from .terms import TERMS

VERDICT, REPORT = "diagnosis.json", "report.html"
MOST = 8  # sets in the table


def diagnose_folder(path: str | Path, spec: Mapping[str, Any], out: str | Path, exclude: Sequence[str] = ()) -> dict:
    """Diagnose a folder of recordings and write ``diagnosis.json`` and ``report.html`` to ``out``.

    Parameters
    ----------
    spec : ``actuator`` and ``sensors`` of a composed configuration
    exclude : effects that the library is to lack

    Raises
    ------
    InputError : recordings or effects that cannot be used, or results that cannot be written
    """
    actuator = ActuatorParameters(**spec["actuator"])
    bench = read_bench(path, actuator)
    split = split_bench(bench.recordings)
    verdict = diagnose(bench.name, bench.recordings, split, actuator, SensorNoise(**spec["sensors"]), exclude)
    verdict["warnings"] = bench.warnings
    folder = Path(out)
    text = json.dumps(verdict, indent=1, allow_nan=False, default=float) + "\n"
    replace_atomically(folder / VERDICT, lambda temporary: temporary.write_text(text, encoding="utf-8"))
    print("\n".join(finding(verdict)), flush=True)
    _page(verdict).write(folder / REPORT)
    print(f"written to {folder}", flush=True)
    return verdict


def finding(verdict: Mapping[str, Any]) -> list[str]:
    """What was found, a sentence each: the measuring chain first, then the machine, then the controller."""
    out = [d["sentence"] for d in verdict["discovered"] if d["form"] != "remainder"]
    kind, first = verdict["verdict"], verdict["which"][0]
    if kind in ("explained", "partly") and first["effects"]:
        sentences = [TERMS[e].SENTENCE for e in first["effects"] if e in TERMS]
        text = "; ".join(sentences)
        out.append(f"{text[0].upper()}{text[1:]} ({_fitted(first)}; probability {first['probability']:.3g}).")
    if verdict["groups"]:
        names = "; ".join(" or ".join(g).replace("_", " ") for g in verdict["groups"])
        out.append(f"One of a group that these recordings cannot tell apart: {names}.")
    if kind == "no_gap":
        p = first["probability"]
        out.append(
            f"The nominal model within the unit's tolerances accounts for these recordings (probability {p:.3g})."
        )
    if kind == "unknown":
        out.append(
            f"Recordings and model differ in the {str(first['equation']).replace('_', ' ')} equation; no listed effect "
            f"reaches a probability of 0.9 (probability that none is the cause {first['probability']:.2g})."
        )
    out += [d["sentence"] for d in verdict["discovered"] if d["form"] == "remainder"]
    for name, g in verdict["controller"].items():
        apart = abs(g["value"] - g["nominal"])
        sd = (g["high"] - g["low"]) / 3.29
        if apart > TOLD * sd and apart > TELLING * g["nominal"]:
            words = name.replace("_", " ")
            out.append(f"The controller's {words} is {g['value']:.3g} {g['units']} and not {g['nominal']:.3g}.")
    signal = verdict["shrinks"]["signal"]
    if signal and signal["closed"] is not None:
        out.append(f"On recordings not looked at before this closes {100 * signal['closed']:.0f} % of the gap.")
    return out


def _fitted(entry: Mapping[str, Any]) -> str:
    parts = []
    for name, p in entry["parameters"].items():
        units = "" if p["units"] == "1" else f" {p['units']}"
        parts.append(f"{name} = {p['value']:.4g}{units} ({p['low']:.4g} to {p['high']:.4g})")
    return ", ".join(parts)


def _page(verdict: Mapping[str, Any]) -> Page:
    """The page of one diagnosis."""
    page = Page(f"Where the simulator and bench {verdict['bench']} disagree")
    for sentence in finding(verdict):
        page.paragraph(sentence, "lead")
    page.heading("Residual by equation and operating region")
    rows = [
        [
            w["equation"],
            w["along"].replace("_", " "),
            f"{w['from']:.3g} to {w['to']:.3g}",
            f"{w['z']:.3g}",
            f"{w['share']:.1%}",
        ]
        for w in verdict["where"]
    ]
    page.table(["equation", "along", "where most of it lies", "size over the noise", "share"], rows)
    page.heading("Posterior probability")
    rows = [
        [
            " + ".join(e["effects"]).replace("_", " ") or "no effect",
            f"{e['probability']:.4f}",
            _fitted(e) if e.get("parameters") else "",
        ]
        for e in verdict["which"][:MOST]
    ]
    page.table(["set of effects", "probability", "parameters with 90 % intervals"], rows, (0,))
    page.heading("Controller")
    rows = [
        [
            n.replace("_", " "),
            f"{g['nominal']:.4g}",
            f"{g['value']:.4g}",
            f"{g['low']:.4g} to {g['high']:.4g}",
            g["units"],
        ]
        for n, g in verdict["controller"].items()
    ]
    page.table(["gain", "nominal", "fitted", "90 % interval", "unit"], rows)
    page.heading("Fault vector")
    rows = []
    for name, stages in verdict["fault_vector"].items():
        for component, after in stages["after"].items():
            before = stages["before"][component]
            rows.append(
                [
                    f"{name}: {component}",
                    f"{before['value']:.4g}",
                    f"{after['value']:.4g}",
                    f"{after['low']:.4g} to {after['high']:.4g}",
                ]
            )
    page.table(["component", "nominal model recalibrated", "with what was found", "90 % interval"], rows)
    signal = verdict["shrinks"]["signal"]
    if signal:
        page.heading("On the confirming recordings")
        names = ("nominal", "recalibrated", "placebo", "after", "floor")
        page.table(["model", "root mean square of the whitened residual"], [[n, f"{signal[n]:.4f}"] for n in names])
    page.heading("Sealed before the confirming recordings were opened")
    page.parts.append(f"<pre>{html.escape(json.dumps(verdict['sealed'], indent=1))}</pre>")
    return page

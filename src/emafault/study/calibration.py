"""Whether stated probabilities hold on an actuator: blind cases of its units diagnosed, stated against achieved."""

import json
import shutil
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..actuator.parameters import ActuatorParameters
from ..actuator.sensors import SensorNoise
from ..equations.probabilities import FORMAT
from ..io.atomic import write_text
from ..progress import say
from ..reporting.page import Page
from ..withheld.metrics import METRICS, Rows, calibration_error, reliability
from ..withheld.population import population_of
from ..withheld.scoreboard import reliability_figure
from ..withheld.scoring import score_rows
from .blind import folder_of, run_cases
from .scored import scored

KNOWN = next(m for m in METRICS if m.id == "ece_known").select
DRAWS = 2000  # of what probabilities that hold would show
TOLD = {"ece_known": "calibration error", "wrong_t0": "given a name though effect-free",
        "no_gap_t0": "effect-free and said to be so", "right_t1": "one effect: right effect or group first",
        "wrong_t1": "one effect: a wrong name", "pairs_t2": "two effects: named exactly"}  # fmt: skip


def begin(output: Path, spec: Mapping[str, Any], code: str) -> dict[str, Any]:
    """Diagnose the first case of each rung, and say and write how long the whole will take.

    Parameters
    ----------
    output : file that receives the seconds a case, by rung, and of all on one core
    spec : ``actuator``, ``sensors`` and ``tolerances`` of a composed configuration, ``name`` of the actuator, ``cases``
        by rung and ``first_seed``
    code : digest of what the cases depend on, which names their folder
    """
    actuator, noise = ActuatorParameters(**spec["actuator"]), SensorNoise(**spec["sensors"])
    population = population_of(actuator, spec["tolerances"])
    folder = folder_of(output, code)
    shutil.rmtree(folder, ignore_errors=True)  # what a killed job left there was not timed
    seconds = {}
    for rung, count in spec["cases"].items():
        if count:
            begun = time.perf_counter()
            run_cases(rung, [spec["first_seed"]], folder, actuator, noise, population=population)
            seconds[rung] = time.perf_counter() - begun
    whole = sum(seconds[rung] * spec["cases"][rung] for rung in seconds)
    each = ", ".join(f"{spec['cases'][rung]} of {rung} at {s:.0f} s" for rung, s in seconds.items())
    say(f"calibration of {spec['name']}: {each}; about {whole / 60:.0f} min on one core, less with --cores")
    out = {"seconds": seconds, "whole": whole}
    write_text(output, json.dumps(out))
    return out


def finish(batches: Sequence[Path], pace: Path, page: Path, output: Path, spec: Mapping[str, Any]) -> dict[str, Any]:
    """Score the cases and write ``calibration.json`` and its page.

    Parameters
    ----------
    batches : what the jobs of the cases have written
    pace, spec : what ``begin`` has written and read

    Raises
    ------
    InputError : a verdict that cannot be read
    """
    rows = scored(batches)["rows"]
    out = {
        "format": FORMAT, "version": __version__,
        "actuator": {"name": spec["name"], "parameters": spec["actuator"]},
        **summary(rows), "seconds": json.loads(pace.read_text())["seconds"],
    }  # fmt: skip
    _page(out).write(page)
    write_text(output, json.dumps(out, indent=1))
    say(f"calibration of {spec['name']}: {told(out)}")
    return out


def summary(rows: Rows) -> dict[str, Any]:
    """What judged cases say of the probabilities.

    Counted are cases without an effect and those whose effects show. The probabilities hold if the calibration error is
    no larger than that of 95 % of equally many cases whose stated probabilities are the true ones.

    Returns
    -------
    ``cases`` made, ``counted``, ``holds``, ``calibration_error`` (value, 90 % interval, and median and 95 % quantile of
    one that holds), ``false_names``, ``reliability`` by stated probability and the ``metrics``
    """
    found = score_rows(list(rows))
    metrics = {m["id"]: {k: m[k] for k in ("value", "low", "high", "cases")} for m in found["metrics"]}
    counted = [r for r in found["rows"] if KNOWN(r)]
    rng = np.random.default_rng(0)
    stated = np.array([r["confidence"] for r in counted])
    drawn = []
    for right in rng.random((DRAWS, stated.size)) < stated:
        drawn.append(calibration_error([{"confidence": p, "confident_right": x} for p, x in zip(stated, right)]))
    middle, most = (float(x) for x in np.quantile(np.array(drawn, float), (0.5, 0.95)))
    error = {k: metrics["ece_known"][k] for k in ("value", "low", "high")}
    free = [r for r in counted if r["rung"] == "T0"]
    return {
        "cases": len(found["rows"]), "counted": len(counted), "holds": bool(error["value"] <= most),
        "calibration_error": error | {"median_if_held": middle, "most_if_held": most},
        "false_names": {"named": sum(bool(r["wrong_name"]) for r in free), "cases": len(free)},
        "reliability": reliability(counted), "metrics": {name: metrics[name] for name in TOLD},
    }  # fmt: skip


def told(out: Mapping[str, Any]) -> str:
    """The result in a sentence."""
    error, false = out["calibration_error"], out["false_names"]
    return (
        f"stated probabilities {'hold' if out['holds'] else 'do not hold'} on {out['counted']} cases: calibration "
        f"error {error['value']:.3f} ({error['low']:.3f} to {error['high']:.3f}), at most {error['most_if_held']:.3f} "
        f"if they hold; {false['named']} of {false['cases']} effect-free cases got a name"
    )


def _page(out: Mapping[str, Any]) -> Page:
    name = out["actuator"]["name"]
    page = Page(f"Probabilities checked on {name}")
    page.paragraph(f"{told(out)[0].upper()}{told(out)[1:]}.", "lead")
    page.figure(
        "reliability", reliability_figure(out["reliability"]),
        "Share of cases in which the most probable hypothesis is right, against the probability stated; the number of "
        "cases beside each point.",
        "; ".join(f"stated {b['confidence']:.2f}, {b['accuracy']:.2f} of {b['count']}" for b in out["reliability"]),
    )  # fmt: skip
    rows = [
        [TOLD[k], f"{m['value']:.3f}", f"{m['low']:.3f} to {m['high']:.3f}", str(m["cases"])]
        for k, m in out["metrics"].items()
        if m["value"] is not None
    ]
    page.table(["of the cases", "share", "90 % interval", "cases"], rows)
    page.paragraph(
        f"{out['cases']} blind cases of units within the tolerances of the actuator; counted are those without an "
        "effect and those whose effects show. emafault diagnose --calibration calibration.json cites this check.",
        "small",
    )
    return page

"""A look at a few blind cases of a rung while developing."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..actuator.parameters import ActuatorParameters
from ..actuator.sensors import SensorNoise
from ..progress import say
from ..withheld.scoring import score
from ..withheld.verdicts import listed_names
from .blind import DEVELOPMENT, run_cases


def look(rung: str, cases: int, folder: Path, spec: Mapping[str, Any], first: int = 0) -> dict:
    """Make, diagnose and score ``cases`` cases of a rung; a line each, then the scores that hold a case.

    Parameters
    ----------
    folder : keeps keys and verdicts
    spec : ``actuator`` and ``sensors`` of a composed configuration
    first : first seed, counted from the first of development

    Returns
    -------
    the scores
    """
    actuator, noise = ActuatorParameters(**spec["actuator"]), SensorNoise(**spec["sensors"])
    for seed in range(DEVELOPMENT + first, DEVELOPMENT + first + cases):
        for name in run_cases(rung, [seed], folder, actuator, noise):
            key = json.loads((folder / "keys" / f"{name}.json").read_text())
            verdict = json.loads((folder / "diagnoses" / name / "diagnosis.json").read_text())
            say(_line(seed, key, verdict))
    found = score(folder)
    for m in found["metrics"]:
        if m["value"] is not None:
            print(f"{m['value']:7.3f} ({m['low']:.3f} to {m['high']:.3f}), {m['cases']:3d} cases: {m['title']}")
    return found


def _line(seed: int, key: Mapping[str, Any], verdict: Mapping[str, Any]) -> str:
    """One case: what is in it, at which distance, and what was said."""
    case = key["case"]
    seen = (key["detectability"] or {}).get("members", {})
    truth = [f"{e} ({seen.get(e, 0.0):.0f})" for e in case["effects"]]
    truth += [
        f"~{u['name']} ({u['distance']:.0f}{'' if u['inside'] else ', outside'})" for u in key.get("unlisted", [])
    ]
    truth += [f"{n} {f:.3g}" for n, f in case.get("controller", {}).items()]
    said = [*listed_names(verdict), *(f"~{d['form']} in {d['equation']}" for d in verdict.get("discovered", []))]
    twin = " plain twin" if case.get("plain") else ""
    words = verdict.get("error") or ", ".join(said) or "-"
    return f"{case['rung']} {seed}{twin}: {', '.join(truth) or '-'} | {verdict['verdict']}: {words}"

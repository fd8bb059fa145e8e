"""Where true values lie within what verdicts on blind cases tell of them: ranks, uniform where all is calibrated."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from ..withheld.verdicts import names_truth, read_verdict

WIDE = 3.29  # standard deviations that a told 90 % interval is wide
BINS = 10


def told_ranks(folder: Path, rung: str = "T1") -> dict[str, Any]:
    """Ranks of true parameters within told Gaussians, over a ladder's cases of a rung whose effects are named exactly.

    Parameters
    ----------
    folder : holds ``keys/NAME.json`` and ``diagnoses/NAME/diagnosis.json``

    Returns
    -------
    ``cases`` named, ``ranks`` (parameter,) from 0 to 1, ``counts`` in ten bins, ``inside`` share within 90 % intervals,
    ``p`` of a Kolmogorov-Smirnov distance as large, parameters of one case taken for independent
    """
    ranks: list[float] = []
    cases = 0
    for path in sorted((folder / "keys").glob("*.json")):
        case = json.loads(path.read_text())["case"]
        verdict_path = folder / "diagnoses" / path.stem / "diagnosis.json"
        if case["rung"] != rung or not verdict_path.exists():
            continue
        found = _ranks(read_verdict(verdict_path), case)
        cases += bool(found)
        ranks += found
    u = np.array(ranks)
    return {
        "cases": cases,
        "ranks": ranks,
        "counts": np.histogram(u, BINS, (0.0, 1.0))[0].tolist(),
        "inside": float(np.mean((u >= 0.05) & (u <= 0.95))) if ranks else None,
        "p": float(stats.kstest(u, "uniform").pvalue) if ranks else None,
    }


def _ranks(verdict: Mapping[str, Any], case: Mapping[str, Any]) -> list[float]:
    entry = next((e for e in verdict["which"] if e["effects"] and "unknown" not in e["effects"]), None)
    if entry is None or not names_truth(tuple(entry["effects"]), tuple(case["effects"])):
        return []
    out = []
    for effect, values in case["effects"].items():
        for name, value in values.items():
            told = entry.get("parameters", {}).get(name) or entry.get("parameters", {}).get(f"{effect}.{name}")
            if told is None or not told["low"] < told["high"]:
                continue
            error = value - told["value"]
            if name == "psi":  # an angle
                error = (error + np.pi) % (2.0 * np.pi) - np.pi
            out.append(float(stats.norm.cdf(WIDE * error / (told["high"] - told["low"]))))
    return out

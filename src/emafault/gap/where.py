"""Where the gap lies: which equation, along which coordinate, how strongly, what share of it."""

from collections.abc import Sequence

import numpy as np

from .inference import Problem
from .misfit import SPECIFICATION, Family

VISIBLE = 3.0  # excess of a family, in standard deviations of its chi-square, from which it is listed
LISTED = 12


def where(problem: Problem, families: Sequence[Family]) -> list[dict]:
    """The families of statistics that the prediction misses, as the verdict file lists them, largest first.

    ``z`` is the family's excess, (chi2 - n)/sqrt(2 n); ``share`` its part of the whole excess, of which
    ``beyond_specification`` may hold another.
    """
    total = sum(max(f.excess, 0.0) * np.sqrt(2.0 * f.size) for f in families) or 1.0
    out = []
    for f in [f for f in families if f.along != SPECIFICATION][:LISTED]:
        if f.excess < VISIBLE:
            break
        cells = [c for c in problem.cells if (c.equation, c.label, c.along) == (f.equation, f.label, f.along)]
        low, high = min(c.low for c in cells), max(c.high for c in cells)
        share = float(max(f.excess, 0.0) * np.sqrt(2.0 * f.size) / total)
        entry = {"equation": f.equation, "along": f.along, "from": float(low), "to": float(high)}
        out.append(entry | {"z": round(f.excess, 2), "share": round(share, 4), "statistic": f.label})
    return out


def beyond_specification(families: Sequence[Family]) -> list[dict]:
    """What a fit has moved far from its specification or measurement: parameter, equation, how many of its standard
    deviations (root mean square where several recordings have one each), ``z`` as in ``where``."""
    out = []
    for f in families:
        if f.along == SPECIFICATION and f.excess >= VISIBLE:
            deviations = float(np.sqrt(1.0 + f.excess * np.sqrt(2.0 / f.size)))
            entry = {"parameter": f.label, "equation": f.equation, "deviations": round(deviations, 1)}
            out.append(entry | {"z": round(f.excess, 2)})
    return out


def equation_of(families: Sequence[Family]) -> str:
    """The equation with the largest excess; the three phases count as one equation unless one of them stands out."""
    totals: dict[str, float] = {}
    phases: dict[str, float] = {}
    for f in families:
        excess = max(f.excess - 1.0, 0.0) * np.sqrt(2.0 * f.size)
        name = f.equation
        if name.startswith("electrical_"):
            phases[name] = phases.get(name, 0.0) + excess
            name = "electrical"
        totals[name] = totals.get(name, 0.0) + excess
    best = max(totals, key=lambda k: totals[k])
    if best == "electrical" and phases:
        first = max(phases, key=lambda k: phases[k])
        if phases[first] > 0.8 * totals["electrical"]:
            return first
    return best

"""Figures of a measured machine's diagnosis: residuals before and after over their coordinate, rival causes."""

import matplotlib.pyplot as plt
import numpy as np

from ..gap.diagnose import Diagnosis
from .style import GREY

AFTER = "#2e86ab"
FAR = 40.0  # standard deviations from which the scale becomes logarithmic
SHOWN = 6  # panels, rivals


def draw_residuals(found: Diagnosis):
    """Standardised residuals of the recalibrated base model and of the named set, a panel per equation.

    Filled: the recordings that were fitted; hollow: those that took no part.
    """
    best = found.found.candidates[0].point.values if found.found.candidates else found.found.null.values
    named = found.decision.verdict in ("explained", "group", "partly")
    sides = [(found.explore, True)] + ([(found.ladder.problem, False)] if found.ladder else [])
    equations = list(dict.fromkeys(cell.equation for problem, _ in sides for cell in problem.cells))[:SHOWN]
    drawing, axes = plt.subplots(
        1, len(equations), figsize=(max(4.0, 3.3 * len(equations)), 3.0), squeeze=False, layout="constrained"
    )
    for axis, equation in zip(axes[0], equations):
        along = ""
        for problem, fitted in sides:
            cells = problem.cells
            rows = [m for m, cell in enumerate(cells) if cell.equation == equation]
            if not rows:
                continue
            along = cells[rows[0]].along.replace("_", " ")
            place = [0.5 * (cells[m].low + cells[m].high) for m in rows]
            before = ((problem.observed - problem.predict(found.found.null.values)[0]) / problem.deviations())[rows]
            fill = {"facecolors": None if fitted else "none", "s": 14 if fitted else 18}
            axis.scatter(place, before, edgecolors=GREY, color=GREY if fitted else None, linewidths=0.8, **_kept(fill))
            if named:
                after = ((problem.observed - problem.predict(best)[0]) / problem.deviations())[rows]
                axis.scatter(
                    place, after, edgecolors=AFTER, color=AFTER if fitted else None, linewidths=0.8, **_kept(fill)
                )
        axis.axhspan(-2, 2, color="#f0f0f0", zorder=0)
        if np.abs(axis.get_ylim()).max() > FAR:
            axis.set_yscale("symlog", linthresh=10, linscale=2)
        axis.set_title(equation.replace("_", " "))
        axis.set_xlabel(along)
    axes[0][0].set_ylabel("residual (standard deviations)")
    return drawing


def _kept(values: dict) -> dict:
    return {key: value for key, value in values.items() if value is not None}


def draw_rivals(found: Diagnosis):
    """Evidence of the fitted sets on the explored part and their residual on the held-out part."""
    rivals = found.verdict["held_out"]["rivals"]
    by_gain = sorted(rivals, key=lambda r: -r["log_evidence_gain"])[:SHOWN][::-1]
    names = [" + ".join(r["effects"]) for r in by_gain]
    drawing, (left, right) = plt.subplots(
        1, 2, figsize=(10, 0.36 * len(names) + 1.4), sharey=True, layout="constrained", width_ratios=(1, 1)
    )
    place = np.arange(len(names))
    left.barh(place, [r["log_evidence_gain"] for r in by_gain], color=AFTER)
    left.set_yticks(place, [n.replace("_", " ") for n in names], fontsize=8)
    left.set_xlabel("log evidence, explored part")
    right.barh(place, [r["rms"] for r in by_gain], color="#3d9970")
    signal = found.verdict["shrinks"]["signal"]
    right.axvline(signal["recalibrated"], color=GREY, label="recalibrated base model")
    right.axvline(signal["placebo"], color=GREY, linestyle=":", label="placebo")
    right.axvline(1.0, color="black", linewidth=0.8, label="noise")
    right.set_xlabel("residual, held-out part (sd)")
    right.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, 1.25), ncols=3)
    return drawing

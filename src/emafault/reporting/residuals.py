"""Figures of a measured machine's diagnosis: residuals of each equation before and after, along their coordinate."""

from collections.abc import Sequence

import matplotlib.pyplot as plt
import numpy as np

from .style import GREY

AFTER = "#2e86ab"
FAR = 40.0  # standard deviations from which the scale becomes logarithmic
SHOWN = 6  # panels

#: equation, coordinate, place (row,), residual before and after (row,) in standard deviations, whether it was set aside
Panel = tuple[str, str, np.ndarray, np.ndarray, np.ndarray, bool]


def draw_residuals(panels: Sequence[Panel]) -> plt.Figure:
    """Residuals of the recalibrated base model (grey) and of the named set (blue); hollow: recordings set aside."""
    equations = list(dict.fromkeys(p[0] for p in panels))[:SHOWN]
    width = max(4.0, 3.3 * len(equations))
    drawing, axes = plt.subplots(1, len(equations), figsize=(width, 3.0), squeeze=False, layout="constrained")
    for axis, equation in zip(axes[0], equations, strict=True):
        for name, along, place, before, after, aside in panels:
            if name != equation:
                continue
            axis.set_xlabel(along.replace("_", " "))
            for values, colour in ((before, GREY), (after, AFTER)):
                face = "none" if aside else colour
                axis.scatter(place, values, s=16, edgecolors=colour, facecolors=face, linewidths=0.8)
        axis.axhspan(-2, 2, color="#f0f0f0", zorder=0)
        if np.abs(axis.get_ylim()).max() > FAR:
            axis.set_yscale("symlog", linthresh=10, linscale=2)
        axis.set_title(equation.replace("_", " "))
    axes[0][0].set_ylabel("residual (standard deviations)")
    return drawing

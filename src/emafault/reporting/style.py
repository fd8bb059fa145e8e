"""Looks that all figures share."""

import sys

import matplotlib

if "IPython" not in sys.modules:  # a notebook keeps its own
    matplotlib.use("Agg")

import matplotlib.pyplot as plt
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

#: one colour a reconstruction; others take the remaining ones in turn
COLOURS = {
    "paper": "#b5651d",
    "weighted": "#4c78a8",
    "weighted_floating": "#2a9d8f",
    "angle_resolved": "#7b5ea7",
    "nine": "#c2185b",
    "nine_heating": "#e39a2d",
}
PHASE_COLOURS = ("#d1495b", "#2e86ab", "#3d9970")
GREY = "#8a8a8a"
LABELS = {"Na": "$N_a$", "Nb": "$N_b$", "Nc": "$N_c$", "xi_x": r"$\xi_x$", "xi_y": r"$\xi_y$", "dT": r"$\Delta T$ (K)"}

plt.rcParams.update(
    {
        "figure.constrained_layout.use": True,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.grid": True,
        "grid.color": "#e6e6e6",
        "axes.axisbelow": True,
        "font.size": 10,
        "axes.titlesize": 11,
        "legend.frameon": False,
    }
)


def readable_log(axis) -> None:
    """Plain numbers at 1, 2 and 5 of each decade of a logarithmic axis, or at 1 where it spans many."""
    low, high = axis.get_view_interval()
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 60.0 * low else (1.0,)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def colour(method: str) -> str:
    """Colour of a reconstruction."""
    return COLOURS.get(method, "#555555")


def named(method: str, estimator: str) -> str:
    """A reconstruction with an estimator, in words."""
    return f"{method.replace('_', ' ')}, {estimator.replace('_', ' ')}"

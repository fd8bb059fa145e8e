"""Looks that all figures share."""

import sys
from collections.abc import Sequence

import matplotlib

if "IPython" not in sys.modules:  # a notebook keeps its own
    matplotlib.use("Agg")

import matplotlib.pyplot as plt
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

#: one colour a reconstruction, told apart by the colour-blind: Okabe and Ito, https://jfly.uni-koeln.de/color/, 2008
COLOURS = {
    "paper": "#d55e00",
    "weighted": "#0072b2",
    "weighted_floating": "#009e73",
    "angle_resolved": "#cc79a7",
    "nine": "#1d1f21",
    "nine_heating": "#e69f00",
}
PHASE_COLOURS = ("#d55e00", "#0072b2", "#1d1f21")
BEFORE, AFTER, INK = "#c04f00", "#0072b2", "#1d1f21"  # as the style sheet of a page has them
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


def ink_on(background: Sequence[float]) -> str:
    """Black or white, whichever stands out more of a colour (red, green, blue; 0 to 1), by 4.5 times at least."""
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in background]
    luminance = 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
    return "#000000" if (luminance + 0.05) ** 2 > 0.05 * 1.05 else "#ffffff"  # equal contrast to both


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

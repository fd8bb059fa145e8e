"""Errors of estimators beside the Cramer-Rao bound, and estimates over truth."""

from collections.abc import Mapping, Sequence

import numpy as np

from ..faults import FAULT_NAMES
from .style import AFTER, BEFORE, GREY, INK, LABELS, colour, named, plt, readable_log


def error_boxes(errors: Mapping[tuple[str, str], np.ndarray], bound: Mapping[str, float] | None):
    """Box plots of absolute errors by component, one box an estimator, logarithmic.

    Parameters
    ----------
    errors : (method, estimator) -> (run, 6) estimate less truth
    bound : component -> mean absolute error at the bound, drawn as a line
    """
    names = list(errors)
    figure, grid = plt.subplots(2, 3, figsize=(11.5, 1.7 + 0.5 * len(names)), sharey=True)
    for j, axes in enumerate(grid.flat):
        component = FAULT_NAMES[j]
        for place, key in enumerate(names):
            data = np.abs(errors[key][:, j])
            data = data[np.isfinite(data)]
            axes.boxplot(
                [np.maximum(data, 1e-9)],
                positions=[-place],
                orientation="horizontal",
                widths=0.55,
                whis=(5, 95),
                showfliers=False,
                showmeans=True,
                meanprops={"marker": "D", "markersize": 4, "markerfacecolor": INK, "markeredgecolor": "none"},
                medianprops={"color": INK},
                patch_artist=True,
                boxprops={"facecolor": colour(key[0]), "alpha": 0.55, "edgecolor": colour(key[0])},
            )
        if bound:
            axes.axvline(bound[component], color=BEFORE, lw=1.2, ls="--")
        axes.set_xscale("log")
        axes.set_title(f"absolute error of {LABELS[component]}", loc="left", fontsize=10)
        axes.set_yticks([-place for place in range(len(names))], [named(*key) for key in names])
        axes.grid(axis="y", visible=False)
    return figure


def errors_in_words(errors: Mapping[tuple[str, str], np.ndarray], bound: Mapping[str, float] | None) -> str:
    """What the box plots show, for who cannot see them: mean absolute errors, and those at the bound."""
    rows = {named(*key): np.nanmean(np.abs(e), axis=0) for key, e in errors.items()}
    if bound:
        rows["bound"] = np.array([bound[c] for c in FAULT_NAMES])
    said = [f"{name} {', '.join(f'{c} {x:.2g}' for c, x in zip(FAULT_NAMES, row))}" for name, row in rows.items()]
    return f"Mean absolute errors. {'; '.join(said)}."


def residuals_over_truth(value: np.ndarray, low: np.ndarray, high: np.ndarray, truth: np.ndarray):
    """Estimates less the truth with their intervals, over the truth, (run, 6) each; at most 100 runs are drawn."""
    figure, grid = plt.subplots(2, 3, figsize=(11, 6))
    pick = slice(None, 100)
    for j, axes in enumerate(grid.flat):
        t, v = truth[pick, j], value[pick, j]
        missed = (t < low[pick, j]) | (t > high[pick, j])
        bars = np.stack([v - low[pick, j], high[pick, j] - v])
        for rows, dot, bar, label in (
            (~missed, AFTER, "#99c7e0", "interval holds the truth"),
            (missed, BEFORE, "#e6b999", "interval misses it"),
        ):
            axes.errorbar(
                t[rows], (v - t)[rows], yerr=bars[:, rows], fmt=".", ms=4, lw=0.9, color=dot, ecolor=bar, label=label
            )
        axes.axhline(0.0, color=GREY, lw=0.8, zorder=0)
        axes.set_title(LABELS[FAULT_NAMES[j]], loc="left")
        axes.set_xlabel("true value")
        axes.set_ylabel("estimate minus true value")
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2)
    return figure


def residuals_in_words(value: np.ndarray, low: np.ndarray, high: np.ndarray, truth: np.ndarray) -> str:
    """What the residuals show, for who cannot see them; (run, 6) each, of which at most 100 runs count."""
    value, low, high, truth = (x[:100] for x in (value, low, high, truth))
    held, size = ((low <= truth) & (truth <= high)).sum(axis=0), np.nanmean(np.abs(value - truth), axis=0)
    said = [f"{c} in {n} of {len(truth)}, mean error {s:.2g}" for c, n, s in zip(FAULT_NAMES, held, size)]
    return f"Intervals hold the truth of {'; '.join(said)}."


def variants(names: Sequence[str], tables: Mapping[str, Mapping[str, Sequence[float]]]):
    """Errors of a study's variants: one panel an output (N, xi, dT), one line an estimator, logarithmic.

    Parameters
    ----------
    names : variants, in order
    tables : output -> label of an estimator (``bound`` is drawn dashed) -> mean absolute error of each variant
    """
    figure, grid = plt.subplots(1, len(tables), figsize=(12, 1.9 + 0.32 * len(names)), sharey=True, squeeze=False)
    places = -np.arange(len(names))
    for axes, (output, lines) in zip(grid[0], tables.items()):
        for number, (label, values) in enumerate(lines.items()):
            if label == "bound":
                axes.plot(values, places, "|", color=BEFORE, ms=14, mew=2, label="Cramer-Rao bound")
            else:
                method = label.split(",")[0].replace(" ", "_")
                marker = "o" if "network" in label else "s" if "closed" in label else "D"
                shift = 0.12 * (number - 0.5 * len(lines))
                axes.plot(values, places - shift, marker, color=colour(method), ms=6, alpha=0.85, label=label)
        axes.set_xscale("log")
        readable_log(axes.xaxis)
        axes.set_title(f"mean absolute error of {output}", loc="left", fontsize=10)
        axes.set_yticks(places, [name.replace("_", " ") for name in names])
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=9)
    return figure

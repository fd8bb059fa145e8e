"""Training and search: learning curves, the search over trials and the Pareto front of error and size."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .style import GREY, INK, PHASE_COLOURS, colour, plt, readable_log


def learning_curves(histories: Mapping[str, Sequence[Sequence[Mapping[str, Any]]]]):
    """Mean squared error of training and validation rows over epochs, one panel a network, one line a seed.

    Parameters
    ----------
    histories : ``method, estimator`` -> for each seed its passes, each with ``train``, ``validation``, ``best_epoch``
    """
    count = max(1, len(histories))
    columns = min(count, 2)
    rows = -(-count // columns)
    figure, grid = plt.subplots(rows, columns, figsize=(5.4 * columns, 3.1 * rows), squeeze=False)
    for axes, (label, seeds) in zip(grid.flat, histories.items()):
        for number, passes in enumerate(seeds):
            curve = passes[0]
            names = ("training rows", "validation rows", "kept") if number == 0 else (None, None, None)
            axes.plot(curve["train"], color=colour(label.split(",")[0].replace(" ", "_")), lw=1, label=names[0])
            axes.plot(curve["validation"], color=PHASE_COLOURS[0], lw=0.9, ls="--", label=names[1])
            best = curve["best_epoch"]
            axes.plot(best, curve["validation"][best], "o", ms=4, color=INK, label=names[2])
        axes.set_yscale("log")
        axes.set_xlabel("epoch")
        axes.set_ylabel("mean squared error, standardised")
        axes.set_title(f"{label}: {len(seeds)} seeds", loc="left", fontsize=10)
        axes.legend(fontsize=8)
    for axes in list(grid.flat)[len(histories) :]:
        axes.set_visible(False)
    return figure


def learning_in_words(histories: Mapping[str, Sequence[Sequence[Mapping[str, Any]]]]) -> str:
    """What the learning curves show, for who cannot see them: those of the first seed."""
    said = []
    for label, seeds in histories.items():
        first = seeds[0][0]
        best, losses = first["best_epoch"], first["validation"]
        said.append(f"{label}: validation error from {losses[0]:.2g} to {losses[best]:.2g} at epoch {best}")
    return f"{'; '.join(said) or 'No network was trained'}."


def search_and_front(trials: Sequence[Mapping[str, Any]], chosen: int):
    """Left: error of each trial and the best so far. Right: error over number of parameters with the Pareto front.

    Parameters
    ----------
    trials : each with ``number``, ``error`` (over range), ``parameters``, ``pareto``
    chosen : number of the trial whose network is used
    """
    ordered = sorted(trials, key=lambda trial: trial["number"])
    numbers = np.arange(1, len(ordered) + 1)
    error = np.array([trial["error"] for trial in ordered])
    size = np.array([trial["parameters"] for trial in ordered])
    front = np.array([trial["pareto"] for trial in ordered])
    mine = np.array([trial["number"] == chosen for trial in ordered])
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4))
    left.plot(numbers, error, ".", color=GREY, label="trial")
    left.plot(
        numbers, np.minimum.accumulate(error), color=PHASE_COLOURS[1], drawstyle="steps-post", label="best so far"
    )
    left.set(xlabel="trial", ylabel="held-out error over range", yscale="log")
    left.legend()
    right.plot(size[~front], error[~front], ".", color=GREY, label="dominated")
    order = np.argsort(size[front])
    right.plot(
        size[front][order],
        error[front][order],
        "o-",
        color=PHASE_COLOURS[2],
        drawstyle="steps-post",
        label="Pareto front",
    )
    right.plot(size[mine], error[mine], "*", ms=14, color=PHASE_COLOURS[0], label="chosen")
    right.set(xlabel="number of parameters", ylabel="held-out error over range", xscale="log", yscale="log")
    readable_log(right.xaxis)
    right.legend()
    return figure


def search_in_words(trials: Sequence[Mapping[str, Any]], chosen: int) -> str:
    """What the picture of the search shows, for who cannot see it."""
    mine = next(t for t in trials if t["number"] == chosen)
    least = min(trials, key=lambda t: t["error"])
    front = sum(bool(t["pareto"]) for t in trials)
    return (
        f"The smallest error of {len(trials)} trials is {least['error']:.3g} with {least['parameters']} parameters; "
        f"the chosen one has {mine['error']:.3g} with {mine['parameters']}. {front} trials are on the Pareto front."
    )

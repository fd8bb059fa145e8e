"""Pictures of the search for the command that identifies best."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .style import AFTER, PHASE_COLOURS, plt, readable_log

COLOURS = dict(zip(("paper", "free", "loaded"), PHASE_COLOURS, strict=True))
OUTPUTS = {"N": "N", "xi": "ξ", "dT": "ΔT (K)"}


def lengths(entries: Sequence[Mapping[str, Any]], words: Mapping[str, str]):
    """Bound (lines) and error of fresh runs (dots) over the length of recording; a panel an output.

    Parameters
    ----------
    entries : what ``study.confirmed_command.confirm_commands`` wrote
    words : role -> label
    """
    figure, axes = plt.subplots(1, len(OUTPUTS), figsize=(11.0, 3.8))
    for panel, (output, label) in zip(axes, OUTPUTS.items(), strict=True):
        for role, colour in COLOURS.items():
            own = sorted((e for e in entries if e["role"] == role), key=lambda e: e["design"]["length"])
            kept = [e for e in own if not e["breaches"]]
            x = [e["design"]["length"] for e in kept]
            panel.plot(x, [e["bound"][output] for e in kept], color=colour, label=words[role])
            panel.plot(x, [e["errors"][output] for e in kept], "o", color=colour)
        panel.set_xscale("log")
        panel.set_yscale("log")
        readable_log(panel.xaxis)
        readable_log(panel.yaxis)
        panel.set_xlabel("length (s)")
        panel.set_title(f"mean absolute error of {label}", loc="left", fontsize=10)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    return figure


def signals(of: Mapping[str, Mapping[str, np.ndarray]], interval: float):
    """Output position, speed and current of phase a of the first run under several commands, a column a command."""
    rows = {
        "output_position": ("output (rad)", lambda x: x),
        "rotor_speed": ("motor speed (rad/s)", lambda x: x),
        "phase_current": ("current of phase a (A)", lambda x: x[:, 0]),
    }
    figure, grid = plt.subplots(len(rows), len(of), figsize=(3.8 * len(of), 6.5), sharex="col", squeeze=False)
    for column, (label, own) in enumerate(of.items()):
        time = interval * np.arange(1, own["rotor_speed"].shape[1] + 1)
        for row, (name, (unit, pick)) in enumerate(rows.items()):
            grid[row][column].plot(time, pick(own[name][0]), color=AFTER, lw=0.8)
            if not column:
                grid[row][column].set_ylabel(unit)
        grid[0][column].set_title(label, loc="left", fontsize=10)
        grid[-1][column].set_xlabel("time (s)")
    return figure

"""Figures of recordings and of motions over time."""

from collections.abc import Mapping

import matplotlib.pyplot as plt
import numpy as np

from ..io.recording import PHASES, Recording
from . import style

SHOWN = 4000  # samples of a line


def draw_recordings(recordings: Mapping[str, Recording]) -> plt.Figure:
    """Voltages, currents, speed and position over time, a column a recording."""
    fig, axes = plt.subplots(4, len(recordings), figsize=(5.6 * len(recordings), 7.2), squeeze=False, sharex="col")
    for column, (name, r) in zip(axes.T, recordings.items(), strict=True):
        every = slice(None, None, max(1, len(r.time) // SHOWN))
        for ax, values, label in zip(column, (r.phase_voltage, r.phase_current), ("voltage (V)", "current (A)")):
            for j, phase in enumerate(PHASES):
                ax.plot(r.time[every], values[every, j], lw=0.7, color=style.PHASE_COLOURS[j], label=phase)
            ax.set_ylabel(label)
        column[0].legend(ncols=3, fontsize=8, loc="upper right")
        column[0].set_title(name, loc="left")
        column[2].plot(r.time[every], r.rotor_speed[every], lw=0.8, color=style.INK)
        column[2].set_ylabel("rotor speed (rad/s)")
        column[3].plot(r.time[every], r.commanded_position[every], lw=1.0, color=style.GREY, label="commanded")
        column[3].plot(r.time[every], r.output_position[every], lw=1.0, color=style.AFTER, label="measured")
        column[3].set_ylabel("position (rad)")
        column[3].legend(fontsize=8)
        column[3].set_xlabel("time (s)")
    return fig


def draw_motions(motions: Mapping[str, np.ndarray]) -> plt.Figure:
    """Commanded positions (rad) over time (s), a panel each; ``motions`` are (time, 2)."""
    fig, axes = plt.subplots(1, max(1, len(motions)), figsize=(3.8 * max(1, len(motions)), 2.6), squeeze=False)
    for ax, (name, motion) in zip(axes[0], motions.items()):
        ax.plot(motion[:, 0], motion[:, 1], color=style.AFTER, lw=1.2)
        ax.set_title(name, loc="left")
        ax.set_xlabel("time (s)")
        ax.set_ylabel("position (rad)")
    return fig


def draw_estimates(estimates: Mapping[str, Mapping[str, Mapping[str, float]]]) -> plt.Figure:
    """Fault vectors with their intervals, a colour a recording; components of one unit share a panel."""
    parts = (("Na", "Nb", "Nc"), ("xi_x", "xi_y"), ("dT",))
    fig, axes = plt.subplots(1, 3, figsize=(9.6, 3.0), width_ratios=[3, 2, 1.3])
    shifts = np.linspace(-0.28, 0.28, len(estimates)) if len(estimates) > 1 else np.zeros(1)
    for ax, components in zip(axes, parts):
        for k, (name, found) in enumerate(estimates.items()):
            value, low, high = (np.array([found[c][key] for c in components]) for key in ("value", "low", "high"))
            ax.errorbar(
                np.arange(len(components)) + shifts[k], value, yerr=[value - low, high - value], fmt="o", ms=4,
                capsize=2.5, label=name,
            )  # fmt: skip
        ax.set_xticks(range(len(components)), [style.LABELS[c] for c in components])
        ax.grid(axis="x", visible=False)
        ax.set_xlim(-0.5, len(components) - 0.5)
    fig.legend(*axes[0].get_legend_handles_labels(), loc="outside upper left", ncols=min(4, len(estimates)), fontsize=8)
    return fig

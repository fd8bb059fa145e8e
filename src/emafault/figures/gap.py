"""Figures of a diagnosis, drawn from plain arrays."""

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import LinearSegmentedColormap, LogNorm

from . import style

BEFORE, AFTER, MEASURED, FLOOR = "#c8553d", "#2a9d8f", "#22262b", "#8a8a8a"
#: from nothing to see, through visible, to strong; z below 3 stays nearly white
_MAP = LinearSegmentedColormap.from_list("z", ["#f7f7f5", "#f3e3c3", "#e8a15b", "#c8553d", "#6d1f2f"])
#: coordinates in words, where a twin has none of its own
COORDINATES = {"rotor_angle": "rotor angle", "rotor_speed": "rotor speed (rad/s)", "order": "order of the turn"}


def draw_map(
    rows: Sequence[str],
    columns: Sequence[tuple[str, str]],
    before: np.ndarray,
    after: np.ndarray | None,
    words: Mapping[str, str] = COORDINATES,
) -> plt.Figure:
    """Equation by region: strength of the misfit before and after.

    Parameters
    ----------
    columns : (coordinate, region) of each column; columns of one coordinate stand together
    before, after : (row, column) excess misfit in standard deviations; NaN where there is no statistic
    words : coordinates in words
    """
    panels = [("before: nominal, recalibrated", before)] + (
        [("after: with the named effects", after)] if after is not None else []
    )
    height = 0.27 * len(rows) * len(panels) + 1.0 + 0.75 * len(panels)
    fig, axes = plt.subplots(len(panels), 1, figsize=(10.5, height), squeeze=False, sharex=True)
    norm = LogNorm(1.0, max(100.0, float(np.nanmax(before, initial=1.0))))
    image: Any = None
    for ax, (title, values) in zip(axes[:, 0], panels):
        shown = np.ma.masked_invalid(np.maximum(values, 1.0))
        image = ax.imshow(shown, aspect="auto", cmap=_MAP, norm=norm, interpolation="nearest")
        ax.set_yticks(range(len(rows)), [r.replace("_", " ") for r in rows])
        ax.set_title(title, loc="left")
        ax.grid(False)
        ax.set_facecolor("#e9e9e7")
        ax.tick_params(length=0)
        for spine in ax.spines.values():
            spine.set_visible(False)
        for m in range(1, len(columns)):
            if columns[m][0] != columns[m - 1][0]:
                ax.axvline(m - 0.5, color="white", lw=3)
    bottom = axes[-1, 0]
    bottom.set_xticks(range(len(columns)), [c[1] for c in columns], rotation=90, fontsize=7.5)
    start = 0
    for m in range(1, len(columns) + 1):
        if m == len(columns) or columns[m][0] != columns[start][0]:
            name = words.get(columns[start][0], columns[start][0].replace("_", " "))
            axes[0, 0].text(
                0.5 * (start + m - 1), -0.72, name, ha="center", va="bottom", fontsize=8.5,
                rotation=0 if m - start > 1 else 35, color="#444",
            )  # fmt: skip
            start = m
    for ax in axes[:1, 0]:
        ax.set_title(panels[0][0], loc="left", pad=26 if len(columns) > 4 else 18)
    bar = fig.colorbar(image, ax=axes[:, 0], shrink=0.8, pad=0.01)
    bar.set_label(
        "misfit beyond noise\n(standard deviations)" if height < 5 else "misfit beyond the noise (standard deviations)"
    )
    bar.outline.set_visible(False)  # type: ignore[operator]
    return fig


def draw_recordings(
    rows: Sequence[str], names: Sequence[str], confirm: int, before: np.ndarray, after: np.ndarray | None
) -> plt.Figure:
    """Equation by recording: root mean square of z before and after; the last ``confirm`` recordings were held out."""
    panels = [("before", before)] + ([("after", after)] if after is not None else [])
    fig, axes = plt.subplots(
        1, len(panels), figsize=(10.5, 0.25 * len(rows) + 2.1),
        squeeze=False, sharey=True,
    )  # fmt: skip
    norm = LogNorm(0.8, max(20.0, float(np.nanmax(before, initial=1.0))))
    image: Any = None
    for ax, (title, values) in zip(axes[0], panels):
        shown = np.ma.masked_invalid(np.maximum(values, 0.8))
        image = ax.imshow(shown, aspect="auto", cmap=_MAP, norm=norm, interpolation="nearest")
        ax.set_xticks(range(len(names)), names, rotation=40, ha="right", fontsize=7.5)
        ax.set_yticks(range(len(rows)), [r.replace("_", " ") for r in rows])
        ax.set_title(title, loc="left")
        ax.grid(False)
        ax.set_facecolor("#e9e9e7")
        ax.tick_params(length=0)
        for spine in ax.spines.values():
            spine.set_visible(False)
        if 0 < confirm < len(names):
            ax.axvline(len(names) - confirm - 0.5, color="#22262b", lw=1.2)
            ax.text(len(names) - 0.5, -0.62, "held out", ha="right", va="bottom", fontsize=8)
    bar = fig.colorbar(image, ax=axes[0], shrink=0.9, pad=0.01)
    bar.set_label("rms misfit over noise")
    bar.outline.set_visible(False)  # type: ignore[operator]
    return fig


def draw_ranking(entries: Sequence[Mapping[str, Any]]) -> plt.Figure:
    """Probability and log evidence gain of every reading; members of a group share a bracket.

    ``entries``: label, probability, gain (None where it has none), group, kind (named, rival, empty, unknown).
    """
    fig, (left, right) = plt.subplots(
        1, 2, figsize=(9.6, 0.36 * len(entries) + 1.2), sharey=True, width_ratios=[1, 1.1]
    )
    colours = {"named": AFTER, "rival": "#9db4c0", "empty": "#6c757d", "unknown": BEFORE}
    y = np.arange(len(entries))
    for m, entry in enumerate(entries):
        colour = colours[entry["kind"]]
        left.barh(m, entry["probability"], color=colour, height=0.66)
        text = f"{100 * entry['probability']:.1f} %" if entry["probability"] >= 5e-4 else "< 0.1 %"
        left.text(entry["probability"] + 0.01, m, text, va="center", fontsize=8.5)
        if entry["gain"] is None:
            right.text(
                0.0,
                m,
                "  not a fit" if entry["kind"] == "unknown" else "  reference",
                va="center",
                fontsize=8.5,
                color="#777",
            )
        else:
            right.barh(m, entry["gain"], color=colour, height=0.66)
            side = "left" if entry["gain"] >= 0 else "right"
            digits = 0 if abs(entry["gain"]) > 1e3 else 1
            right.annotate(
                f"{entry['gain']:,.{digits}f}", (entry["gain"], m), xytext=(4 if side == "left" else -4, 0),
                textcoords="offset points", va="center", ha=side, fontsize=8.5,
            )  # fmt: skip
    grouped = [m for m, entry in enumerate(entries) if entry["group"]]
    if len(grouped) > 1:
        left.plot(
            [1.13, 1.16, 1.16, 1.13],
            [grouped[0] - 0.3, grouped[0] - 0.3, grouped[-1] + 0.3, grouped[-1] + 0.3],
            color="#444",
            lw=1,
            clip_on=False,
        )
        left.text(1.18, np.mean(grouped), "one\ngroup", va="center", fontsize=8, clip_on=False)
    left.set_yticks(y, [entry["label"] for entry in entries])
    left.set_xlim(0, 1.12)
    left.set_xticks([0, 0.25, 0.5, 0.75, 1.0], ["0", "25 %", "50 %", "75 %", "100 %"])
    left.set_xlabel("probability")
    gains = [abs(e["gain"]) for e in entries if e["gain"] is not None]
    if gains and max(gains) > 200:
        right.set_xscale("symlog", linthresh=10)
    right.margins(x=0.16)
    right.set_xlabel("gain in log evidence over no effect")
    left.invert_yaxis()
    for ax in (left, right):
        ax.grid(axis="y", visible=False)
        ax.tick_params(axis="y", length=0)
    return fig


def draw_ladder(rungs: Mapping[str, Mapping[str, float | None] | None]) -> plt.Figure:
    """How far: root mean square misfit of each model on the held-out recordings, for signal, features, fault vector."""
    shown = {k: v for k, v in rungs.items() if v}
    fig, axes = plt.subplots(1, 3, figsize=(11, 2.9), squeeze=False)
    for ax in axes[0, len(shown) :]:
        ax.set_axis_off()
    names = ("nominal", "recalibrated", "placebo", "after", "floor")
    colours = dict(zip(names, ("#b9b9b5", BEFORE, "#dcae7c", AFTER, FLOOR)))
    units = {
        "signal": "misfit over noise (rms)",
        "features": "R, k error over noise (rms)",
        "fault_vector": "fault error (rms, % of range)",
    }
    for ax, (kind, rung) in zip(axes[0], shown.items()):
        present = [n for n in names if rung.get(n) is not None]
        values = [float(rung[n]) for n in present]  # type: ignore[arg-type]
        ax.bar(range(len(present)), values, color=[colours[n] for n in present], width=0.66)
        if max(values) > 12 * max(min(values), 1e-9):
            ax.set_yscale("log")
            ax.set_ylim(0.5 * min(values), 2.6 * max(values))
        else:
            ax.set_ylim(0, 1.18 * max(values))
        for m, value in enumerate(values):
            ax.annotate(
                f"{value:.3g}", (m, value), xytext=(0, 2), textcoords="offset points", ha="center", fontsize=8.5
            )
        ax.set_xticks(range(len(present)), present, rotation=28, ha="right")
        share = rung.get("closed")
        title = kind.replace("_", " ")
        ax.set_title(title + (f": {100 * share:.1f} % closed" if share is not None else ""), loc="left")
        ax.set_ylabel(units[kind])
        ax.grid(axis="x", visible=False)
    return fig


def draw_faults(groups: Sequence[Mapping[str, Any]]) -> plt.Figure:
    """Fault vector before and after with 90 % intervals, one row of panels per different fault; a tick marks the truth.

    ``groups``: label, before, after (component -> value, low, high), truth (component -> value or absent).
    """
    fig, axes = plt.subplots(
        len(groups), 3, figsize=(9.6, 1.55 * len(groups) + 0.5), squeeze=False, width_ratios=[3, 2, 1.3]
    )
    parts = (("Na", "Nb", "Nc"), ("xi_x", "xi_y"), ("dT",))
    for row, group in zip(axes, groups):
        for ax, components in zip(row, parts):
            for m, c in enumerate(components):
                for shift, kind, colour in ((-0.13, "before", BEFORE), (0.13, "after", AFTER)):
                    entry = group[kind].get(c)
                    if entry is None:
                        continue
                    low, high = entry["value"] - entry["low"], entry["high"] - entry["value"]
                    ax.errorbar(
                        m + shift, entry["value"], yerr=[[max(low, 0)], [max(high, 0)]], fmt="o", ms=4.5, lw=1.6,
                        color=colour, capsize=2.5, label=kind if m == 0 and components[0] == "Na" else None,
                    )  # fmt: skip
                if group["truth"] and c in group["truth"]:
                    ax.plot(
                        [m - 0.32, m + 0.32], [group["truth"][c]] * 2, color=MEASURED, lw=1.3, zorder=1,
                        label="truth" if m == 0 and components[0] == "Na" else None,
                    )  # fmt: skip
            ax.set_xticks(range(len(components)), [style.LABELS[c] for c in components])
            ax.set_xlim(-0.6, len(components) - 0.4)
            ax.grid(axis="x", visible=False)
            if components[0] != "dT":
                ax.axhline(0, color="#bbb", lw=0.8, zorder=0)
        row[0].set_ylabel(group["label"], fontsize=8.5)
    axes[0, 0].legend(ncols=3, fontsize=8, loc="lower left", bbox_to_anchor=(0, 1.0), borderaxespad=0.1)
    return fig


def draw_region(region: Any) -> plt.Figure:
    """Measured against simulated around the worst region: residual along its coordinate, and signals in time."""
    labels = {"recalibrated": "simulated before", "after": "simulated after"}
    colours = {"recalibrated": BEFORE, "after": AFTER}
    count = len(region.traces)
    fig = plt.figure(figsize=(10.2, 3.9))
    grid = fig.add_gridspec(count, 2, width_ratios=[1.05, 1.2])
    ax = fig.add_subplot(grid[:, 0])
    ax.errorbar(
        region.centre, region.curves["measured"], yerr=1.645 * region.error, fmt="o", ms=3.2, lw=0.9, color=MEASURED,
        label="measured, 90 % interval", zorder=3,
    )  # fmt: skip
    for rung, label in labels.items():
        if rung in region.curves:
            ax.plot(region.centre, region.curves[rung], color=colours[rung], lw=1.8, label=label)
    ax.set_xlabel(region.coordinate)
    ax.set_ylabel(region.residual, fontsize=9)
    ax.legend(fontsize=8, loc="best")
    first = None
    for m, (name, lines) in enumerate(region.traces.items()):
        trace = fig.add_subplot(grid[m, 1], sharex=first)
        first = first or trace
        for rung, label in labels.items():
            if rung in lines:
                trace.plot(region.time, lines[rung], color=colours[rung], lw=1.0, alpha=0.9, label=label)
        trace.plot(region.time, lines["measured"], color=MEASURED, lw=0.9, alpha=0.75, label="measured", zorder=1)
        trace.set_ylabel(name, fontsize=8.5)
        if m < count - 1:
            plt.setp(trace.get_xticklabels(), visible=False)
        else:
            trace.set_xlabel("time (s)")
    return fig


def draw_statistics(
    label: str, coordinate: str, x: np.ndarray, observed: np.ndarray, before: np.ndarray, after: np.ndarray | None
) -> plt.Figure:
    """Statistics of the worst equation over their coordinate, in units of their noise: observed less predicted."""
    fig, ax = plt.subplots(figsize=(8.4, 3.2))
    order = np.argsort(x, kind="stable")
    ax.axhspan(-2, 2, color="#efefec", zorder=0)
    ax.plot(x[order], (observed - before)[order], "o", ms=3.5, color=BEFORE, label="before")
    if after is not None:
        ax.plot(x[order], (observed - after)[order], "o", ms=3.5, color=AFTER, label="after")
    ax.axhline(0, color="#999", lw=0.8)
    ax.set_xlabel(coordinate)
    ax.set_ylabel("measured less predicted,\nin standard deviations")
    ax.set_title(label, loc="left")
    ax.legend(fontsize=8.5)
    return fig


def draw_visibility(sizes: Mapping[str, float]) -> plt.Figure:
    """Smallest size of each effect that would have shown, over its usual size, on a logarithmic axis."""
    names = sorted(sizes, key=lambda e: sizes[e])
    fig, ax = plt.subplots(figsize=(8.4, 0.2 * len(names) + 0.9))
    values = np.clip([sizes[n] for n in names], 1e-4, 1e3)
    colours = [BEFORE if v > 1.0 else "#e8a15b" if v > 0.3 else AFTER for v in values]
    y = np.arange(len(names))
    ax.hlines(y, 1e-4, values, color="#dcdcd8", lw=1.2)
    ax.scatter(values, y, c=colours, s=26, zorder=3)
    ax.axvline(1.0, color="#777", lw=1.0)
    ax.set_xscale("log")
    ax.set_xlim(0.5 * float(values.min()), max(2.0, 2.0 * float(values.max())))
    ax.set_yticks(y, [n.replace("_", " ") for n in names], fontsize=8.5)
    ax.set_ylim(-0.7, len(names) - 0.3)
    ax.set_xlabel("smallest size that would have shown (five standard deviations), over a usual size of the effect")
    ax.tick_params(axis="y", length=0)
    ax.grid(axis="y", visible=False)
    return fig

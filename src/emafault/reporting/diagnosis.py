"""Figures of a diagnosis, drawn from plain arrays."""

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

from . import style

BEFORE, AFTER, MEASURED, FLOOR = style.BEFORE, style.AFTER, style.INK, style.GREY
FAINT, OCTAVES = 0.7, 2.0  # of the colours of the noise: opacity, and powers of two at which they are deepest


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
        "fault_vector": "error / standard error (rms)",
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


def ladder_in_words(rungs: Mapping[str, Mapping[str, float | None] | None]) -> str:
    """What the ladder shows, for who cannot see it."""
    said = [
        f"{kind.replace('_', ' ')}: {', '.join(f'{name} {v:.3g}' for name, v in rung.items() if v is not None)}"
        for kind, rung in rungs.items()
        if rung
    ]
    return f"Misfit over the noise. {'; '.join(said)}."


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


def faults_in_words(groups: Sequence[Mapping[str, Any]]) -> str:
    """What the picture of the fault vector shows, for who cannot see it; ``groups`` as ``draw_faults`` has them."""
    said = []
    for group in groups:
        after = [f"{c} {p['value']:z.3g} ({p['low']:z.3g} to {p['high']:z.3g})" for c, p in group["after"].items()]
        text = f"{group['label'].replace(chr(10), ' ')}, after: {', '.join(after)}"
        if group["truth"]:
            holds = [
                f"{sum(group[stage][c]['low'] <= x <= group[stage][c]['high'] for c, x in known.items())} of "
                f"{len(known)} {stage}"
                for stage in ("before", "after")
                for known in [{c: x for c, x in group["truth"].items() if c in group[stage]}]
            ]
            text += f"; intervals that hold the truth: {', '.join(holds)}"
        said.append(text)
    return f"{'. '.join(said)}."


def draw_described(curves: Sequence[Mapping[str, Any]]) -> plt.Figure:
    """What an equation leaves along a described form, with it out of the model and in, with 90 % bands.

    ``curves``: x, before, after, error, x_label, y_label and title of each.
    """
    fig, axes = plt.subplots(1, len(curves), figsize=(4.8 * len(curves), 3.2), squeeze=False)
    for ax, c in zip(axes[0], curves, strict=True):
        x, error = np.array(c["x"]), 1.645 * np.array(c["error"])
        for stage, colour, label in (("before", BEFORE, "without it"), ("after", AFTER, "with it")):
            y = np.array(c[stage])
            ax.fill_between(x, y - error, y + error, color=colour, alpha=0.2, lw=0)
            ax.plot(x, y, color=colour, marker="o", ms=2.5, lw=1.2, label=label)
        ax.axhline(0.0, color=FLOOR, lw=0.8)
        ax.set_xlabel(c["x_label"])
        ax.set_ylabel(c["y_label"])
        ax.set_title(c["title"], fontsize=9)
        ax.legend(fontsize=8, frameon=False)
    return fig


def described_in_words(curves: Sequence[Mapping[str, Any]]) -> str:
    """What the picture of described forms shows, for who cannot see it; ``curves`` as ``draw_described`` has them."""
    said = []
    for c in curves:
        before, after = (float(np.sqrt(np.mean(np.square(c[stage])))) for stage in ("before", "after"))
        said.append(
            f"{c['title']}: along {c['x_label']}, {c['y_label']} is {before:.2g} without it and {after:.2g} with it, "
            f"root mean square; its standard error is {float(np.median(c['error'])):.2g}"
        )
    return f"{'. '.join(said)}."


def draw_quality(
    rows: Sequence[str], columns: Sequence[str], cells: Sequence[Sequence[Mapping[str, Any]]]
) -> plt.Figure:
    """Channels of recordings at a glance: the noise, and shares of samples that are no measurement.

    ``cells`` (row, column): ``text``, and ``relative``, the noise over that of most recordings; ``fault`` where samples
    are lost.
    """
    fig, ax = plt.subplots(figsize=(1.7 * len(columns) + 2.6, 0.44 * len(rows) + 0.9))
    octaves = np.array([[np.log2(max(c["relative"], 1e-3)) for c in row] for row in cells])
    shade = plt.get_cmap("PuOr_r")(0.5 + 0.5 * np.clip(octaves / OCTAVES, -1.0, 1.0))[..., :3]
    shade = 1.0 - FAINT * (1.0 - shade)
    ax.imshow(shade, aspect="auto")
    for k, row in enumerate(cells):
        for m, cell in enumerate(row):
            ax.text(
                m, k, cell["text"], ha="center", va="center", fontsize=8.5, color=style.ink_on(shade[k, m]),
                weight="bold" if cell["fault"] else "normal",
            )  # fmt: skip
            if cell["fault"]:
                ax.add_patch(plt.Rectangle((m - 0.47, k - 0.42), 0.94, 0.84, fill=False, edgecolor=MEASURED, lw=1.6))
    ax.set_xticks(range(len(columns)), columns)
    ax.set_yticks(range(len(rows)), rows)
    ax.xaxis.tick_top()
    ax.tick_params(length=0)
    for spine in ax.spines.values():
        spine.set_visible(False)
    ax.grid(visible=False)
    return fig


def quality_in_words(rows: Sequence[str], columns: Sequence[str], cells: Sequence[Sequence[Mapping[str, Any]]]) -> str:
    """What the picture of the recordings' quality shows, for who cannot see it; as ``draw_quality`` takes it."""
    lost, more = [], []
    for row, line in zip(rows, cells, strict=True):
        for column, cell in zip(columns, line, strict=True):
            if cell["fault"]:
                lost.append(f"{row}, {column}: {cell['text']}")
            elif not 0.5 < cell["relative"] < 2.0:
                more.append(f"{row}, {column}: {cell['text']}, {cell['relative']:.2g} times the median")
    return (
        f"No measurement: {'; '.join(lost) or 'none'}. "
        f"Noise twice the median of the recordings or more, or half of it or less: {'; '.join(more) or 'none'}."
    )

"""The page of an import: what was found and how surely, what is lost, and the recordings at a glance."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import yaml

from ..io.recording import Recording
from ..reporting.page import Page

if TYPE_CHECKING:
    from .run import Imported

SHOWN = 1500  # samples of a curve


def draw(result: "Imported", given: Mapping[str, Any]) -> Page:
    """Page of an import."""
    page = Page("Imported recordings")
    count = len(result.recordings)
    interval = 1e6 * next(iter(result.recordings.values())).interval
    page.paragraph(f"{count} recording{'s' if count > 1 else ''} at an interval of {interval:.6g} us.", "lead")
    page.heading("Found from the data")
    page.paragraph(
        "The margin is the misfit (mean square) of the next best interpretation over that of the one taken; what "
        "changed a signal is set off."
    )
    page.table(
        ("quantity", "taken", "margin", "next best"),
        [(f.what, f.taken, f"{f.margin:.3g}", f.other) for f in result.findings],
        [k for k, f in enumerate(result.findings) if f.changed],
    )
    page.heading("Taken from the map")
    reference = given["signals"]["phase_voltage"]["reference"].replace("_", " ")
    page.paragraph(f"Voltages are measured against: {reference}.")
    page.table(
        ("recording", "health", "ambient", "files"),
        [(e["name"], e["health"], str(e["ambient"]), " ".join(e["files"].values())) for e in given["recordings"]],
    )
    page.heading("What these recordings do not determine")
    for name, lost in result.lost.items():
        for text in dict.fromkeys(lost):
            page.paragraph(f"{name}: {text}.")
    for text in result.warnings:
        page.paragraph(f"{text}.")
    page.heading("Recordings")
    page.table(
        ("recording", "duration (s)", "R (ohm)", "k (V s/rad)", "voltage equation's misfit (V)"),
        [
            (name, f"{r.time[-1]:.3f}", f"{e.resistance:.3g}", f"{e.back_emf:.3g}", f"{e.misfit**0.5:.2g}")
            for (name, r), e in zip(result.recordings.items(), result.electrical.values(), strict=True)
        ],
    )
    for name, recording in result.recordings.items():
        page.figure(
            name.removesuffix(".nc"), _curves(recording), f"{name}: interval means, and the shaft with its command",
            _in_words(recording),
        )  # fmt: skip
    page.heading("Map")
    page.preformatted(yaml.safe_dump(dict(given), sort_keys=False))
    return page


def _in_words(r: Recording) -> str:
    """What the curves show, for who cannot see them."""
    volts, amps, speed = (np.abs(x).max() for x in (r.phase_voltage, r.phase_current, r.rotor_speed))
    apart = 1e3 * np.abs(r.output_position - r.commanded_position).max()
    return (
        f"Voltages up to {volts:.3g} V, currents up to {amps:.3g} A, speed up to {speed:.3g} rad/s; the shaft turns "
        f"through {1e3 * np.ptp(r.output_position):.3g} mrad and is at most {apart:.3g} mrad from its command."
    )


def _curves(recording: Recording):
    from ..reporting import style

    fig, axes = style.plt.subplots(1, 4, figsize=(13, 2.6))
    every = slice(None, None, max(1, len(recording.time) // SHOWN))
    time = recording.time[every]
    for ax, name, label in zip(axes, ("phase_voltage", "phase_current"), ("voltage (V)", "current (A)")):
        for k, colour in enumerate(style.PHASE_COLOURS):
            ax.plot(time, getattr(recording, name)[every, k], color=colour, lw=0.5, label="abc"[k])
        ax.set_ylabel(label)
    axes[0].legend(ncols=3)
    axes[2].plot(time, recording.rotor_speed[every], color=style.GREY, lw=0.8)
    axes[2].set_ylabel("speed (rad/s)")
    axes[3].plot(time, 1e3 * recording.commanded_position[every], color=style.GREY, lw=0.8, label="command")
    axes[3].plot(time, 1e3 * recording.output_position[every], lw=0.8, label="output")
    axes[3].set_ylabel("shaft (mrad)")
    axes[3].legend()
    for ax in axes:
        ax.set_xlabel("time (s)")
        ax.margins(x=0.0)
    return fig

"""One interactive chart per equation: measured and predicted signals, and residuals along a coordinate.

The charts are drawn by uPlot (vendored in ``uplot/``, MIT licence), which the page carries with it: nothing is loaded.
"""

import base64
import html
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).parent
MOST = 2400  # rows of an equation that a page shows, over all recordings
STRETCHES = 100  # of a coordinate, that residuals are averaged in
FEWEST, LEAST = 3, 1 / 400  # rows, and share of them, that each has, or it is joined with the next
STEPS = 65534  # of a quantised signal; the number beyond is a missing one
BUTTONS = (("in", "zoom in", "+"), ("out", "zoom out", "−"), ("left", "move left", "←"), ("right", "move right", "→"),
           ("reset", "show everything", "all"))  # fmt: skip


@dataclass(frozen=True)
class Curves:
    """What one recording shows of one equation.

    Parameters
    ----------
    along : coordinate in words, with its unit -> (row,); the first is shown at first
    before, after : (row,) measured less predicted, in standard deviations
    deviation : (row,) a standard deviation, in the unit of ``measured``
    measured : (row,) the measured side of the equation; None where an equation has none
    predicted : (row,) what is predicted of it before and after, where that is not ``measured`` less the residuals
    squares : r' V^-1 r of the residuals before and after, V the covariance of the noise
    aside : whether the recording was set aside for validation
    """

    recording: str
    along: Mapping[str, np.ndarray]
    before: np.ndarray
    after: np.ndarray
    deviation: np.ndarray
    measured: np.ndarray | None
    squares: tuple[float, float]
    aside: bool
    predicted: tuple[np.ndarray, np.ndarray] | None = None

    def smooth(self, stage: int) -> np.ndarray:
        """(row,) residual before (0) or after (1), of what is measured and predicted where both are smoothed."""
        if self.predicted is None or self.measured is None:
            return (self.before, self.after)[stage]
        return (self.measured - self.predicted[stage]) / self.deviation


@dataclass(frozen=True)
class Panel:
    """An equation with its curves, recording by recording.

    ``quantity`` names its measured side with the unit, ``first`` the coordinate that is shown at first, if not the
    first one.
    """

    equation: str
    quantity: str
    curves: Sequence[Curves]
    first: str = ""


def change(panel: Panel) -> float:
    """By how much the leading set makes an equation's misfit smaller."""
    before, after = _misfits(panel.curves)
    return before - after


def said(panel: Panel) -> str:
    """What a panel shows, in one sentence."""
    before, after = _misfits(panel.curves)
    name = panel.equation.replace("_", " ")
    change = "falls" if after < 0.97 * before else "rises" if after > 1.03 * before else "stays"
    to = f"from {before:.3g} to {after:.3g}" if change != "stays" else f"at {after:.3g}"
    text = f"{name[0].upper()}{name[1:]}: the residual over the noise {change} {to} (root mean square)"
    aside = [c for c in panel.curves if c.aside]
    if aside and len(aside) < len(panel.curves):
        text += f"; it is {_misfits(aside)[1]:.3g} on the validation recordings alone"
    return f"{text}."


def table(panels: Sequence[Panel]) -> list[list[str]]:
    """Equation, number of rows and residual before and after, as texts."""
    out = []
    for panel in panels:
        size = sum(len(c.before) for c in panel.curves)
        out.append([panel.equation.replace("_", " "), f"{size}", *(f"{m:.3g}" for m in _misfits(panel.curves))])
    return out


def markup(panel: Panel, name: str) -> str:
    """A panel's controls, place for its charts and data; ``name`` is its id in the page."""
    sizes = [len(c.before) for c in panel.curves]
    share = min(1.0, MOST / max(sum(sizes), 1))
    places = list(panel.curves[0].along)
    data = {
        "quantity": panel.quantity, "along": places, "lines": [p.startswith("time") for p in places],
        "recordings": [_packed(c, share) for c in panel.curves],
        "means": [_means(panel.curves, p) for p in places],
    }  # fmt: skip
    worst = int(np.argmax([_misfits([c])[0] for c in panel.curves])) if panel.first in ("", places[0]) else None
    names = [html.escape(c.recording.removesuffix(".nc") + (" (validation)" if c.aside else "")) for c in panel.curves]
    options = "".join(f'<option value="{k}"{" selected" * (k == worst)}>{n}</option>' for k, n in enumerate(names))
    along = "".join(
        f'<option value="{k}"{" selected" * (p == panel.first)}>{html.escape(p)}</option>' for k, p in enumerate(places)
    )
    buttons = "".join(
        f'<button type="button" value="{value}" title="{title}" aria-label="{title}">{sign}</button>'
        for value, title, sign in BUTTONS
    )
    packed = json.dumps(data, separators=(",", ":")).replace("<", "\\u003c")
    text = html.escape(said(panel))
    shown = "" if share == 1.0 else f" {round(share * sum(sizes))} of {sum(sizes)} rows are shown, spread evenly."
    return (
        f'<figure class="panel" id="{html.escape(name)}"><figcaption><strong>{text}</strong>{shown}</figcaption>'
        f'<div class="controls" hidden><label>recording <select><option value="">all recordings</option>{options}'
        f"</select></label> <label>along <select>{along}</select></label> <span>{buttons}</span></div>"
        f'<div class="charts" tabindex="0" role="group" aria-label="{text} Keys: plus, minus, arrows, 0."></div>'
        f'<script type="application/json">{packed}</script>'
        "</figure>"
    )


def styles() -> str:
    """Style sheet of the charts."""
    return (HERE / "uplot" / "uPlot.min.css").read_text()


def scripts() -> str:
    """The library with its licence, and what draws the charts."""
    licence = (HERE / "uplot" / "LICENSE").read_text()
    library = (HERE / "uplot" / "uPlot.iife.min.js").read_text().split("*/", 1)[1]
    return "".join(f"<script>{text}</script>" for text in (f"/*! uPlot\n{licence}*/{library}", _own()))


def _own() -> str:
    return (HERE / "panels.js").read_text()


def _misfits(curves: Sequence[Curves]) -> tuple[float, float]:
    """Root mean square of the residual over the noise, before and after."""
    size = max(sum(len(c.before) for c in curves), 1)
    before, after = (float(np.sqrt(sum(c.squares[k] for c in curves) / size)) for k in (0, 1))
    return before, after


def _means(curves: Sequence[Curves], place: str) -> dict[str, Any]:
    """Means of all rows' residuals in stretches of a coordinate, which show what the noise of single rows hides."""
    x = np.concatenate([c.along[place] for c in curves])
    low, high = (np.min(x), np.max(x)) if len(x) else (0.0, 0.0)
    at = np.minimum((STRETCHES * (x - low) / max(high - low, 1e-300)).astype(int), STRETCHES - 1)
    at = _joined(np.bincount(at, minlength=STRETCHES), max(FEWEST, len(x) * LEAST))[at]
    count = np.bincount(at)
    before, after = (np.concatenate([c.smooth(k) for c in curves]) for k in (0, 1))
    columns = {"x": x, "before": before, "after": after}
    return {k: _quantised(np.bincount(at, v)[count > 0] / count[count > 0]) for k, v in columns.items()}


def _joined(count: np.ndarray, least: float) -> np.ndarray:
    """(stretch,) number of the group that each belongs to, neighbours joined until a group has enough rows."""
    out, group, rows = np.zeros(len(count), int), 0, 0
    for k, more in enumerate(count):
        if rows >= least:
            group, rows = group + 1, 0
        out[k], rows = group, rows + more
    return out


def _packed(curves: Curves, share: float) -> dict[str, Any]:
    rows = _spread(len(curves.before), share)
    sd = curves.deviation[rows]
    return {
        "name": curves.recording, "along": [_quantised(x[rows]) for x in curves.along.values()],
        "measured": None if curves.measured is None else _quantised(curves.measured[rows]),
        "before": _quantised(curves.before[rows]), "after": _quantised(curves.after[rows]),
        "smooth_before": None if curves.predicted is None else _quantised(curves.predicted[0][rows]),
        "smooth_after": None if curves.predicted is None else _quantised(curves.predicted[1][rows]),
        "deviation": float(f"{sd[0]:.5g}") if len(sd) and np.ptp(sd) <= 1e-6 * sd[0] else _quantised(sd),
    }  # fmt: skip


def _spread(size: int, share: float) -> np.ndarray:
    """Rows that are shown: one of each of as many stretches, at a random place of it, so that no rate beats with it."""
    if share >= 1.0:
        return np.arange(size)
    edges = np.linspace(0, size, max(2, round(share * size)) + 1)
    places = np.random.default_rng(0).random(len(edges) - 1)
    return np.minimum((edges[:-1] + places * np.diff(edges)).astype(int), size - 1)


def _quantised(x: np.ndarray) -> dict[str, Any]:
    """Numbers as 16 bits each, base 64."""
    known = np.isfinite(x)
    low, high = (float(f(x[known])) for f in (np.min, np.max)) if known.any() else (0.0, 0.0)
    step = (high - low) / STEPS or 1.0
    whole = np.where(known, np.round((np.where(known, x, low) - low) / step), STEPS + 1).astype("<u2")
    return {
        "low": float(f"{low:.7g}"),
        "step": float(f"{step:.7g}"),
        "data": base64.b64encode(whole.tobytes()).decode(),
    }


def numbered(panels: Sequence[Panel], key: str) -> Iterator[tuple[str, Panel]]:
    """Panels with their ids; ``key`` begins them."""
    for panel in panels:
        yield f"{key}panel_{panel.equation}", panel

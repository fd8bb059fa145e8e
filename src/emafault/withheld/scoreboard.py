"""The scoreboard page: table of metrics, confusion matrix, reliability, power and closure, from the scores alone."""

import base64
import html
import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from ..io.atomic import replace_atomically, write_text

GREY, BLUE, RED = "#9aa3ad", "#2b6cb0", "#c0392b"
STYLE = """
body{font:15px/1.5 system-ui,sans-serif;max-width:1080px;margin:2em auto;padding:0 1em;color:#1d2733}
table{border-collapse:collapse;width:100%;margin:1em 0}
td,th{padding:.3em .6em;border-bottom:1px solid #dfe4ea;text-align:left}
td.n{text-align:right;font-variant-numeric:tabular-nums}
.aim{color:#1e7d4f;font-weight:600}.good{color:#2b6cb0;font-weight:600}
.short{color:#c0392b;font-weight:600}.quiet{color:#6b7683}img{max-width:100%}h2{margin-top:2em}
"""


def write_scoreboard(scores: Mapping, folder: str | Path) -> Path:
    """Write ``scores.json``, the figures and ``scoreboard.html`` into a folder and return the page's path.

    Raises
    ------
    InputError : the folder cannot be written
    """
    folder = Path(folder)
    figures = {
        "confusion": confusion_figure(scores["confusion"]),
        "reliability": reliability_figure(scores["reliability"]),
        "power": power_figure(scores["power"]),
        "closure": closure_figure(scores["rows"]),
    }
    pictures = {}
    for name, figure in figures.items():
        buffer = io.BytesIO()
        figure.savefig(buffer, format="png", dpi=110, bbox_inches="tight")
        plt.close(figure)
        png = buffer.getvalue()
        pictures[name] = base64.b64encode(png).decode()
        replace_atomically(folder / f"{name}.png", lambda path, data=png: path.write_bytes(data))
    write_text(folder / "scores.json", json.dumps(scores, indent=1))
    page = folder / "scoreboard.html"
    write_text(page, _page(scores, pictures))
    return page


def confusion_figure(confusion: Mapping) -> Figure:
    """What detectable single effects were called, as shares of each true effect."""
    counts = np.array(confusion["counts"], float)
    shares = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1.0)
    figure, axes = plt.subplots(figsize=(11, 9))
    axes.imshow(shares, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
    axes.set_xticks(range(len(confusion["said"])), confusion["said"], rotation=90, fontsize=7)
    axes.set_yticks(range(len(confusion["truth"])), confusion["truth"], fontsize=7)
    for y, x in zip(*np.nonzero(counts)):
        ink = "w" if shares[y, x] > 0.5 else "k"
        axes.text(x, y, f"{counts[y, x]:.0f}", ha="center", va="center", fontsize=6, color=ink)
    axes.set_xlabel("named")
    axes.set_ylabel("truth")
    return figure


def reliability_figure(bins: list) -> Figure:
    """Share right against the probability given."""
    figure, axes = plt.subplots(figsize=(5, 4.4))
    axes.plot([0, 1], [0, 1], color=GREY, lw=1)
    if bins:
        x, y = [b["confidence"] for b in bins], [b["accuracy"] for b in bins]
        axes.scatter(x, y, s=[15 + 3 * np.sqrt(b["count"]) for b in bins], color=BLUE, zorder=3)
        for b in bins:
            place = (b["confidence"], b["accuracy"])
            axes.annotate(str(b["count"]), place, xytext=(5, -9), textcoords="offset points", fontsize=7)
    axes.set(xlabel="probability of the first hypothesis", ylabel="share right", xlim=(0, 1.02), ylim=(-0.02, 1.05))
    return figure


def power_figure(bins: list) -> Figure:
    """Share right and wrongly named against the distance to the nominal model."""
    figure, axes = plt.subplots(figsize=(6.5, 4.2))
    x = range(len(bins))
    axes.plot(x, [b["right"] for b in bins], "o-", color=BLUE, label="right")
    axes.plot(x, [b["wrong_name"] for b in bins], "s-", color=RED, label="a wrong name")
    labels = [f"{b['low']:.0f}+\n({b['cases']})" for b in bins]
    axes.set_xticks(list(x), labels, fontsize=7)
    axes.set(xlabel="squared distance to the nominal model (cases)", ylabel="share of cases", ylim=(-0.03, 1.05))
    axes.legend(frameon=False)
    return figure


def closure_figure(rows: list) -> Figure:
    """Whitened residual on held-out recordings before and after, beside the placebo."""
    figure, axes = plt.subplots(figsize=(5.6, 4.6))
    ladders = [r["signal"] for r in rows if r["signal"] and r["detectable"]]
    if ladders:
        before = np.sqrt([x["recalibrated"] for x in ladders])
        axes.scatter(before, np.sqrt([x["placebo"] for x in ladders]), s=9, color=GREY, label="placebo")
        axes.scatter(before, np.sqrt([x["after"] for x in ladders]), s=9, color=BLUE, label="named set")
        axes.plot([before.min(), before.max()], [before.min(), before.max()], color=GREY, lw=1)
        axes.axhline(np.sqrt(np.median([x["floor"] for x in ladders])), color="k", lw=0.8, ls=":")
        axes.set(xscale="log", yscale="log")
        axes.legend(frameon=False)
    axes.set(xlabel="recalibrated nominal, residual (sigma)", ylabel="residual after (sigma)")
    return figure


def _figure(bound) -> str:
    if bound is None:
        return ""
    return f"{bound[0]:g} to {bound[1]:g}" if isinstance(bound, tuple | list) else f"{bound:g}"


def _row(metric: Mapping) -> str:
    if metric["value"] is None:
        value, interval, cls = "no case", "", "quiet"
    else:
        value, interval = f"{metric['value']:.3f}", f"{metric['low']:.3f} to {metric['high']:.3f}"
        cls = "aim" if metric["aim_met"] else "good" if metric["good_met"] else "short"
        cls = "" if metric["good"] is None else cls
    cells = [f"<td>{html.escape(metric['title'])}</td>", f'<td class="n {cls}">{value}</td>']
    rest = (interval, metric["cases"], _figure(metric["good"]), _figure(metric["aim"]))
    cells += [f'<td class="n">{x}</td>' for x in rest]
    return f"<tr>{''.join(cells)}</tr>"


def _counts(line: Mapping) -> str:
    out = []
    for rung in ("T1", "T3", "T4"):
        n = line[rung]
        out.append(f'<td class="n">{n["right"]} of {n["detectable"]} <span class="quiet">({n["cases"]})</span></td>')
    return "".join(out)


def _confusion(h: Mapping) -> str:
    apart = "" if h["apart"] is None else f"{h['apart']:.0f}"
    numbers = "".join(f'<td class="n">{x}</td>' for x in (h["cases"], f"{h['distance']:.0f}", apart))
    return f"<tr><td>{h['truth']}</td><td>{h['said']}</td>{numbers}</tr>"


def _part(value: float | None) -> str:
    return "" if value is None else f"{value:.2f}"


def _unlisted(lines: Sequence[Mapping]) -> str:
    """What was put in that no catalogue lists, thing by thing."""
    if not lines:
        return ""
    rows = "".join(
        f"<tr><td>{u['unlisted'].replace('_', ' ')}{'' if u['inside'] else ' (outside)'}</td>"
        + "".join(
            f'<td class="n">{x}</td>' for x in (u["cases"], u["mixed"], *map(_part, _shares(u)), ", ".join(u["beside"]))
        )
        + "</tr>"
        for u in lines
    )
    return f"""<h2>Beside what no catalogue lists (T7, T8)</h2><table><tr><th>unlisted</th><th>cases</th>
<th>beside a detectable effect</th>
<th>all listed named</th><th>another named</th><th>its equation</th><th>its form</th><th>oftenest beside</th></tr>
{rows}</table>"""


def _shares(u: Mapping) -> tuple[float | None, ...]:
    return u["named"], u["another"], u["equation"], u["form"]


def _rivals(lines: Sequence[Mapping]) -> str:
    """Right and wrong names by the distance to the nearest rival."""
    if not lines:
        return ""
    rows = "".join(
        f"<tr><td>{u['low']:.0f}{'' if u['high'] is None else ' to {:.0f}'.format(u['high'])}</td>"
        + "".join(f'<td class="n">{x}</td>' for x in (u["cases"], _part(u["right"]), _part(u["wrong_name"])))
        + "</tr>"
        for u in lines
    )
    return f"""<h2>Nearest rival, to first order (T1, T4, on a part of the cases)</h2><table>
<tr><th>squared distance to it</th><th>cases</th><th>right</th><th>a wrong name</th></tr>{rows}</table>"""


def _measured(rows: Sequence[Mapping]) -> str:
    """The rung on measured data: changes put in by hand, and apart from these the effects left out."""
    out = "<h2>T6: known changes of measured recordings</h2>" if rows else ""
    for title, left_out in (
        ("Put in by hand, so that the cause is known", False),
        ("The strongest effect left out: what counts as true is what the diagnosis itself named before", True),
    ):
        mine = [r for r in rows if (r["kind"] == "left out") == left_out]
        lines = "".join(
            f"<tr><td>{html.escape(r['twin'])} {html.escape(r['case'])}</td><td>{html.escape(r['what'])}</td>"
            f"<td>{r['verdict']}: {html.escape(', '.join(r['named']) or '-')}</td>"
            f"<td class='{'good' if r['right'] else 'short'}'>{'right' if r['right'] else 'wrong'}</td></tr>"
            for r in mine
        )
        if mine:
            right, literal = sum(bool(r["right"]) for r in mine), sum(r["verdict"] == "unknown" for r in mine)
            out += f"""<h3>{title}</h3><p>{right} of {len(mine)} right; {literal} with the word unknown itself. What the
library lacks is right, too, where a remainder or the confirming recordings refuse it in the right
equation.</p><table><tr><th>machine</th><th>change</th><th>verdict</th><th></th></tr>{lines}</table>"""
    return out


def _page(scores: Mapping, pictures: Mapping[str, str]) -> str:
    head = "<tr><th>metric</th><th>measured</th><th>90 % interval</th><th>cases</th><th>good</th><th>aim</th></tr>"
    table = "".join(_row(m) for m in scores["metrics"] if m["good"] is not None)
    beside = "".join(_row(m) for m in scores["metrics"] if m["good"] is None)
    effects = "".join(f"<tr><td>{line['effect']}</td>{_counts(line)}</tr>" for line in scores["by_effect"])
    hard = "".join(_confusion(h) for h in scores["hardest"])
    missing = scores.get("missing") or []
    note = f"<p class='short'>{len(missing)} cases have no verdict and are not counted.</p>" if missing else ""
    image = {name: f'<img alt="{name}" src="data:image/png;base64,{data}">' for name, data in pictures.items()}
    return f"""<!doctype html><html lang="en"><head><meta charset="utf-8"><title>The withheld check</title>
<style>{STYLE}</style></head><body><h1>The withheld check</h1>
<p>{len(scores["rows"])} blind cases. Unless a line says otherwise it counts detectable cases: squared distance to the
nominal model, nuisances marginalised, of 25 or more. <span class="aim">Aim met</span>,
<span class="good">good result</span>, <span class="short">short of it</span>.</p>{note}
<table>{head}{table}</table><h2>Beside the table</h2><table>{head}{beside}</table>
<h2>What single effects were called (T1)</h2>{image["confusion"]}
<h2>Hardest confusions</h2><table><tr><th>truth</th><th>said</th><th>cases</th><th>distance to nominal</th>
<th>distance to what was said</th></tr>{hard}</table>
<h2>Power</h2>{image["power"]}<h2>Reliability</h2>{image["reliability"]}
<h2>Closure on held-out recordings</h2>{image["closure"]}
<h2>Effect by effect</h2><table>
<tr><th>effect</th><th>T1 right</th><th>T3 unknown or described</th><th>T4 right</th></tr>{effects}</table>
{_unlisted(scores.get("by_unlisted") or [])}
{_rivals(scores.get("rivals") or [])}
{_measured(scores.get("measured") or [])}
</body></html>
"""

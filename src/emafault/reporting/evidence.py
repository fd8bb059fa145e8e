"""Pictures of the check of the evidence: ranks, coverage, reliability of inclusion probabilities."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

from .page import Page
from .style import AFTER, GREY

BAND = "#e6eef2"
KINDS = {
    "library": "Effects in the library's form",
    "own_forms": "Some effects in a form of their own",
}
ARMS = {"searched": "as the diagnosis has it", "summed": "summed over widths", "completed": "and over more sets"}


def draw_ranks(found: Mapping[str, Any]) -> plt.Figure:
    """Histograms of ranks with their 99 % band; a row of panels by way of computing the posterior."""
    drawing, axes = plt.subplots(len(ARMS), 2, figsize=(9.0, 7.0), sharex=True, squeeze=False)
    for row, (arm, words) in zip(axes, ARMS.items(), strict=True):
        for axis, quantity in zip(row, ("nuisance", "effect"), strict=True):
            ranks = found[arm][quantity]
            place = (np.arange(len(ranks["counts"])) + 0.5) / len(ranks["counts"])
            axis.axhspan(ranks["low"], ranks["high"], color=BAND)
            axis.bar(place, ranks["counts"], width=0.9 / len(place), color=AFTER)
            p = "-" if ranks["p"] is None else f"{ranks['p']:.2g}"
            title = "a nuisance, all sets" if quantity == "nuisance" else "a parameter of the true set"
            axis.set_title(f"{title}, {words}\n{ranks['count']} ranks, p = {p}", fontsize=9)
        row[0].set_ylabel("draws")
    for axis in axes[-1]:
        axis.set_xlabel("rank of the truth among posterior samples")
    return drawing


def draw_coverage(found: Mapping[str, Any]) -> plt.Figure:
    """Expected coverage about random points (TARP) less credibility, with the 99 % band."""
    drawing, axes = plt.subplots(1, len(ARMS), figsize=(11.0, 3.6), sharey=True)
    for axis, (arm, words) in zip(axes, ARMS.items(), strict=True):
        c = {k: np.array(v) for k, v in found[arm]["coverage"].items()}
        axis.fill_between(c["credibility"], c["low"], c["high"], color=BAND, step=None)
        axis.plot([0, 1], [0, 1], color=GREY, linewidth=0.8)
        axis.plot(c["credibility"], c["coverage"], color=AFTER)
        axis.set_title(f"{words}, p = {float(c['p']):.2g}", fontsize=9)
        axis.set_xlabel("credibility")
    axes[0].set_ylabel("expected coverage")
    return drawing


def draw_reliability(found: Mapping[str, Any]) -> plt.Figure:
    """Share truly on by inclusion probability, with the 99 % band about the probability; both on a logit scale."""
    drawing, axes = plt.subplots(1, len(ARMS), figsize=(11.0, 4.0), sharey=True)
    for axis, (arm, words) in zip(axes, ARMS.items(), strict=True):
        bins = found[arm]["inclusion"]["bins"]
        mean, share, band = (np.array([b[k] for b in bins]) for k in ("mean", "share", "band"))
        axis.set_xscale("logit")
        axis.set_yscale("logit")
        line = np.array([2e-4, 1.0 - 2e-4])
        axis.plot(line, line, color=GREY, linewidth=0.8)
        middle, low, high = (np.clip(x, *line) for x in (mean, mean - band, mean + band))
        axis.vlines(middle, low, high, color=BAND, linewidth=9)
        axis.plot(middle, np.clip(share, *line), "o", color=AFTER)
        axis.set_title(words, fontsize=9)
        axis.set_xlabel("inclusion probability")
        for way in (axis.xaxis, axis.yaxis):
            way.set_major_locator(plt.FixedLocator([0.001, 0.01, 0.1, 0.5, 0.9, 0.99, 0.999]))
            way.set_major_formatter(plt.FuncFormatter(lambda x, _: f"{x:g}"))
            way.set_minor_locator(plt.NullLocator())
    axes[0].set_ylabel("share truly on")
    return drawing


def draw_page(scores: Mapping[str, Any], report: Path, figures: Path) -> None:
    """The page: a table of scores, then the pictures of each kind of draw."""
    page = Page("The evidence checked by draws from its own priors", figures)
    page.paragraph(
        "Parameters are drawn from the priors of the model, data from its linear model. If the posterior is right, the "
        "ranks of the truth are uniform, credible regions hold it as often as they say, and of the effects with an "
        "inclusion probability p a share p is on. Bands hold 99 %."
    )
    page.table(HEADER, [_line(scores[k][a], f"{w}, {ARMS[a]}") for k, w in KINDS.items() for a in ARMS])
    for kind, words in KINDS.items():
        found = scores[kind]
        page.heading(words)
        told = found["told_90"]
        share = "-" if told["share"] is None else f"{told['share']:.3f}"
        page.paragraph(
            f"{found['draws']} draws. The search looked at the true set in {found['seen']:.1%} and missed one that "
            f"beats all it saw in {found['missed']:.1%}. Told 90 % intervals of the true set's effects hold {share} of "
            f"{told['count']} parameters."
        )
        page.figure(
            f"{kind}_ranks", draw_ranks(found), "Simulation-based calibration: ranks of the truth.",
            _in_words(found, _ranks_in_words),
        )  # fmt: skip
        page.figure(
            f"{kind}_coverage", draw_coverage(found), "Expected coverage about random points (TARP).",
            _in_words(found, _coverage_in_words),
        )  # fmt: skip
        page.figure(
            f"{kind}_reliability", draw_reliability(found), "Inclusion probabilities against what is on.",
            _in_words(found, _reliability_in_words),
        )  # fmt: skip
    page.write(report)


def _in_words(found: Mapping[str, Any], of: Callable[[Mapping[str, Any]], str]) -> str:
    """What a picture shows, for who cannot see it, one way of computing the posterior after the other."""
    return f"{'; '.join(f'{words}: {of(found[arm])}' for arm, words in ARMS.items())}."


def _ranks_in_words(arm: Mapping[str, Any]) -> str:
    said = []
    for quantity in ("nuisance", "effect"):
        r = arm[quantity]
        outside = sum(not r["low"] <= count <= r["high"] for count in r["counts"])
        said.append(f"{outside} of {len(r['counts'])} bins of the {quantity}'s ranks outside the band")
    return ", ".join(said)


def _coverage_in_words(arm: Mapping[str, Any]) -> str:
    c = {k: np.array(v) for k, v in arm["coverage"].items()}
    off = np.abs(c["coverage"] - c["credibility"])
    within = (c["low"] <= c["coverage"]) & (c["coverage"] <= c["high"])
    return f"coverage at most {off.max():.2g} from the credibility, in the band at {within.mean():.0%} of the points"


def _reliability_in_words(arm: Mapping[str, Any]) -> str:
    points = [f"{b['share']:.2g} on of those at {b['mean']:.2g}" for b in arm["inclusion"]["bins"]]
    return ", ".join(points)


HEADER = (
    "draws, posterior", "ranks of nuisances: p", "ranks of effects: p", "coverage: p", "listed: on (expected), z",
    "forms: on (expected), z", "remainders: on (expected), z", "named: share right (mean probability)", "Brier score",
    "log score",
)  # fmt: skip


def _line(found: Mapping[str, Any], words: str) -> list[str]:
    i = found["inclusion"]
    n = i["named"]
    return [
        words, *("-" if found[q]["p"] is None else f"{found[q]['p']:.2g}" for q in ("nuisance", "effect", "coverage")),
        *(f"{i['on'][k]:.0f} ({i['expected'][k]:.1f}), {i['z'][k]:+.1f}" for k in ("listed", "form", "remainder")),
        f"{n['share']:.3f} ({n['mean']:.3f})" if n["count"] else "-", f"{i['brier']:.4f}", f"{i['log_score']:.4f}",
    ]  # fmt: skip

"""Every fitted number of a diagnosis, and which of them trade off, as a page shows them."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .page import Page

Z = 1.645  # standard deviations of a 90 % interval
TOLD = 0.7  # of the prior's width, above which recordings are said to tell little of a number
TRADES = 0.5  # posterior correlation from which two numbers are said to trade off
MOST = 12  # pairs that are shown


@dataclass(frozen=True)
class Number:
    """A fitted number: value before the fit and after, standard deviation of prior and posterior, and what it is.

    ``name`` is its key, ``words`` what a page calls it (the key, where there are none); ``kind``: effect, unit,
    controller or recording; ``units``: "1" where it has no dimension.
    """

    name: str
    kind: str
    start: float
    value: float
    sd: float
    prior: float
    units: str
    words: str = ""

    @property
    def said(self) -> str:
        """What a page calls it."""
        return self.words or self.name


@dataclass(frozen=True)
class Numbers:
    """Fitted numbers with their posterior correlation (number, number)."""

    numbers: Sequence[Number]
    correlation: np.ndarray


KINDS = {
    "effect": "leading effect",
    "unit": "the unit",
    "controller": "controller",
    "recording": "one recording",
}


def as_told(found: Numbers, verdict: Mapping[str, Any], effects: Collection[str]) -> Numbers:
    """The same numbers, with values and intervals of the verdict for those that it tells.

    ``effects``: those of the set that the numbers are of.
    """
    of_set: Mapping[str, Any] = next((e for e in verdict["which"] if set(e["effects"]) == set(effects)), {})
    told = {
        f"{p['effect'].replace('_', ' ')}: {n.rpartition('.')[2]}": p for n, p in of_set.get("parameters", {}).items()
    }
    told |= {f"controller: {n}": p for n, p in verdict["controller"].items()}
    numbers = [
        replace(n, value=told[n.name]["value"], sd=(told[n.name]["high"] - told[n.name]["low"]) / (2.0 * Z))
        if n.name in told
        else n
        for n in found.numbers
    ]
    return replace(found, numbers=numbers)


def add_numbers(page: Page, found: Numbers, level: int = 2) -> None:
    """The table of every fitted number, those of single recordings folded, and what trades off."""
    page.heading("Every fitted number", level)
    page.paragraph(
        "Start is where the fit began: the nominal value, or the datasheet's. An interval holds the true value with a "
        "probability of 90 %, within the model. Where these recordings determine a number little, its interval is "
        f"wider than {100 * TOLD:.0f} % of what was known before, and it stays near its start."
    )
    header = ["number", "belongs to", "start", "fitted", "90 % interval", "unit", "determined by these recordings"]
    own = [n for n in found.numbers if n.kind == "recording"]
    page.table(header, [_row(n) for n in found.numbers if n.kind != "recording"])
    if own:
        with page.folded(f"{len(own)} numbers of single recordings (temperatures, clock offsets, zeros)"):
            page.table(header, [_row(n) for n in own])
    page.heading("What trades off", level)
    pairs = trading(found)
    if not pairs:
        page.paragraph(f"No two fitted numbers have a posterior correlation beyond {TRADES:g}.")
        return
    page.paragraph(
        "Two numbers trade off where these recordings know a combination of them better than each: with a correlation "
        "near +1 both can be larger together at almost the same fit, near -1 one larger and the other smaller."
    )
    page.table(["pair", "posterior correlation", "which means"], [_pair(*p) for p in pairs])


def trading(found: Numbers) -> list[tuple[Number, Number, float]]:
    """Pairs of effects' and the unit's numbers, or of one with the controller's, by the size of their correlation."""
    shown = [k for k, n in enumerate(found.numbers) if n.kind != "recording"]
    pairs = [
        (i, k, float(found.correlation[i, k]))
        for a, i in enumerate(shown)
        for k in shown[a + 1 :]
        if {found.numbers[i].kind, found.numbers[k].kind} != {"controller"}
    ]
    large = sorted((p for p in pairs if abs(p[2]) >= TRADES), key=lambda p: -abs(p[2]))
    return [(found.numbers[i], found.numbers[k], r) for i, k, r in large[:MOST]]


def _row(n: Number) -> list[str]:
    told = "yes" if n.sd < TOLD * n.prior else "little"
    interval = f"{n.value - Z * n.sd:z.4g} to {n.value + Z * n.sd:z.4g}"
    return [n.said, KINDS[n.kind], f"{n.start:z.4g}", f"{n.value:z.4g}", interval, n.units or "1", told]


def _pair(a: Number, b: Number, r: float) -> list[str]:
    way = "larger" if r > 0.0 else "smaller"
    left = float(np.sqrt(max(1.0 - r * r, 0.0)))
    known = f"were one known, the other would be {100 * left:.0f} % as uncertain"
    means = f"a larger value of the first goes with a {way} one of the second; {known}"
    return [f"{a.said} and {b.said}", f"{r:z.3f}", means]

"""Histories: the benches of one unit in the order of recording, and what changed from each to the next."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any

from ..effects import EFFECTS
from .fleet import COMPONENTS, NAMED

Row = Mapping[str, Any]
TOLD = 0.9  # probability from which a change is told
CHANGE = 0.05  # of a component, as large as one that changes is expected to


@dataclass(frozen=True)
class Change:
    """What differs between a bench and the one before it, with the probability that it does."""

    what: str  # an effect or a component of the fault vector
    kind: str  # "appeared", "gone", "rose" or "fell"
    probability: float
    before: float | None = None
    after: float | None = None

    def sentence(self) -> str:
        """In words."""
        sizes = "" if self.after is None else f" from {self.before:.4f} to {self.after:.4f}"
        return f"{self.what} {self.kind}{sizes} ({self.probability:.2f})"


def histories(rows: Sequence[Row]) -> dict[str, list[Row]]:
    """Benches that could be diagnosed by unit, each in the order of ``recorded``, else of the benches' names."""
    units: dict[str, list[Row]] = defaultdict(list)
    for row in sorted(rows, key=lambda r: (r["recorded"], r["bench"])):
        if row["verdict"] != "refused":
            units[row["unit"]].append(row)
    return dict(units)


def changes(before: Row, after: Row, least: float = TOLD) -> list[Change]:
    """What changed, the most probable first.

    Both posteriors are taken for independent. An effect appeared with p_after (1 - p_before); of a component of the
    fault vector see ``changed``.
    """
    found = []
    for effect in EFFECTS:
        p, q = before[f"p_{effect}"], after[f"p_{effect}"]
        found += [Change(effect, "appeared", q * (1.0 - p)), Change(effect, "gone", p * (1.0 - q))]
    for name in COMPONENTS:
        values = [row[key] for row in (before, after) for key in (name, f"{name}_sd")]
        if None not in values:
            first, sd_first, second, sd_second = values
            sd = max((sd_first**2 + sd_second**2) ** 0.5, 1e-12)
            kind = "rose" if second > first else "fell"
            found.append(Change(name, kind, changed(second - first, sd), first, second))
    return sorted((c for c in found if c.probability >= least), key=lambda c: -c.probability)


def changed(difference: float, sd: float) -> float:
    """Probability that a component of the fault vector is another one, even odds and N(0, ``CHANGE``^2) beforehand.

    Parameters
    ----------
    difference : of two estimates (1)
    sd : its standard deviation
    """
    one, other = NormalDist(0.0, sd).pdf(difference), NormalDist(0.0, (sd**2 + CHANGE**2) ** 0.5).pdf(difference)
    return other / (one + other) if one + other > 0.0 else 1.0


def since(history: Sequence[Row], effect: str) -> Row | None:
    """The first bench from which on every one names an effect; None where the last does not."""
    first = None
    for row in reversed(history):
        if row[f"p_{effect}"] < NAMED:
            break
        first = row
    return first


def ranked(units: Mapping[str, Sequence[Row]]) -> list[str]:
    """Units by what their last bench shows: more effects named first, then the larger gap to the nominal simulator."""
    return sorted(units, key=lambda u: (-len(units[u][-1]["named"]), -(units[u][-1]["gap"] or 0.0), u))

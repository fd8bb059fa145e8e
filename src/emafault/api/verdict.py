"""What the verdicts of the actuator and of measured machines have in common, as tables and plots."""

import html
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from .pictures import alone, as_html
from .table import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Told:
    """A verdict in the format of ``diagnosis.json``."""

    def __init__(self, told: Mapping[str, Any]) -> None:
        self._told = told

    @property
    def kind(self) -> str:
        """``explained``, ``group``, ``described``, ``partly``, ``unknown`` or ``no_gap``."""
        return str(self._told["verdict"])

    @property
    def effects(self) -> tuple[str, ...]:
        """The effects that are named; those of one group where these recordings cannot tell them apart."""
        first = [e for e in self._told["which"][0]["effects"] if e != "unknown"]
        groups = [e for group in self._told["groups"] for e in group]
        return tuple(dict.fromkeys([*first, *groups])) if self.kind in ("explained", "group", "partly") else ()

    def probabilities(self) -> Table:
        """A row a set of effects: posterior probability; they are exclusive and sum to one."""
        rows = [[" + ".join(entry["effects"]) or "no effect", entry["probability"]] for entry in self._told["which"]]
        return Table(["effects", "probability"], rows)

    def parameters(self) -> Table:
        """A row a fitted number of what was named and described: value, ends of the 90 % interval and unit."""
        fitted = self._told["which"][0].get("parameters") or {}
        rows = [_row(p["effect"], name, p) for name, p in fitted.items()] + [
            _row(f"{d['form']} in {d['equation']}", name, p)
            for d in self._told["discovered"]
            for name, p in d["parameters"].items()
        ]
        return Table(["cause", "parameter", "value", "low", "high", "unit"], rows)

    def residuals(self) -> Table:
        """A row an equation: the operating region that most of its residual lies in, its size and share."""
        columns = ["equation", "along", "from", "to", "z", "share"]
        return Table(columns, [[entry[c] for c in columns] for entry in self._told["where"]])

    def gap(self) -> Table:
        """A row a kind of misfit on the recordings set aside, in multiples of its noise; empty where none was."""
        columns = ["nominal", "recalibrated", "placebo", "after", "floor", "closed"]
        rungs = {kind: rung for kind, rung in self._told["shrinks"].items() if rung}
        return Table(["misfit of", *columns], [[kind, *(rung.get(c) for c in columns)] for kind, rung in rungs.items()])

    def plot_probabilities(self) -> "Figure":
        """Posterior probability and gain in log evidence of every set of effects."""
        from ..equations.page import ranked
        from ..reporting.diagnosis import draw_ranking

        return alone(draw_ranking(ranked(self._told)))

    def plot_gap(self) -> "Figure":
        """How far the misfit shrinks on the recordings set aside."""
        from ..reporting.diagnosis import draw_ladder

        return alone(draw_ladder(self._told["shrinks"]))


def as_page(head: str, sentences: list[str], told: Told) -> str:
    """What a notebook shows of a verdict."""
    said = "".join(f"<li>{html.escape(sentence)}</li>" for sentence in sentences)
    title = f"<p><b>{html.escape(head)}: {told.kind.replace('_', ' ')}</b></p>"
    picture = as_html(told.plot_probabilities(), f"Posterior probabilities\n{told.probabilities()}")
    return f"{title}<ul>{said}</ul>{told.parameters()._repr_html_()}{picture}"


def _row(cause: str, name: str, p: Mapping[str, Any]) -> list[Any]:
    return [cause, name, p["value"], p["low"], p["high"], p.get("units", "1")]

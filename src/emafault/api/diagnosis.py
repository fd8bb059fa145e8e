"""Diagnosis of a bench: where a simulator and recordings disagree, which effect causes it, how far it explains it."""

import html
import json
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..equations import run
from ..equations.diagnose import Diagnosed
from ..equations.page import finding
from ..io.bench import Bench, check_bench
from ..io.recording import Recording
from ..reporting.written import REPORT, checked, refuse_foreign
from .actuator import Actuator
from .pictures import alone, as_html
from .recordings import recordings_of
from .table import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Diagnosis:
    """A verdict on a bench, with tables, plots and the page that ``emafault diagnose`` writes."""

    def __init__(self, found: Diagnosed, bench: Bench) -> None:
        self._found, self._bench = found, bench

    @property
    def kind(self) -> str:
        """``explained``, ``group``, ``described``, ``partly``, ``unknown`` or ``no_gap``."""
        return str(self._found.verdict["verdict"])

    @property
    def effects(self) -> tuple[str, ...]:
        """The effects that are named; those of one group where these recordings cannot tell them apart."""
        first = [e for e in self._found.verdict["which"][0]["effects"] if e != "unknown"]
        groups = [e for group in self._found.verdict["groups"] for e in group]
        return tuple(dict.fromkeys([*first, *groups])) if self.kind in ("explained", "group", "partly") else ()

    @property
    def sentences(self) -> list[str]:
        """What was found: the measuring chain first, then the machine, then the controller."""
        return finding(self._found.verdict)

    @property
    def warnings(self) -> list[str]:
        """Recordings that were set aside, and what these recordings cannot tell."""
        return [str(warning["message"]) for warning in self._found.verdict["warnings"]]

    @cached_property
    def verdict(self) -> dict[str, Any]:
        """Everything, as ``diagnosis.json`` has it; ``emafault schema verdict`` prints its schema."""
        return json.loads(checked(self._found.verdict | {"next_experiment": self._found.next_experiments()}))

    def probabilities(self) -> Table:
        """A row a set of effects: posterior probability; they are exclusive and sum to one."""
        rows = [
            [" + ".join(entry["effects"]) or "no effect", entry["probability"]]
            for entry in self._found.verdict["which"]
        ]
        return Table(["effects", "probability"], rows)

    def parameters(self) -> Table:
        """A row a fitted number of what was named and described: value, ends of the 90 % interval and unit."""
        verdict = self._found.verdict
        rows = [
            [p["effect"], name, p["value"], p["low"], p["high"], p["units"]]
            for name, p in (verdict["which"][0].get("parameters") or {}).items()
        ] + [
            [f"{d['form']} in {d['equation']}", name, p["value"], p["low"], p["high"], p["units"]]
            for d in verdict["discovered"]
            for name, p in d["parameters"].items()
        ]
        return Table(["cause", "parameter", "value", "low", "high", "unit"], rows)

    def residuals(self) -> Table:
        """A row an equation: the operating region that most of its residual lies in, its size and share."""
        columns = ["equation", "along", "from", "to", "z", "share"]
        return Table(columns, [[entry[c] for c in columns] for entry in self._found.verdict["where"]])

    def fault_vector(self) -> Table:
        """A row a recording and component: before, after and the ends of the 90 % interval (N and xi in 1, dT in K)."""
        rows = [
            [name, c, entry["before"][c]["value"], after["value"], after["low"], after["high"]]
            for name, entry in self._found.verdict["fault_vector"].items()
            for c, after in entry["after"].items()
        ]
        return Table(["recording", "component", "before", "after", "low", "high"], rows)

    def gap(self) -> Table:
        """A row a kind of misfit on the recordings set aside, in multiples of its noise; empty where none was."""
        columns = ["nominal", "recalibrated", "placebo", "after", "floor", "closed"]
        rungs = {kind: rung for kind, rung in self._found.verdict["shrinks"].items() if rung}
        return Table(["misfit of", *columns], [[kind, *(rung.get(c) for c in columns)] for kind, rung in rungs.items()])

    def plot_probabilities(self) -> "Figure":
        """Posterior probability and gain in log evidence of every set of effects."""
        from ..equations.page import ranked
        from ..reporting.diagnosis import draw_ranking

        return alone(draw_ranking(ranked(self._found.verdict)))

    def plot_gap(self) -> "Figure":
        """How far the misfit shrinks on the recordings set aside."""
        from ..reporting.diagnosis import draw_ladder

        return alone(draw_ladder(self._found.verdict["shrinks"]))

    def plot_fault_vector(self) -> "Figure":
        """The fault vector before and after, with 90 % intervals, beside the truth where a recording holds it."""
        from ..equations.page import fault_vectors
        from ..reporting.diagnosis import draw_faults

        truths = {name: r.fault for name, r in self._bench.recordings.items()}
        return alone(draw_faults(fault_vectors(self._found.verdict, truths)))

    def write(self, folder: str | Path | None = None, force: bool = False) -> Path:
        """Write ``diagnosis.json``, ``report.html`` and ``experiment.yaml`` and give the page's path.

        Parameters
        ----------
        folder : None takes ``results/diagnoses/<name of the bench>``
        force : whether files that are not of this bench's diagnosis may be replaced

        Raises
        ------
        InputError : a folder that cannot be written, or that holds something else
        """
        target = run.folder_of(self._bench.name) if folder is None else Path(folder)
        refuse_foreign(target, [self._bench.name], ["actuator"], force)
        run.write(self._found, self._bench, target)
        return target / REPORT

    def __repr__(self) -> str:
        return "\n".join([f"Diagnosis of {self._bench.name}: {self.kind}", *self.sentences])

    def _repr_html_(self) -> str:
        said = "".join(f"<li>{html.escape(sentence)}</li>" for sentence in self.sentences)
        head = f"<p><b>Diagnosis of {html.escape(self._bench.name)}: {self.kind.replace('_', ' ')}</b></p>"
        picture = as_html(self.plot_probabilities(), f"Posterior probabilities\n{self.probabilities()}")
        return f"{head}<ul>{said}</ul>{self.parameters()._repr_html_()}{picture}"


def diagnose(
    recordings: str | Path | Recording | Mapping[str, Recording] | Sequence[Recording],
    actuator: Actuator | None = None,
    exclude: Sequence[str] = (),
) -> Diagnosis:
    """Diagnose recordings of one actuator, as ``emafault diagnose`` does.

    Parameters
    ----------
    recordings : what ``read`` gives, the path of a file or folder, or recordings
    actuator : the nominal one; None takes the reference actuator
    exclude : effects of the catalogue to leave out

    Raises
    ------
    InputError : recordings or effects that cannot be used
    """
    given = recordings_of(recordings)
    actuator = actuator or Actuator.reference()
    bench = check_bench(given.name, dict(given), actuator.parameters)
    return Diagnosis(run.diagnose_bench(bench, actuator.spec, exclude), bench)

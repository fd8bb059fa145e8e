"""Diagnosis of a bench: where a simulator and recordings disagree, which effect causes it, how far it explains it."""

import json
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

from ..equations import run
from ..equations.diagnose import Diagnosed
from ..equations.sentences import finding
from ..errors import InputError, shown
from ..io.bench import Bench, check_bench
from ..io.enough import SAMPLES, within
from ..io.recording import Recording
from ..reporting.written import REPORT, checked, refuse_foreign
from .actuator import Actuator
from .machine import MachineDiagnoses, diagnose_machine
from .pictures import alone
from .recordings import recordings_of
from .table import Table
from .verdict import Told, as_page

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Given = str | Path | Recording | Mapping[str, Recording] | Sequence[Recording]


class Diagnosis(Told):
    """A verdict on a bench, with tables, plots and the page that ``emafault diagnose`` writes."""

    def __init__(self, found: Diagnosed, bench: Bench) -> None:
        super().__init__(found.verdict)
        self._found, self._bench = found, bench

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

    def fault_vector(self) -> Table:
        """A row a recording and component: before, after and the ends of the 90 % interval (N and xi in 1, dT in K)."""
        rows = [
            [name, c, entry["before"][c]["value"], after["value"], after["low"], after["high"]]
            for name, entry in self._found.verdict["fault_vector"].items()
            for c, after in entry["after"].items()
        ]
        return Table(["recording", "component", "before", "after", "low", "high"], rows)

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
        return as_page(f"Diagnosis of {self._bench.name}", self.sentences, self)


@overload
def diagnose(
    recordings: Given,
    actuator: Actuator | None = None,
    exclude: Sequence[str] = (),
    twin: None = None,
    calibration: str | Path | None = None,
    samples: int = SAMPLES,
) -> Diagnosis: ...
@overload
def diagnose(
    recordings: str | Path,
    actuator: None = None,
    exclude: Sequence[str] = (),
    *,
    twin: str | Path,
) -> MachineDiagnoses: ...
def diagnose(
    recordings: Given,
    actuator: Actuator | None = None,
    exclude: Sequence[str] = (),
    twin: str | Path | None = None,
    calibration: str | Path | None = None,
    samples: int = SAMPLES,
) -> Diagnosis | MachineDiagnoses:
    """Diagnose recordings of one actuator, or of a measured machine, as ``emafault diagnose`` does.

    Parameters
    ----------
    recordings : what ``read`` gives, the path of a file or folder, or recordings; with ``twin`` a path
    actuator : the nominal one; None takes the reference actuator
    exclude : effects of the catalogue to leave out
    twin : name of the measured machine that they come from, or a Python file that states one
    calibration : ``calibration.json`` of the actuator, which ``snakemake calibration`` writes
    samples : of the recordings that are taken at most: a diagnosis takes the longer, the more

    Raises
    ------
    InputError : recordings, effects or a machine that cannot be used
    """
    if twin is not None:
        if not isinstance(recordings, str | Path):
            raise InputError(f"recordings: got {shown(repr(recordings))}, accepted with a twin is the path of its file")
        if actuator is not None:
            raise InputError("actuator: a measured machine has none, accepted is either an actuator or a twin")
        if calibration is not None:
            raise InputError("calibration: only probabilities of an actuator are checked, accepted without a twin")
        return diagnose_machine(recordings, twin, exclude)
    given = recordings_of(recordings)
    actuator = actuator or Actuator.reference()
    bench = within(check_bench(given.name, dict(given), actuator.parameters), samples)
    return Diagnosis(run.diagnose_bench(bench, actuator.spec, exclude, calibration), bench)

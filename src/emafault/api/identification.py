"""Identification of the fault vector in recordings."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import shown
from ..faults import FAULT_NAMES
from ..identification.diagnosed import of_verdict
from ..identification.recordings import identify_recordings
from ..io.recording import Recording
from .model import load_model
from .pictures import alone, as_html
from .recordings import recordings_of
from .table import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Given = str | Path | Recording | Mapping[str, Recording] | Sequence[Recording]


class Identification:
    """Fault vectors with intervals: shorted turns N, eccentricity xi (1), winding temperature dT (K above 20 degC)."""

    def __init__(
        self, names: Sequence[str], estimates: Sequence[dict], notes: Sequence[str], how: str, level: float
    ) -> None:
        self.estimates = dict(zip(names, estimates, strict=True))
        self.notes = {name: note for name, note in zip(names, notes, strict=True) if note}
        self.how, self.level = how, level

    def table(self) -> Table:
        """A row a recording and component: value and ends of the interval."""
        rows = [
            [name, component, found["value"], found["low"], found["high"]]
            for name, estimate in self.estimates.items()
            for component, found in estimate.items()
        ]
        return Table(["recording", "component", "value", "low", "high"], rows)

    def plot(self) -> "Figure":
        """The fault vectors with their intervals."""
        from ..reporting.recordings import draw_estimates

        return alone(draw_estimates(self.estimates))

    def __repr__(self) -> str:
        width = max(len("file"), *(len(shown(name)) for name in self.estimates))
        lines = [f"{'file':{width}} " + " ".join(f"{name:>28}" for name in FAULT_NAMES)]
        for name, estimate in self.estimates.items():
            cells = []
            for component in FAULT_NAMES:
                e, digits = estimate[component], 2 if component == "dT" else 4
                cells.append(f"{e['value']:9.{digits}f} [{e['low']:7.{digits}f}, {e['high']:7.{digits}f}]")
            lines.append(f"{shown(name):{width}} " + " ".join(f"{cell:>28}" for cell in cells))
        lines.append(f"in brackets {100 * self.level:.0f} % intervals; N and xi in 1, dT in K above 20 degC")
        return "\n".join([*lines, self.how])

    def _repr_html_(self) -> str:
        return self.table()._repr_html_() + as_html(self.plot(), repr(self))


def identify(
    recordings: Given,
    reference: Given | None = None,
    experiment: str = "paper",
    method: str | None = None,
    level: float = 0.9,
    results: str | Path | None = None,
    actuator: str | Path | None = None,
    together: bool = False,
) -> Identification:
    """Identify the fault vector of each recording, as ``emafault identify`` does.

    Parameters
    ----------
    recordings : what ``read`` gives, the path of a file or folder, or recordings
    reference : healthy recordings of the same unit, to calibrate it with; None takes the unit for nominal
    experiment : name of the trained experiment; of one that was not trained here the closed form is used
    method : ``reconstruction`` or ``reconstruction/estimator``; None takes the most accurate of the experiment
    level : of the intervals
    results : folder of results; None takes ``results`` here, else that of the project
    actuator : file of one's own actuator, for which the closed form needs no training; None takes the experiment's
    together : the recordings are of one unit with one fault: N and xi from all of them, dT of each; by a closed form

    Raises
    ------
    InputError : recordings, a reference, an experiment, a method or an actuator that cannot be used
    """
    given = recordings_of(recordings)
    healthy = [] if reference is None else list(recordings_of(reference).values())
    model = load_model(experiment, method, results, None if actuator is None else str(actuator), together)
    found = identify_recordings(model, list(given.values()), healthy, level, together)
    unit = f"calibrated on {len(healthy)} healthy recording(s)" if healthy else "taken for nominal (no reference)"
    how = f"experiment {experiment}, method {model.name}, unit {unit}"
    how += f"; one fault of all {len(given)} recordings" if together else ""
    return Identification(list(given), found.estimates, found.notes, how, level)


def of_diagnosis(verdict: str | Path, files: Sequence[Path], level: float = 0.9) -> Identification:
    """The fault vectors that a diagnosis has of its recordings, what it names and describes taken out.

    Parameters
    ----------
    verdict : ``diagnosis.json``
    files : recordings of its bench
    level : of the intervals

    Raises
    ------
    InputError : a verdict that cannot be used, or that is not of these recordings
    """
    found = of_verdict(verdict, files, level)
    how = f"diagnosis {verdict}, taken out: {', '.join(found.taken_out) or 'nothing'}, the unit's tolerances fitted"
    return Identification([str(path) for path in files], found.estimates, [""] * len(files), how, level)

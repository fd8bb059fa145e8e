"""What to record next on a bench."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..equations import plan as planning
from ..io.recording import Recording
from .actuator import Actuator
from .diagnosis import Diagnosis, diagnose
from .pictures import alone, as_html
from .table import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Plan:
    """Recordings that distinguish the explanations of a bench that are left, the most decisive first."""

    def __init__(self, entries: Sequence[Mapping[str, Any]]) -> None:
        self.entries = [dict(entry) for entry in entries]

    @property
    def motions(self) -> dict[str, np.ndarray]:
        """By name, (time, 2) time (s) and commanded position of the user shaft (rad)."""
        return {
            f"{n}_{e['motion']['name']}": planning.motion_of(e)
            for n, e in enumerate(filter(planning.decides, self.entries), start=1)
        }

    def table(self) -> Table:
        """A row a recording: command, ambient temperature (degC), what it distinguishes, expected Bayes factor."""
        rows = [
            [e["command"], e["ambient_temperature"], planning.separated(e["separates"]), e["expected_odds"]]
            for e in self.entries
        ]
        return Table(["command", "ambient (degC)", "distinguishes", "expected Bayes factor"], rows)

    def plot(self) -> "Figure":
        """The commanded positions over time."""
        from ..reporting.recordings import draw_motions

        return alone(draw_motions(self.motions))

    def write(self, folder: str | Path, force: bool = False) -> list[Path]:
        """Write every motion as a table of time (s) and position (rad) for a bench to play.

        Raises
        ------
        InputError : a folder that cannot be written, or, without ``force``, files that are no motions
        """
        return planning.write_motions(self.entries, folder, force)

    def __repr__(self) -> str:
        return "\n".join(planning.sentences(self.entries))

    def _repr_html_(self) -> str:
        return self.table()._repr_html_() + (as_html(self.plot(), repr(self)) if self.motions else repr(self))


def plan(
    source: str | Path | Diagnosis | Recording | Mapping[str, Recording] | Sequence[Recording],
    actuator: Actuator | None = None,
) -> Plan:
    """What to record next, as ``emafault plan`` says.

    Parameters
    ----------
    source : a diagnosis, the path of its ``diagnosis.json``, or recordings, which are diagnosed
    actuator : the nominal one; None takes the reference actuator

    Raises
    ------
    InputError : recordings or a verdict that cannot be used
    """
    if isinstance(source, str | Path) and str(source).endswith(".json"):
        return Plan(planning.read_verdict(source)["next_experiment"])
    found = source if isinstance(source, Diagnosis) else diagnose(source, actuator)
    return Plan(found.verdict["next_experiment"])

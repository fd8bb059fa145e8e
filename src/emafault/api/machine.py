"""Diagnosis of measured machines: the cases of a file, each compared with the equations that a twin states."""

import json
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

from ..errors import shown
from ..machines import run
from ..machines.diagnose import Diagnosed, diagnose
from ..machines.page import finding
from ..reporting.written import REPORT, checked
from .table import Table
from .verdict import Told, as_page


class MachineDiagnosis(Told):
    """A verdict on one case of a measured machine, with tables and plots."""

    def __init__(self, found: Diagnosed) -> None:
        super().__init__(found.verdict)
        self._found = found

    @property
    def sentences(self) -> list[str]:
        """What was found."""
        return finding(self._found.verdict)

    @property
    def notes(self) -> list[str]:
        """What the machine says of these recordings, as that phases are exchanged in a file."""
        return [str(note) for note in self._found.verdict["notes"]]

    @cached_property
    def verdict(self) -> dict[str, Any]:
        """Everything, as ``diagnosis.json`` has it; ``emafault schema verdict`` prints its schema."""
        return json.loads(checked(self._found.verdict))

    def base(self) -> Table:
        """A row a parameter of the base model: before, after and the ends of the 90 % interval."""
        rows = [
            [name, p["before"]["value"], *(p["after"][c] for c in ("value", "low", "high")), p["after"]["units"]]
            for name, p in self._found.verdict["base"].items()
        ]
        return Table(["parameter", "before", "after", "low", "high", "unit"], rows)

    def next_recordings(self) -> Table:
        """A row a recording that tells more: what it distinguishes, expected Bayes factor; empty where none would."""
        rows = [
            [e["command"], " from ".join(e["separates"]), e["expected_odds"]]
            for e in self._found.verdict["next_experiment"]
        ]
        return Table(["recording", "distinguishes", "expected Bayes factor"], rows)

    def __repr__(self) -> str:
        return "\n".join([f"Diagnosis of {shown(self._found.verdict['bench'])}: {self.kind}", *self.sentences])

    def _repr_html_(self) -> str:
        return as_page(f"Diagnosis of {self._found.verdict['bench']}", self.sentences, self)


class MachineDiagnoses(Mapping[str, MachineDiagnosis]):
    """Verdicts by the names of their cases, which are what a file of measurements holds."""

    def __init__(self, opened: run.Opened, found: Mapping[str, Diagnosed]) -> None:
        self._opened, self._found = opened, dict(found)
        self._cases = {case: MachineDiagnosis(one) for case, one in self._found.items()}

    def __getitem__(self, case: str) -> MachineDiagnosis:
        return self._cases[case]

    def __iter__(self) -> Iterator[str]:
        return iter(self._cases)

    def __len__(self) -> int:
        return len(self._cases)

    @property
    def sentences(self) -> list[str]:
        """What was found, as the command prints it: of several cases each after its name."""
        return [text for case, found in self._found.items() for text in run.said(case, found, len(self))]

    @cached_property
    def verdict(self) -> dict[str, Any]:
        """Everything, as ``diagnosis.json`` has it: the verdict of a single case; of several, ``cases`` by name."""
        return json.loads(self._opened.together(self._found))

    def table(self) -> Table:
        """A row a case: kind of verdict, what is named, and the share of the gap that closes on what was set aside."""
        rows = [
            [case, d.kind, list(d.effects), next((row["closed"] for row in d.gap()), None)] for case, d in self.items()
        ]
        return Table(["case", "verdict", "effects", "closed"], rows)

    def write(self, folder: str | Path | None = None, force: bool = False) -> Path:
        """Write ``diagnosis.json`` and ``report.html``, of several cases each in a folder, and give the page's path.

        Parameters
        ----------
        folder : None takes ``results/diagnoses/<name of the file>``
        force : whether files that are not of this file's diagnosis may be replaced

        Raises
        ------
        InputError : a folder that cannot be written, or that holds something else
        """
        folders = self._opened.folders(folder, force)
        for case, found in self._found.items():
            run.write_case(found, folders[case])
        self._opened.write_contents(self._found, folder, folders)
        return self._opened.folder(folder) / REPORT

    def __repr__(self) -> str:
        return "\n".join([f"Diagnosis of {shown(self._opened.name)} by {self._opened.twin}", *self.sentences])

    def _repr_html_(self) -> str:
        return (self.table()._repr_html_() if len(self) > 1 else "") + "".join(d._repr_html_() for d in self.values())


def diagnose_machine(path: str | Path, twin: str | Path, exclude: Sequence[str] = ()) -> MachineDiagnoses:
    """Diagnose every case of a file, or of a folder of files, as ``emafault diagnose --twin`` does."""
    opened = run.open_file(path, str(twin), exclude)
    return MachineDiagnoses(opened, {case: diagnose(machine) for case, machine in opened.machines.items()})

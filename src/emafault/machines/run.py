"""Measured machines from the command line: every case of a file diagnosed and written with its page."""

import html
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import InputError, shown
from ..io.atomic import write_text
from ..io.bench import bench_name
from ..paths import results_folder
from ..places import file_name
from ..reporting.page import Page
from ..reporting.written import REPORT, VERDICT, checked, log_diagnosis, refuse_foreign, to_json
from .diagnose import Diagnosed, diagnose
from .library import build, read_cases, stated
from .page import draw, finding
from .statement import Machine


def diagnose_file(
    path: str | Path,
    twin: str,
    spec: Mapping[str, Any],
    out: str | Path | None = None,
    exclude: Sequence[str] = (),
    track: bool = True,
    force: bool = True,
) -> dict[str, dict]:
    """Diagnose every case of a file, or of a folder of files; write ``diagnosis.json`` and ``report.html`` of each.

    Parameters
    ----------
    twin : name of a machine, or a Python file that states one
    spec : ``tracking`` of a composed configuration
    out : folder to write to; None takes ``results/diagnoses/<name of the file>``
    exclude : effects that the library is to lack
    track : whether to log MLflow runs
    force : whether files in ``out`` that are not of a diagnosis of this file may be replaced

    Raises
    ------
    InputError : a machine, file or effect that cannot be used, or results that cannot be written
    """
    opened = open_file(path, twin, exclude)
    folders = opened.folders(out, force)  # before the work, not after it
    found: dict[str, Diagnosed] = {}
    for case, one in opened.machines.items():
        found[case] = diagnose(one)
        print("\n".join(said(case, found[case], len(opened.machines))), flush=True)
        write_case(found[case], folders[case])
    opened.write_contents(found, out, folders)
    print(f"written to {opened.folder(out)}", flush=True)
    for case, diagnosed in found.items() if track else ():
        log_diagnosis(spec["tracking"], folders[case], diagnosed.verdict, finding(diagnosed.verdict), path)
    return {case: d.verdict for case, d in found.items()}


@dataclass(frozen=True)
class Opened:
    """A file of a measured machine, or a folder of them: its cases, read and stated."""

    name: str
    twin: str
    machines: Mapping[str, Machine]

    def folder(self, out: str | Path | None = None) -> Path:
        """Folder to write to."""
        return Path(out) if out is not None else results_folder() / "diagnoses" / file_name(self.name)

    def folders(self, out: str | Path | None = None, force: bool = True) -> dict[str, Path]:
        """Folder of every case.

        Raises
        ------
        InputError : one that cannot be written, or, without ``force``, that holds something else
        """
        folder, cases = self.folder(out), list(self.machines)
        folders = _folders(folder, cases)
        twins = {self.twin, *(one.name for one in self.machines.values())}
        for place in {folder, *folders.values()}:
            refuse_foreign(place, [self.name, *cases], twins, force)
        return folders

    def together(self, found: Mapping[str, Diagnosed]) -> str:
        """Text of the ``diagnosis.json`` of the file: the verdict of the one case, or those of several by case."""
        if len(found) == 1:
            return checked(next(iter(found.values())).verdict)
        cases = {case: json.loads(to_json(d.verdict)) for case, d in found.items()}
        return to_json({"bench": self.name, "twin": self.twin, "cases": cases})

    def write_contents(
        self, found: Mapping[str, Diagnosed], out: str | Path | None, folders: Mapping[str, Path]
    ) -> None:
        """Write the page that leads to those of several cases, and their verdicts together."""
        if len(found) == 1:
            return
        contents = Page(f"Diagnoses of {self.name}")
        links = "".join(f'<li><a href="{folders[c].name}/{REPORT}">{html.escape(c)}</a></li>' for c in found)
        contents.parts.append(f"<ul>{links}</ul>")
        contents.write(self.folder(out) / REPORT)
        write_text(self.folder(out) / VERDICT, self.together(found))


def open_file(path: str | Path, twin: str, exclude: Sequence[str] = ()) -> Opened:
    """Read and state every case of a file, or of a folder of files.

    Raises
    ------
    InputError : a machine, file or effect that cannot be used
    """
    path = Path(path)
    machine = stated(twin)
    cases = read_cases(machine, path)
    if not cases:
        raise InputError(f"{shown(path)}: holds no case")
    machines = {case: build(machine, case, arrays).without(*exclude) for case, arrays in cases.items()}
    return Opened(bench_name(path), machine.name, machines)


def said(case: str, found: Diagnosed, cases: int = 1) -> list[str]:
    """What was found, under the name of its case where there are several."""
    sentences = finding(found.verdict)
    return [f"{shown(case)}:", *sentences] if cases > 1 else sentences


def write_case(found: Diagnosed, folder: Path) -> None:
    """Write ``diagnosis.json`` and ``report.html`` of one case."""
    last = checked(found.verdict)
    draw(found).write(folder / REPORT)
    write_text(folder / VERDICT, last)  # the last of them: where a verdict is, its report is


def _folders(folder: Path, cases: Sequence[str]) -> dict[str, Path]:
    """A folder of its own for every case; names that come out alike are numbered."""
    if len(cases) == 1:
        return {cases[0]: folder}
    out: dict[str, Path] = {}
    for case in cases:
        name = file_name(case)
        same = sum(other.name.rpartition("~")[0] == name or other.name == name for other in out.values())
        out[case] = folder / (f"{name}~{same + 1}" if same else name)
    return out

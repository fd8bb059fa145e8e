"""Measured machines from the command line: every case of a file diagnosed and written with its page."""

import html
import json
from collections.abc import Mapping, Sequence
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
    path = Path(path)
    machine = stated(twin)
    cases = read_cases(machine, path)
    if not cases:
        raise InputError(f"{shown(path)}: holds no case")
    name = bench_name(path)
    folder = Path(out) if out is not None else results_folder() / "diagnoses" / file_name(name)
    folders = _folders(folder, list(cases))
    machines = {case: build(machine, case, arrays).without(*exclude) for case, arrays in cases.items()}
    twins = {machine.name, *(one.name for one in machines.values())}
    for place in {folder, *folders.values()}:  # before the work, not after it
        refuse_foreign(place, [name, *cases], twins, force)
    found: dict[str, Diagnosed] = {}
    for case, one in machines.items():
        found[case] = diagnose(one)
        said = finding(found[case].verdict)
        print("\n".join([f"{shown(case)}:", *said] if len(cases) > 1 else said), flush=True)
        last = checked(found[case].verdict)
        draw(found[case]).write(folders[case] / REPORT)
        write_text(folders[case] / VERDICT, last)  # the last of them: where a verdict is, its report is
    if len(cases) > 1:
        together = {c: json.loads(to_json(d.verdict)) for c, d in found.items()}
        contents = Page(f"Diagnoses of {name}")
        links = "".join(f'<li><a href="{folders[c].name}/{REPORT}">{html.escape(c)}</a></li>' for c in cases)
        contents.parts.append(f"<ul>{links}</ul>")
        contents.write(folder / REPORT)
        write_text(folder / VERDICT, to_json({"bench": name, "twin": machine.name, "cases": together}))
    print(f"written to {folder}", flush=True)
    for case, diagnosed in found.items() if track else ():
        log_diagnosis(spec["tracking"], folders[case], diagnosed.verdict, finding(diagnosed.verdict), path)
    return {case: d.verdict for case, d in found.items()}


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

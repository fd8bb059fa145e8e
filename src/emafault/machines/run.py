"""Measured machines from the command line: every case of a file diagnosed and written with its page."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..io.atomic import write_text
from ..paths import results_folder
from ..reporting.page import Page
from ..reporting.written import REPORT, VERDICT, checked, file_name, log_diagnosis, to_json
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
) -> dict[str, dict]:
    """Diagnose every case of a file, or of a folder of files; write ``diagnosis.json`` and ``report.html`` of each.

    Parameters
    ----------
    twin : name of a machine, or a Python file that states one
    spec : ``tracking`` of a composed configuration
    out : folder to write to; None takes ``results/diagnoses/<name of the file>``
    exclude : effects that the library is to lack
    track : whether to log MLflow runs

    Raises
    ------
    InputError : a machine, file or effect that cannot be used, or results that cannot be written
    """
    path = Path(path)
    machine = stated(twin)
    cases = read_cases(machine, path)
    if not cases:
        raise InputError(f"{path}: holds no case")
    name = path.resolve().name if path.is_dir() else path.stem
    folder = Path(out) if out is not None else results_folder() / "diagnoses" / name
    folders = {case: folder if len(cases) == 1 else folder / file_name(case) for case in cases}
    machines = {case: build(machine, case, arrays).without(*exclude) for case, arrays in cases.items()}
    found: dict[str, Diagnosed] = {}
    for case, one in machines.items():
        found[case] = diagnose(one)
        write_text(folders[case] / VERDICT, checked(found[case].verdict))
        print(
            "\n".join([f"{case}:", *finding(found[case].verdict)] if len(cases) > 1 else finding(found[case].verdict))
        )
    if len(cases) > 1:
        together = {c: json.loads(to_json(d.verdict)) for c, d in found.items()}
        write_text(folder / VERDICT, to_json({"bench": name, "twin": machine.name, "cases": together}))
        contents = Page(f"Diagnoses of {name}")
        links = "".join(f'<li><a href="{file_name(c)}/{REPORT}">{c}</a></li>' for c in cases)
        contents.parts.append(f"<ul>{links}</ul>")
        contents.write(folder / REPORT)
    for case, diagnosed in found.items():
        draw(diagnosed).write(folders[case] / REPORT)
    print(f"written to {folder}", flush=True)
    for case, diagnosed in found.items() if track else ():
        log_diagnosis(spec["tracking"], folders[case], diagnosed.verdict)
    return {case: d.verdict for case, d in found.items()}

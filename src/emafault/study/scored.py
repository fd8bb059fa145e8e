"""The scoreboard of a draw of blind cases, written and tracked."""

import json
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..errors import InputError, shown
from ..plain import read_json
from ..provenance import digest_of, file_digest
from ..tracking import Data, Entry, log_run
from ..tracking.experiments import BLIND_CASES
from ..withheld.scoreboard import write_scoreboard
from ..withheld.scoring import score

#: metrics of a scoreboard that a run has; the others stand in its table
COMPARED = (
    "right_t1", "right_t4", "pairs_t2", "wrong_t0", "no_gap_t0", "wrong_t3", "equation_t3", "named_t7", "beside_t7",
    "loss_t7", "same_t9", "wrong_t8", "closed_t8_inside", "false_share", "ece", "coverage", "closed_signal",
    "closed_features", "closed_faults", "fault_ratio",
)  # fmt: skip


def score_draw(
    batches: Sequence[Path], measured: Path | None, report: Path, scores: Path, where: str, processes: int = 1
) -> None:
    """Score the cases of a draw: page, figures and ``scores.json`` beside ``report``, and one MLflow run.

    Parameters
    ----------
    batches : what the jobs of the draw have written
    measured : rows of the check by known changes of measured recordings, the rung T6, where the draw shows them
    where : what ``prepare_tracking`` has written
    processes : over so many the cases are shared out

    Raises
    ------
    InputError : a verdict that cannot be read, or a tracking server that cannot be used
    """
    found = scored(batches, processes)
    found |= {"measured": json.loads(measured.read_text()) if measured else []}
    page = write_scoreboard(found, report.parent)
    if page != report:
        page.replace(report)
    place = json.loads(Path(where).read_text())
    values = {m["id"]: float(m["value"]) for m in found["metrics"] if m["value"] is not None}
    draw = report.parent.name
    cases = len(found["rows"])
    data = Data(
        f"blind cases {draw}",
        digest_of(*map(file_digest, sorted(batches))),
        str(batches[0].parent),
        "evaluation",
        cases,
    )
    entry = Entry(
        f"withheld {draw}",
        {"draw": draw, "cases": cases},
        {name: values[name] for name in COMPARED if name in values},
        tables={"tables/metrics.json": _as_columns(found["metrics"])},
        note=f"{cases} blind cases of the draw {draw}; the scoreboard is among the artifacts.",
        data=[data],
        files={str(report): "", str(scores): ""},
    )
    log_run(place["uri"], place["experiment"], entry, BLIND_CASES)


def scored(batches: Sequence[Path], processes: int = 1) -> dict[str, Any]:
    """Judged rows and metrics of what the jobs of a draw have written.

    Raises
    ------
    InputError : not such files, or a verdict that cannot be read
    """
    with tempfile.TemporaryDirectory() as name:
        for batch in batches:
            unpack(batch, Path(name))
        return score(name, processes=processes)


def unpack(batch: Path, folder: Path) -> None:
    """Write the keys and verdicts that a job has written as one file into a folder each.

    Raises
    ------
    InputError : not such a file
    """
    files = read_json(batch, "files")["files"]
    if not isinstance(files, dict) or not all(isinstance(text, str) for text in files.values()):
        raise InputError(f"{batch}: not what a job of blind cases has written")
    for name, text in files.items():
        path = folder / name
        if not path.resolve().is_relative_to(folder.resolve()):
            raise InputError(f"{batch}: holds a file outside its folder, {shown(name)}")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


def _as_columns(metrics: Sequence[Mapping[str, Any]]) -> dict[str, list]:
    """Every metric with its interval and what is asked of it, as columns."""
    columns = {c: [m[c] for m in metrics] for c in ("id", "title", "value", "low", "high", "cases")}
    return columns | {c: ["" if m[c] is None else str(m[c]) for m in metrics] for c in ("good", "aim")}

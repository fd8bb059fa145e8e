"""The scoreboard of a draw of blind cases, written and tracked."""

import json
from collections.abc import Sequence
from pathlib import Path

from ..tracking import Entry, log_run
from ..withheld.scoreboard import write_scoreboard
from ..withheld.scoring import score


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
    folder = batches[0].parent / json.loads(batches[0].read_text())["folder"]
    found = score(folder, processes=processes) | {"measured": json.loads(measured.read_text()) if measured else []}
    page = write_scoreboard(found, report.parent)
    if page != report:
        page.replace(report)
    place = json.loads(Path(where).read_text())
    metrics = {m["id"]: float(m["value"]) for m in found["metrics"] if m["value"] is not None}
    draw = report.parent.name
    files: dict[str, str | Path] = {str(report): "", str(scores): ""}
    entry = Entry(
        f"withheld {draw}",
        {"draw": draw, "cases": len(found["rows"])},
        metrics,
        files=files,
    )
    log_run(place["uri"], place["experiment"], entry)

"""What every diagnosis writes: names of files, the folder of results, plain JSON, an MLflow run."""

import json
import math
import os
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from multiprocessing import get_all_start_methods, get_context
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError, shown
from ..places import refuse_folder, refuse_irregular, refuse_output
from ..plain import read_json
from ..processes import end_with
from ..progress import say

VERDICT, REPORT, EXPERIMENT = "diagnosis.json", "report.html", "experiment.yaml"
#: what an experiment that a diagnosis wrote begins with
FROM_DIAGNOSIS = "# @package _global_\n# from the diagnosis of "
#: the format of every verdict, the reference actuator's and a measured machine's
SCHEMA_FILE = Path(__file__).with_name("verdict.schema.json")


def to_json(value: Any) -> str:
    """Plain JSON; numbers that JSON has not (NaN, infinity) become null."""
    return json.dumps(_plain(value), indent=1, allow_nan=False) + "\n"


def checked(verdict: Mapping[str, Any]) -> str:
    """A verdict as written, checked against the schema of its format.

    Raises
    ------
    InputError : naming where it does not fit
    """
    import jsonschema

    text = to_json(verdict)
    try:
        jsonschema.validate(json.loads(text), json.loads(SCHEMA_FILE.read_text()))
    except jsonschema.ValidationError as error:
        raise InputError(f"verdict: {error.json_path.removeprefix('$.')}: {shown(error.message)}") from error
    return text


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [_plain(v) for v in value]
    if isinstance(value, bool | np.bool_):
        return bool(value)
    if isinstance(value, int | np.integer):
        return int(value)
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    return value


def refuse_foreign(folder: Path, benches: Collection[str], twins: Collection[str], force: bool) -> None:
    """Refuse a folder of results that cannot be written, or whose files no diagnosis of this bench has written.

    Parameters
    ----------
    benches : names of the bench and of its cases
    twins : names of the machine, which a verdict has
    force : whether files that are not of this bench may be replaced

    Raises
    ------
    InputError : naming the folder or the file
    """
    refuse_folder(folder, "--out")
    there = [folder / name for name in (VERDICT, REPORT, EXPERIMENT) if os.path.lexists(folder / name)]
    for path in there:
        refuse_irregular(path, "--out")
    ours = [folder / EXPERIMENT] if _is_experiment(folder / EXPERIMENT) else []
    if not force and there != ours and not _is_verdict(folder / VERDICT, benches, twins):
        raise InputError(f"--out: {shown(there[0])}: is not of a diagnosis of this bench, --force replaces it")


def refuse_experiment(path: Path) -> None:
    """Refuse the file of an experiment that no diagnosis has written.

    Raises
    ------
    InputError : naming the experiment
    """
    refuse_output(path, "--experiment", force=_is_experiment(path) or not path.exists())


def _is_verdict(path: Path, benches: Collection[str], twins: Collection[str]) -> bool:
    try:
        read = read_json(path)
    except InputError:
        return False
    return isinstance(read, dict) and read.get("bench") in benches and read.get("twin") in twins


def _is_experiment(path: Path) -> bool:
    try:
        return path.read_text(encoding="utf-8").startswith(FROM_DIAGNOSIS)
    except (OSError, UnicodeError):
        return False


@contextmanager
def aside(track: bool) -> Iterator[Callable[..., None]]:
    """Gives ``log_diagnosis``, done in a process of its own, which loads what it needs meanwhile; nothing without
    ``track``."""
    if not track or find_spec("mlflow") is None:
        yield lambda *_: None
        return
    if "fork" not in get_all_start_methods():
        yield log_diagnosis
        return
    with ProcessPoolExecutor(1, get_context("fork"), end_with, (os.getpid(),)) as pool:
        pool.submit(import_module, "mlflow")  # what comes of it shows below
        yield lambda *arguments: _say_if_not(_awaited(pool.submit(_failure, *arguments)))


def _awaited(failure: Future) -> str:
    try:
        return failure.result()
    except BrokenExecutor as error:
        return str(error)


def _say_if_not(failure: str) -> None:
    if failure:
        say(f"not tracked: {' '.join(failure.split())[:200]}")


def log_diagnosis(
    tracking: Mapping[str, str], folder: Path, verdict: Mapping[str, Any], sentences: Sequence[str], source: str | Path
) -> None:
    """Log the diagnosis as an MLflow run; whatever goes wrong is one line and no failure.

    Parameters
    ----------
    folder : where it was written
    sentences : what was found
    source : file or folder of the recordings
    """
    _say_if_not(_failure(tracking, folder, verdict, sentences, source))


def _failure(
    tracking: Mapping[str, str], folder: Path, verdict: Mapping[str, Any], sentences: Sequence[str], source: str | Path
) -> str:
    """Log it, where MLflow is installed; what went wrong, or nothing."""
    if find_spec("mlflow") is None:
        return ""
    try:
        from ..tracking import log_run
        from ..tracking.diagnosis import entry_of
        from ..tracking.experiments import DIAGNOSES
        from ..tracking.store import address

        files = {str(folder / name): "" for name in (VERDICT, REPORT)}
        entry = entry_of(verdict, sentences, Path(source), files)
        log_run(address(tracking["uri"]), tracking["experiment"], entry, DIAGNOSES)
    except Exception as error:
        return str(error) or type(error).__name__
    return ""

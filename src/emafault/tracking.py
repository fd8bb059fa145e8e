"""MLflow: one database and experiment, created once, one writer at a time, everything logged in batches.

The tracking server's address is a setting. A local SQLite file is locked while it is written, since MLflow breaks when
several processes create or migrate one.
"""

import contextlib
import json
import logging
import os
import re
import subprocess
import time
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from . import __version__
from .databases import SQLITE, locked, with_driver, without_password
from .errors import InputError
from .io.atomic import replace_atomically
from .places import kind
from .processes import still_there, this_process

_OWNER = "emafault.owner"  # tag of the process that logs a run
_LONGEST_VALUE = 6000


@dataclass(frozen=True)
class Entry:
    """What one MLflow run holds; ``children`` become nested runs."""

    name: str
    parameters: Mapping[str, Any] = field(default_factory=dict)
    metrics: Mapping[str, float] = field(default_factory=dict)
    curves: Mapping[str, list[float]] = field(default_factory=dict)  # metric over steps
    tags: Mapping[str, str] = field(default_factory=dict)
    files: Mapping[str, str | Path] = field(default_factory=dict)  # file or folder -> folder among the artifacts
    children: tuple["Entry", ...] = ()


def code_version() -> str:
    """Version of the package with the commit it was run from, if it is a git checkout; ``+`` marks changes."""
    folder = Path(__file__).parent
    try:
        text = subprocess.run(
            ["git", "describe", "--always", "--dirty=+", "--abbrev=10"], cwd=folder, capture_output=True, text=True
        )
        return f"{__version__} {text.stdout.strip()}".strip()
    except OSError:
        return __version__


def flatten(value: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested mappings as one level with dotted names."""
    flat: dict[str, Any] = {}
    for key, item in value.items():
        flat |= flatten(item, f"{prefix}{key}.") if isinstance(item, Mapping) and item else {f"{prefix}{key}": item}
    return flat


def ensure_experiment(uri: str, experiment: str) -> str:
    """Identifier of the experiment; database and experiment are created where they do not exist.

    Raises
    ------
    InputError : a server or file that cannot be used
    """
    with _client(uri) as client:
        return _experiment_id(client, uri, experiment)


def log_run(uri: str, experiment: str, entry: Entry) -> str:
    """Log one run with its children and return its identifier.

    Raises
    ------
    InputError : a server or file that cannot be used
    """
    with _client(uri) as client:
        experiment_id = _experiment_id(client, uri, experiment)
        _end_abandoned(client, experiment_id)
        return _log(client, experiment_id, entry, {})


def _end_abandoned(client, experiment_id: str) -> None:
    """Mark runs as killed whose logging a killed process of this host left unfinished."""
    for run in client.search_runs([experiment_id], "attributes.status = 'RUNNING'"):
        owner = run.data.tags.get(_OWNER)
        if owner and still_there(json.loads(owner)) is False:
            client.set_terminated(run.info.run_id, "KILLED")


def _log(client, experiment_id: str, entry: Entry, tags: Mapping[str, str]) -> str:
    now = int(1000 * time.time())
    every = {"mlflow.source.name": "emafault", "code_version": code_version(), **entry.tags, **tags}
    every[_OWNER] = json.dumps(this_process())
    run = client.create_run(experiment_id, start_time=now, run_name=entry.name, tags=every).info.run_id
    try:
        _fill(client, experiment_id, run, entry, now)
    except BaseException:
        with contextlib.suppress(Exception):  # what broke the logging may break this too
            client.set_terminated(run, "FAILED")
        raise
    client.set_terminated(run)
    return run


def _fill(client, experiment_id: str, run: str, entry: Entry, now: int) -> None:
    """Log what an entry holds, then its children."""
    from mlflow.entities import Metric, Param

    parameters = [Param(key, str(value)[:_LONGEST_VALUE]) for key, value in flatten(entry.parameters).items()]
    metrics = [Metric(_name(key), float(value), now, 0) for key, value in entry.metrics.items() if value == value]
    for key, values in entry.curves.items():
        metrics += [Metric(_name(key), float(value), now, step) for step, value in enumerate(values)]
    for part in _pieces(parameters, 100):
        client.log_batch(run, params=part)
    for part in _pieces(metrics, 1000):
        client.log_batch(run, metrics=part)
    for path, folder in entry.files.items():
        log = client.log_artifacts if Path(path).is_dir() else client.log_artifact
        log(run, str(path), folder or None)
    for child in entry.children:
        _log(client, experiment_id, child, {"mlflow.parentRunId": run})


def _name(key: str) -> str:
    """A metric's name with what MLflow accepts."""
    return "".join(c if c.isalnum() or c in "_-. /" else "_" for c in key)


def _pieces(items: list, size: int) -> Iterable[list]:
    return [items[start : start + size] for start in range(0, len(items), size)]


def _experiment_id(client, uri: str, name: str) -> str:
    found = client.get_experiment_by_name(name)
    if found:
        return found.experiment_id
    location = None
    if uri.startswith(SQLITE):
        location = (Path(uri.removeprefix(SQLITE)).resolve().parent / "mlflow_artifacts").as_uri()
    try:
        return client.create_experiment(name, artifact_location=location)
    except Exception:
        found = client.get_experiment_by_name(name)  # another process was first
        if found is None:
            raise
        return found.experiment_id


def _create(path: Path) -> None:
    """Create a database of runs, whole or not at all: MLflow cannot go on with one whose tables are half made."""
    from mlflow import MlflowClient

    if path.exists():
        return
    for journal in path.parent.glob(f".{path.name}.*.part-journal"):  # of one that was killed; the lock is ours
        journal.unlink()
    replace_atomically(path, lambda temporary: MlflowClient(f"{SQLITE}{temporary}").search_experiments())


@contextlib.contextmanager
def _client(uri: str) -> Iterator[Any]:
    """A client, with the local database locked while it is open."""
    os.environ.setdefault("MLFLOW_DISABLE_TELEMETRY", "true")
    from mlflow import MlflowClient
    from mlflow.exceptions import MlflowException
    from sqlalchemy.exc import SQLAlchemyError

    for name in ("mlflow", "alembic"):  # what goes wrong is raised too; the import sets levels of its own
        logging.getLogger(name).setLevel(logging.CRITICAL)

    with contextlib.ExitStack() as stack:
        try:
            if uri.startswith(SQLITE):
                path = Path(uri.removeprefix(SQLITE))
                if kind(path, "tracking.uri") not in ("", "file"):  # MLflow tries for minutes to open it
                    raise InputError(f"tracking.uri: {uri} cannot be used (not a file)")
            stack.enter_context(locked(uri))
            if uri.startswith(SQLITE):
                _create(Path(uri.removeprefix(SQLITE)))
            yield MlflowClient(tracking_uri=with_driver(uri))
        except (MlflowException, SQLAlchemyError, ImportError, OSError) as error:
            reason = " ".join(re.split(r"\[SQL:|\(Background on", str(error))[0].split())
            raise InputError(f"tracking.uri: {without_password(uri)} cannot be used ({reason[:300]})") from error

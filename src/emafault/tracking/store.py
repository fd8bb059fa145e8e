"""The MLflow store: a server's address, or a local SQLite file with the artifacts in a folder beside it.

A local file is locked while it is written, since MLflow breaks when several processes create or migrate one. MLflow
writes down where artifacts are as absolute paths; where the folder has been moved or copied, they are set right.
"""

import contextlib
import logging
import os
import re
import sqlite3
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ..databases import SQLITE, locked, with_driver, without_password
from ..errors import InputError
from ..io.atomic import replace_atomically
from ..paths import results_folder
from ..places import kind
from .experiments import Experiment

_ARTIFACTS = "mlflow_artifacts"
#: table -> its column that says where artifacts are
_LOCATIONS = {
    "runs": "artifact_uri", "logged_models": "artifact_location", "experiments": "artifact_location",
}  # fmt: skip


def ensured(client, uri: str, name: str, experiment: Experiment) -> str:
    """Identifier of an experiment, created and described where it is not yet."""
    name = experiment.named(name)
    found = client.get_experiment_by_name(name)
    if found:
        experiment_id, tags = found.experiment_id, found.tags
    else:
        experiment_id, tags = _created(client, uri, name), {}
    for key, value in experiment.tags(experiment_id).items():
        if tags.get(key) != value:
            client.set_experiment_tag(experiment_id, key, value)
    return experiment_id


def _created(client, uri: str, name: str) -> str:
    path = local_file(uri)
    try:
        return client.create_experiment(name, artifact_location=_artifacts(path) if path else None)
    except Exception:
        found = client.get_experiment_by_name(name)  # another process was first
        if found is None:
            raise
        return found.experiment_id


def address(uri: str) -> str:
    """An address in which ``results`` is the folder of results, that of the clone from outside it."""
    beside = f"{SQLITE}results/"
    return f"{SQLITE}{results_folder() / uri.removeprefix(beside)}" if uri.startswith(beside) else uri


def local_file(uri: str) -> Path | None:
    """The SQLite file of an address, None of a server's."""
    return Path(uri.removeprefix(SQLITE)) if uri.startswith(SQLITE) else None


def _artifacts(path: Path) -> str:
    return (path.resolve().parent / _ARTIFACTS).as_uri()


def relocate(path: Path) -> None:
    """Point a database to the artifacts beside it, where it was moved or copied together with them."""
    here = _artifacts(path)
    if not path.is_file() or not (path.resolve().parent / _ARTIFACTS).is_dir():
        return
    with contextlib.closing(sqlite3.connect(path)) as database, database:
        if not database.execute("select 1 from sqlite_master where name = 'logged_models'").fetchone():
            return  # MLflow has yet to make or migrate it
        rows = database.execute("select distinct artifact_location from experiments").fetchall()
        elsewhere = [old for (old,) in rows if old and old.endswith(f"/{_ARTIFACTS}") and old != here]
        for old in elsewhere:
            for table, column in _LOCATIONS.items():
                moved = f"update {table} set {column} = ? || substr({column}, ?) where {column} = ? or {column} like ?"
                database.execute(moved, (here, len(old) + 1, old, f"{old}/%"))


def _create(path: Path) -> None:
    """Create a database of runs, whole or not at all: MLflow cannot go on with one whose tables are half made."""
    from mlflow import MlflowClient

    if path.exists():
        return
    for journal in path.parent.glob(f".{path.name}.*.part-journal"):  # of one that was killed; the lock is ours
        journal.unlink()
    replace_atomically(path, lambda temporary: MlflowClient(f"{SQLITE}{temporary}").search_experiments())


@contextlib.contextmanager
def connected(uri: str) -> Iterator[Any]:
    """A client, with the local database locked while it is open.

    Raises
    ------
    InputError : a server or file that cannot be used
    """
    os.environ.setdefault("MLFLOW_DISABLE_TELEMETRY", "true")
    from mlflow import MlflowClient
    from mlflow.exceptions import MlflowException
    from sqlalchemy.exc import SQLAlchemyError

    for name in ("mlflow", "alembic"):  # what goes wrong is raised too; the import sets levels of its own
        logging.getLogger(name).setLevel(logging.CRITICAL)

    with contextlib.ExitStack() as stack:
        try:
            path = local_file(uri)
            if path is not None:
                if kind(path, "tracking.uri") not in ("", "file"):  # MLflow tries for minutes to open it
                    raise InputError(f"tracking.uri: {uri} cannot be used (not a file)")
            stack.enter_context(locked(uri))
            if path is not None:
                _create(path)
                relocate(path)
            yield MlflowClient(tracking_uri=with_driver(uri))
        except (MlflowException, SQLAlchemyError, sqlite3.Error, ImportError, OSError) as error:
            reason = " ".join(re.split(r"\[SQL:|\(Background on", str(error))[0].split())
            raise InputError(f"tracking.uri: {without_password(uri)} cannot be used ({reason[:300]})") from error

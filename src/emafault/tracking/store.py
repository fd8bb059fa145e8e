"""The MLflow store: a server's address, or a local SQLite file with the artifacts in a folder beside it.

A local file is locked while it is written, since MLflow breaks when several processes create or migrate one. MLflow
writes down where artifacts are as absolute paths; where the folder has been moved or copied, they are set right.
"""

import contextlib
import fcntl
import logging
import os
import re
import sqlite3
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..paths import results_folder
from ..places import kind
from .experiments import Experiment

_SQLITE = "sqlite:///"
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
        path = local_file(uri)
        experiment_id = client.create_experiment(name, artifact_location=_artifacts(path) if path else None)
        tags = {}
    for key, value in experiment.tags(experiment_id).items():
        if tags.get(key) != value:
            client.set_experiment_tag(experiment_id, key, value)
    return experiment_id


def address(uri: str) -> str:
    """An address in which ``results`` is the folder of results, that of the clone from outside it."""
    beside = f"{_SQLITE}results/"
    return f"{_SQLITE}{results_folder() / uri.removeprefix(beside)}" if uri.startswith(beside) else uri


def local_file(uri: str) -> Path | None:
    """The SQLite file of an address, None of a server's."""
    return Path(uri.removeprefix(_SQLITE)) if uri.startswith(_SQLITE) else None


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
                path.parent.mkdir(parents=True, exist_ok=True)
                lock = stack.enter_context(open(path.with_name(f".{path.name}.lock"), "w"))
                fcntl.flock(lock, fcntl.LOCK_EX)
                relocate(path)
            yield MlflowClient(tracking_uri=uri)
        except (MlflowException, SQLAlchemyError, sqlite3.Error, OSError) as error:
            reason = " ".join(re.split(r"\[SQL:|\(Background on", str(error))[0].split())
            raise InputError(f"tracking.uri: {uri} cannot be used ({reason[:300]})") from error

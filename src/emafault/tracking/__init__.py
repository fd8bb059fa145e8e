"""MLflow: one database and experiment, created once, one writer at a time, everything logged in batches.

What an experiment is for stands in ``experiments``, how the database is reached in ``store``.
"""

import contextlib
import json
import subprocess
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .. import __version__
from ..processes import still_there, this_process
from .experiments import STUDIES, Experiment
from .store import connected, ensured

_OWNER = "emafault.owner"  # tag of the process that logs a run
_LONGEST_VALUE = 6000
MOST = 20  # metrics of a run


@dataclass(frozen=True)
class Data:
    """A data set that a run has used."""

    name: str
    digest: str
    source: str  # path or words: where it is had from
    context: str  # what for: training, evaluation, diagnosis
    rows: int


@dataclass(frozen=True)
class Network:
    """A trained network, logged as a model with its own figures."""

    path: str | Path  # ONNX file
    parameters: Mapping[str, str]
    metrics: Mapping[str, float]


@dataclass(frozen=True)
class Entry:
    """What one MLflow run holds; ``children`` become nested runs.

    Metrics are the figures that one compares, up to ``MOST`` with the curves; the others stand in ``tables``.
    """

    name: str
    parameters: Mapping[str, Any] = field(default_factory=dict)
    metrics: Mapping[str, float] = field(default_factory=dict)
    curves: Mapping[str, list[float]] = field(default_factory=dict)  # metric over steps
    tables: Mapping[str, Mapping[str, list]] = field(default_factory=dict)  # file among the artifacts -> columns
    tags: Mapping[str, str] = field(default_factory=dict)
    note: str = ""  # description in Markdown
    data: Sequence[Data] = ()
    network: Network | None = None
    files: Mapping[str, str | Path] = field(default_factory=dict)  # file or folder -> folder among the artifacts
    children: tuple["Entry", ...] = ()

    def __post_init__(self) -> None:
        count = len(self.metrics) + len(self.curves) + (len(self.network.metrics) if self.network else 0)
        if count > MOST:
            raise ValueError(f"{self.name}: {count} metrics, up to {MOST} can be compared; tables take more")


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


def ensure_experiment(uri: str, name: str, experiment: Experiment = STUDIES) -> str:
    """Identifier of the experiment; database and experiment are created where they do not exist.

    Parameters
    ----------
    name : that the configuration gives; of anything but studies the experiment has an ending more

    Raises
    ------
    InputError : a server or file that cannot be used
    """
    with connected(uri) as client:
        return ensured(client, uri, name, experiment)


def log_run(uri: str, name: str, entry: Entry, experiment: Experiment = STUDIES) -> str:
    """Log one run with its children and return its identifier.

    Raises
    ------
    InputError : a server or file that cannot be used
    """
    with connected(uri) as client:
        experiment_id = ensured(client, uri, name, experiment)
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
    every |= {"mlflow.note.content": entry.note} if entry.note else {}
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

    _log_data(client, run, entry.data)
    parameters = [Param(key, str(value)[:_LONGEST_VALUE]) for key, value in flatten(entry.parameters).items()]
    metrics = [Metric(_name(key), float(value), now, 0) for key, value in entry.metrics.items() if value == value]
    if entry.network is not None:
        model = _log_network(client, experiment_id, run, entry.network)
        metrics += [Metric(key, float(value), now, 0, model_id=model) for key, value in entry.network.metrics.items()]
    for key, values in entry.curves.items():
        metrics += [Metric(_name(key), float(value), now, step) for step, value in enumerate(values)]
    for part in _pieces(parameters, 100):
        client.log_batch(run, params=part)
    for part in _pieces(metrics, 1000):
        client.log_batch(run, metrics=part)
    for file, columns in entry.tables.items():
        client.log_table(run, {column: list(values) for column, values in columns.items()}, file)
    for path, folder in entry.files.items():
        log = client.log_artifacts if Path(path).is_dir() else client.log_artifact
        log(run, str(path), folder or None)
    for child in entry.children:
        _log(client, experiment_id, child, {"mlflow.parentRunId": run})


def _log_data(client, run: str, data: Sequence[Data]) -> None:
    from mlflow.entities import Dataset, DatasetInput, InputTag

    inputs = [
        DatasetInput(
            Dataset(d.name, d.digest, "local", json.dumps({"uri": d.source}), profile=json.dumps({"num_rows": d.rows})),
            [InputTag("mlflow.data.context", d.context)],
        )
        for d in data
    ]
    if inputs:
        client.log_inputs(run, inputs)


def _log_network(client, experiment_id: str, run: str, network: Network) -> str:
    """Log the network with its signature as a model of the run; its identifier."""
    from mlflow.entities import LoggedModelOutput

    from .network import saved

    made = client.create_logged_model(
        experiment_id, name="network", source_run_id=run, params=dict(network.parameters), model_type="onnx"
    )
    model = made.model_id
    with saved(str(network.path), model, run) as folder:
        client.log_model_artifacts(model, folder)
    client.finalize_logged_model(model, "READY")
    client.log_outputs(run, [LoggedModelOutput(model, 0)])
    return model


def _name(key: str) -> str:
    """A metric's name with what MLflow accepts."""
    return "".join(c if c.isalnum() or c in "_-. /" else "_" for c in key)


def _pieces(items: list, size: int) -> Iterable[list]:
    return [items[start : start + size] for start in range(0, len(items), size)]

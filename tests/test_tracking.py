"""What MLflow is told: few figures, the others as tables; data, network and paths that hold after a move."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from emafault.cli import main
from emafault.errors import InputError
from emafault.tracking import MOST, Data, Entry, Network, ensure_experiment, log_run
from emafault.tracking.diagnosis import entry_of
from emafault.tracking.experiments import BLIND_CASES, DIAGNOSES, STUDIES, VIEW


@pytest.fixture(scope="module")
def network(tmp_path_factory):
    """An ONNX file: six features times two."""
    import onnx
    from onnx import TensorProto, helper

    shape = ["run", 6]
    features = helper.make_tensor_value_info("features", TensorProto.FLOAT, shape)
    faults = helper.make_tensor_value_info("faults", TensorProto.FLOAT, shape)
    graph = helper.make_graph(
        [helper.make_node("Add", ["features", "features"], ["faults"])], "g", [features], [faults]
    )
    path = tmp_path_factory.mktemp("network") / "network.onnx"
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8), path)
    return path


@pytest.fixture(scope="module")
def moved(tmp_path_factory, network):
    """(address, run) of a run that was logged before the folder was moved."""
    before, after = (tmp_path_factory.mktemp(name) / "results" for name in ("before", "after"))
    before.mkdir()
    report = before / "report.html"
    report.write_text("report")
    entry = Entry(
        "mine",
        {"network": {"width": 6}},
        {"error_dT_K": 0.3},
        {"curve.train": [3.0, 2.0, 1.0]},
        {"tables/metrics.json": {"metric": ["dT.mae", "dT.bias"], "mean": [0.3, float("nan")]}},
        note="dT to 0.3 K",
        data=[Data("paper/training", "0123456789abcdef", "results/datasets/paper/training", "training", 600)],
        network=Network(network, {"estimator": "network"}, {"network_dT_K": 0.4}),
        files={report: ""},
    )
    run = log_run(f"sqlite:///{before}/mlflow.db", "emafault", entry)
    shutil.move(before, after)
    uri = f"sqlite:///{after}/mlflow.db"
    ensure_experiment(uri, "emafault")
    return uri, run


def test_what_was_logged_is_found_after_a_move(moved):
    from mlflow import MlflowClient

    uri, run = moved
    client = MlflowClient(tracking_uri=uri)
    assert {f.path for f in client.list_artifacts(run)} == {"report.html", "tables"}
    assert Path(client.download_artifacts(run, "report.html")).read_text() == "report"
    assert "/after" in client.get_run(run).info.artifact_uri
    table = json.loads(Path(client.download_artifacts(run, "tables/metrics.json")).read_text())
    assert table["columns"] == ["metric", "mean"] and [row[0] for row in table["data"]] == ["dT.mae", "dT.bias"]


def test_a_run_has_its_data_its_description_and_its_network_with_a_signature(moved, monkeypatch):
    import mlflow
    from mlflow import MlflowClient

    uri, run = moved
    client = MlflowClient(tracking_uri=uri)
    found = client.get_run(run)
    assert found.data.tags["mlflow.note.content"] == "dT to 0.3 K"
    (used,) = found.inputs.dataset_inputs
    assert (used.dataset.name, used.dataset.digest) == ("paper/training", "0123456789abcdef")
    assert [(t.key, t.value) for t in used.tags] == [("mlflow.data.context", "training")]
    assert found.data.metrics == {"error_dT_K": 0.3, "curve.train": 1.0, "network_dT_K": 0.4}
    (logged,) = client.search_logged_models([found.info.experiment_id])
    assert [(m.key, m.value) for m in logged.metrics] == [("network_dT_K", 0.4)] and logged.source_run_id == run
    before = mlflow.get_tracking_uri()
    mlflow.set_tracking_uri(uri)
    try:
        signature = mlflow.models.get_model_info(f"models:/{logged.model_id}").signature
        session = mlflow.onnx.load_model(f"models:/{logged.model_id}")
    finally:
        mlflow.set_tracking_uri(before)
    assert [(t.name, t.shape) for t in signature.inputs] == [("features", (-1, 6))]
    assert [t.name for t in signature.outputs] == ["faults"] and session.graph.input[0].name == "features"


def test_experiments_open_in_the_view_of_model_training_with_their_columns(moved, capsys):
    from mlflow import MlflowClient

    uri, _ = moved
    ids = {kind: ensure_experiment(uri, "mine", kind) for kind in (STUDIES, DIAGNOSES, BLIND_CASES)}
    client = MlflowClient(tracking_uri=uri)
    for kind, name in zip(ids, ("mine", "mine-diagnoses", "mine-blind-cases")):
        tags = client.get_experiment_by_name(name).tags
        assert tags["mlflow.experimentKind"] == "custom_model_development"
        columns = json.loads(tags[f"mlflow.sharedViewState.{VIEW}"])["selectedColumns"]
        assert f"metrics.`{kind.metrics[0]}`" in columns and len(kind.metrics) <= MOST
    client.set_experiment_tag(ids[STUDIES], "mlflow.experimentKind", "genai_development")
    assert ensure_experiment(uri, "mine") == ids[STUDIES]
    assert client.get_experiment(ids[STUDIES]).tags["mlflow.experimentKind"] == "custom_model_development"
    assert main(["runs", f"tracking.uri={uri}", "--no-pages"]) == 0
    printed = capsys.readouterr().out
    assert f"#/experiments/{ids[DIAGNOSES]}/runs?viewStateShareKey={VIEW}&workflowType=machine_learning" in printed


def test_more_figures_than_can_be_compared_are_refused():
    with pytest.raises(ValueError, match="tables take more"):
        Entry("mine", metrics={f"m{n}": 0.0 for n in range(MOST + 1)})


def test_a_diagnosis_is_few_figures_and_tables_of_the_others(tmp_path):
    rung = {name: float(n) for n, name in enumerate(("nominal", "recalibrated", "placebo", "after", "floor", "closed"))}
    fitted = {"value": 1.0, "low": 0.5, "high": 1.5, "units": "N m"}
    verdict = {
        "bench": "b", "twin": "actuator", "verdict": "explained", "digest": "d",
        "recordings": {"explore": ["r.nc"], "confirm": []},
        "which": [{"effects": ["cogging"], "probability": 0.95, "parameters": {"a": fitted}}],
        "discovered": [{"form": "order", "probability": 0.9, "parameters": {"order": fitted}}],
        "shrinks": {"signal": rung, "features": rung, "fault_vector": rung},
    }  # fmt: skip
    (tmp_path / "r.nc").write_bytes(b"one")
    entry = entry_of(verdict, ["The motor cogs."], tmp_path, {})
    assert len(entry.metrics) <= MOST and entry.metrics["signal.closed"] == 5.0
    assert entry.tables["tables/parameters.json"]["cause"] == ["cogging", "order"]
    assert len(entry.tables["tables/gap.json"]["value"]) == 18 and entry.note == "- The motor cogs."
    (data,) = entry.data
    (tmp_path / "r.nc").write_bytes(b"other")
    assert entry_of(verdict, [], tmp_path, {}).data[0].digest != data.digest
    assert np.isfinite(list(entry.metrics.values())).all()


def test_runs_that_are_not_there_are_refused_in_one_line(tmp_path, capsys):
    assert main(["runs", f"tracking.uri=sqlite:///{tmp_path}/none.db"]) == 2
    error = capsys.readouterr().err
    assert "nothing was logged there" in error and error.count("\n") == 1
    (tmp_path / "bad.db").write_bytes(b"garbage" * 100)
    with pytest.raises(InputError, match="cannot be used"):
        ensure_experiment(f"sqlite:///{tmp_path}/bad.db", "mine")

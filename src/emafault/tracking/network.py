"""A network in the form that MLflow loads: the ONNX file with its signature and what it needs to run."""

import contextlib
import tempfile
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path

import numpy as np

_TYPES = {1: np.float32, 11: np.float64}  # of ONNX's tensors


@contextlib.contextmanager
def saved(path: str, model_id: str, run: str) -> Iterator[str]:
    """Folder that holds the network as a model of MLflow's, as long as the context is open."""
    import mlflow.onnx
    import onnx
    from mlflow.models import Model, ModelSignature
    from mlflow.types import ColSpec, Schema, TensorSpec

    network = onnx.load(path)

    def tensors(values) -> Schema:
        specs: list[ColSpec | TensorSpec] = []
        for value in values:
            shape = [d.dim_value or -1 for d in value.type.tensor_type.shape.dim]
            specs.append(TensorSpec(np.dtype(_TYPES[value.type.tensor_type.elem_type]), tuple(shape), value.name))
        return Schema(specs)

    signature = ModelSignature(tensors(network.graph.input), tensors(network.graph.output))
    needed = [f"{name}=={version(name)}" for name in ("onnx", "onnxruntime", "numpy")]
    with tempfile.TemporaryDirectory() as folder:
        place = str(Path(folder) / "model")
        mlflow.onnx.save_model(
            network, place, signature=signature, pip_requirements=needed,
            mlflow_model=Model(run_id=run, model_id=model_id),
        )  # fmt: skip
        yield place

"""ONNX export of a network with its scaling inside: R (ohm), k (V s/rad), of nine L (H) in, faults in SI units out."""

import warnings
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..faults import FAULT_NAMES
from ..io.atomic import replace_atomically
from .network import Network, logarithmic
from .training import torch_layers


def torch_module(network: Network):
    """The network as a torch module in float32, coordinates and scaling included."""
    import torch

    class Identification(torch.nn.Module):
        def __init__(self) -> None:
            super().__init__()
            scaler = network.scaler
            self.log = scaler.coordinates == "log"
            self.layers = torch.nn.Sequential(*torch_layers(network.weights, network.settings.activation))
            for name in ("feature_mean", "feature_scale", "fault_mean", "fault_scale"):
                self.register_buffer(name, torch.from_numpy(getattr(scaler, name).copy()))

        def forward(self, features):
            x = features
            if self.log:
                logs = logarithmic(x.shape[1])
                x = torch.cat([torch.log(x[:, :logs]), x[:, logs:]], dim=1) if x.shape[1] > logs else torch.log(x)
            return self.layers((x - self.feature_mean) / self.feature_scale) * self.fault_scale + self.fault_mean

    return Identification().to(torch.float32).eval()


def export_onnx(network: Network, path: str | Path, check_on: np.ndarray) -> dict[str, float]:
    """Write the ONNX file and compare it with torch and with the float64 network on given features.

    Parameters
    ----------
    path : file to write, atomically; input ``features`` (run, feature) and output ``faults`` (run, 6) are float32
    check_on : (run, feature) features in SI units

    Returns
    -------
    ``against_torch`` and ``against_float64``: largest absolute difference over any output divided by that output's
    scale (its standard deviation in training); ``against_torch_<component>`` the same in SI units

    Raises
    ------
    InputError : the file cannot be written
    """
    import onnxruntime
    import torch

    module = torch_module(network)
    x = torch.from_numpy(np.asarray(check_on, np.float32))

    def write(temporary: Path) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the exporter announces its successor, which needs a further package
            torch.onnx.export(
                module,
                (x,),
                str(temporary),
                input_names=["features"],
                output_names=["faults"],
                dynamic_axes={"features": {0: "run"}, "faults": {0: "run"}},
                dynamo=False,
            )

    replace_atomically(Path(path), write)
    try:
        session = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    except Exception as error:
        raise InputError(f"{path}: the exported network cannot be read back ({error})") from error
    (got,) = session.run(None, {"features": x.numpy()})
    with torch.no_grad():
        reference = module(x).numpy()
    exact = network.predict(x.numpy().astype(float))
    scale = network.scaler.fault_scale
    difference = np.max(np.abs(got - reference), axis=0)
    return {
        "against_torch": float(np.max(difference / scale)),
        "against_float64": float(np.max(np.abs(got - exact) / scale)),
        **{f"against_torch_{name}": float(d) for name, d in zip(FAULT_NAMES, difference)},
    }

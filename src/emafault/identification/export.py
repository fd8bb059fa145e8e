"""ONNX export of an identifier's networks, scaling inside: R (ohm), k (V s/rad), of nine L (H) in, faults in SI out.

A unit without healthy recordings and one with them are identified by two files, since their networks may differ and the
second takes the unit's own R, k and L too.
"""

import warnings
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..faults import FAULT_NAMES
from ..io.atomic import replace_atomically
from .identifier import Identifier
from .network import Network, logarithmic
from .training import torch_layers


def network_of(identifier: Identifier) -> Network:
    """The network of an identifier.

    Raises
    ------
    InputError : a closed form, which has none
    """
    if identifier.network is None:
        raise InputError("export: got a closed form, accepted is an identifier with a network")
    return identifier.network


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


def calibrated_module(identifier: Identifier):
    """What identifies a unit with healthy recordings as a torch module in float32, the scaling to it included."""
    import torch

    network = network_of(identifier.calibrated)
    nominal = identifier.nominal_unit(len(network.scaler.feature_mean))

    class Calibrated(torch.nn.Module):
        def __init__(self) -> None:
            super().__init__()
            self.network = torch_module(network)
            self.register_buffer("nominal", torch.from_numpy(nominal.copy()))

        def forward(self, features, unit):
            own = len(nominal)
            x = features[:, :own] * (self.nominal / unit)
            return self.network(torch.cat([x, features[:, own:]], dim=1) if features.shape[1] > own else x)

    return Calibrated().to(torch.float32).eval()


def export_onnx(identifier: Identifier, path: str | Path, check_on: np.ndarray) -> dict[str, float]:
    """Write what identifies units without healthy recordings, and compare it with torch and the float64 network.

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
    InputError : an identifier without a network, or a file that cannot be written
    """
    network = network_of(identifier)
    x = np.asarray(check_on, np.float32)
    exact = network.predict(x.astype(float))
    return _export(torch_module(network), {"features": x}, path, exact, network.scaler.fault_scale)


def export_calibrated_onnx(
    identifier: Identifier, path: str | Path, check_on: np.ndarray, unit: np.ndarray
) -> dict[str, float]:
    """Write what identifies units with healthy recordings, and compare it as ``export_onnx`` does.

    Parameters
    ----------
    path : file to write; beside ``features`` an input ``unit`` (run, 6), of nine features (run, 9), or one row for
        all runs: R, k (and L) of the healthy unit at 20 degC
    unit : of that shape, what is compared with
    """
    network = network_of(identifier.calibrated)
    x, own = np.asarray(check_on, np.float32), np.atleast_2d(np.asarray(unit, np.float32))
    exact = identifier.predict(x.astype(float), unit=own.astype(float))
    inputs = {"features": x, "unit": own}
    return _export(calibrated_module(identifier), inputs, path, exact, network.scaler.fault_scale)


def _export(
    module, inputs: Mapping[str, np.ndarray], path: str | Path, exact: np.ndarray, scale: np.ndarray
) -> dict[str, float]:
    import onnxruntime
    import torch

    tensors = tuple(torch.from_numpy(x) for x in inputs.values())
    axes = {"features": {0: "run"}, "unit": {0: "unit"}, "faults": {0: "run"}}

    def write(temporary: Path) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the exporter announces its successor, which needs a further package
            torch.onnx.export(
                module,
                tensors,
                str(temporary),
                input_names=list(inputs),
                output_names=["faults"],
                dynamic_axes={name: axes[name] for name in (*inputs, "faults")},
                dynamo=False,
            )

    replace_atomically(Path(path), write)
    try:
        session = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    except Exception as error:
        raise InputError(f"{path}: the exported network cannot be read back ({error})") from error
    (got,) = session.run(None, dict(inputs))
    with torch.no_grad():
        reference = module(*tensors).numpy()
    difference = np.max(np.abs(got - reference), axis=0)
    return {
        "against_torch": float(np.max(difference / scale)),
        "against_float64": float(np.max(np.abs(got - exact) / scale)),
        **{f"against_torch_{name}": float(d) for name, d in zip(FAULT_NAMES, difference)},
    }

"""The network as C99, compiled and compared bit for bit with ONNX Runtime."""

import ctypes
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import onnxruntime
import pytest

from emafault.identification.c99 import write_c
from emafault.identification.export import export_onnx
from emafault.identification.settings import NetworkSettings, TrainingSettings
from emafault.identification.training import train

FLAGS = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]
#: ONNX Runtime fuses multiply-adds where the processor can
FUSED = not Path("/proc/cpuinfo").exists() or " fma " in Path("/proc/cpuinfo").read_text()
pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed (Debian's package gcc)")


def compiled(source):
    """The function of a file of C, over rows."""
    library = source.with_suffix(".so")
    subprocess.run(["gcc", *FLAGS, "-shared", "-fPIC", str(source), "-o", str(library), "-lm"], check=True)
    identify = ctypes.CDLL(str(library)).emafault_identify

    def rows(features):
        out = np.zeros((len(features), 6), np.float32)
        for x, y in zip(np.ascontiguousarray(features), out):
            identify(x.ctypes.data_as(ctypes.c_void_p), y.ctypes.data_as(ctypes.c_void_p))
        return out

    return rows


@pytest.mark.parametrize(
    ("activation", "coordinates", "layers"),
    [("tanh", "linear", 2), ("sigmoid", "linear", 1), ("relu", "linear", 1), ("tanh", "log", 1)],
)
def test_the_same_bits_as_onnx(make_set, tmp_path, activation, coordinates, layers):
    known, fresh = make_set(150, 1), make_set(400, 2)
    settings = NetworkSettings(layers=layers, width=9, activation=activation, coordinates=coordinates)
    network = train(known.features, known.faults, settings, TrainingSettings(epochs=20), seed=1).network
    x = fresh.features.astype(np.float32)
    export_onnx(network, tmp_path / "network.onnx", x)
    session = onnxruntime.InferenceSession(str(tmp_path / "network.onnx"), providers=["CPUExecutionProvider"])
    expected = session.run(None, {"features": x})[0]
    taken = write_c(network, tmp_path / "network.c")
    got = compiled(tmp_path / "network.c")(x)
    if FUSED and coordinates == "linear":
        assert got.tobytes() == expected.tobytes()
    else:  # logarithms differ by up to 3 units in the last place, see the module
        assert np.max(np.abs(got - expected) / network.scaler.fault_scale) < 2e-4
    text = (tmp_path / "network.c").read_text()
    numbers = re.findall(r"0x[0-9a-f.]+p[+-]\d+f", text)
    assert taken["constants"] == 4 * len(numbers) == 4 * (network.parameters + 24) and "malloc" not in text
    assert taken["logarithms"] == (6 if coordinates == "log" else 0)

"""The networks of an identifier as C99, compiled and compared bit for bit with ONNX Runtime."""

import ctypes
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import onnxruntime
import pytest

from emafault.errors import InputError
from emafault.faults import sample_faults
from emafault.identification.c99 import write_c
from emafault.identification.export import export_calibrated_onnx, export_onnx
from emafault.identification.fitting import HeldOut, Prior, Recipe, fit_identifier
from emafault.identification.posterior import nine_forward, nominal_nine
from emafault.identification.rows import TrainingRows
from emafault.identification.settings import NetworkSettings, TrainingSettings

from .conftest import RANGES

FLAGS = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]
#: ONNX Runtime fuses multiply-adds where the processor can
FUSED = not Path("/proc/cpuinfo").exists() or " fma " in Path("/proc/cpuinfo").read_text()
pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed (Debian's package gcc)")


def compiled(source):
    """The functions of a file of C, over rows: of units without and with healthy recordings."""
    library = source.with_suffix(".so")
    subprocess.run(["gcc", *FLAGS, "-shared", "-fPIC", str(source), "-o", str(library), "-lm"], check=True)
    loaded = ctypes.CDLL(str(library))

    def over_rows(function):
        def rows(*inputs):
            out = np.zeros((len(inputs[0]), 6), np.float32)
            for row in zip(*map(np.ascontiguousarray, inputs), out):
                function(*(x.ctypes.data_as(ctypes.c_void_p) for x in row))
            return out

        return rows

    return over_rows(loaded.emafault_identify), over_rows(loaded.emafault_identify_calibrated)


def by_onnx(path, **inputs):
    session = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    return session.run(None, inputs)[0]


def assert_same(got, expected, network):
    if FUSED and network.settings.coordinates == "linear":
        assert got.tobytes() == expected.tobytes()
    else:  # logarithms differ by up to 3 units in the last place, see the module
        assert np.max(np.abs(got - expected) / network.scaler.fault_scale) < 2e-4


def trained(rows, actuator, recipe):
    return fit_identifier(rows, Prior(actuator), recipe, HeldOut("split")).identifier


@pytest.mark.parametrize(
    ("activation", "coordinates", "layers"),
    [("tanh", "linear", 2), ("sigmoid", "linear", 1), ("relu", "linear", 1), ("tanh", "log", 1)],
)
def test_the_same_bits_as_onnx(make_set, actuator, tmp_path, activation, coordinates, layers):
    known, fresh = make_set(150, 1), make_set(400, 2)
    recipe = Recipe(NetworkSettings(layers, 9, activation, coordinates), TrainingSettings(epochs=20), seed=1)
    identifier = trained(TrainingRows(known.features, known.faults), actuator, recipe)
    network, x = identifier.network, fresh.features.astype(np.float32)
    units = (identifier.nominal_unit(6) * np.random.default_rng(3).uniform(0.97, 1.03, (400, 6))).astype(np.float32)
    export_onnx(identifier, tmp_path / "network.onnx", x)
    export_calibrated_onnx(identifier, tmp_path / "calibrated.onnx", x[:9], units[:9])
    taken = write_c(identifier, tmp_path / "network.c")
    identify, identify_calibrated = compiled(tmp_path / "network.c")
    assert_same(identify(x), by_onnx(tmp_path / "network.onnx", features=x), network)
    expected = by_onnx(tmp_path / "calibrated.onnx", features=x, unit=units)
    assert_same(identify_calibrated(x, units), expected, network)
    exact = identifier.predict(x.astype(float), unit=units.astype(float))
    assert np.max(np.abs(expected - exact) / network.scaler.fault_scale) < 2e-4
    text = (tmp_path / "network.c").read_text()
    numbers = re.findall(r"0x[0-9a-f.]+p[+-]\d+f", text)
    assert taken["constants"] == 4 * len(numbers) == 4 * (network.parameters + 24 + 6) and "malloc" not in text
    assert taken["identify"]["logarithms"] == (6 if coordinates == "log" else 0)
    assert taken["identify_calibrated"]["other_operations"] == taken["identify"]["other_operations"] + 12


@pytest.mark.parametrize("coordinates", ["linear", "log"])
def test_both_networks_of_nine_features(actuator, tmp_path, coordinates):
    rng = np.random.default_rng(1)
    noise, nominal = np.repeat([2e-3, 1e-3, 5e-4], 3), nominal_nine(actuator)

    def drawn(seed, runs=200):
        faults = sample_faults(runs, seed=seed, **RANGES)
        own = np.repeat(1.0 + rng.normal(size=(runs, 3)) * [0.01, 0.005, 0.03], 3, axis=1)
        nine = nine_forward(faults, actuator) * own * (1.0 + noise * rng.normal(size=(runs, 9)))
        return TrainingRows(nine, faults, np.diag(noise**2) * nine[:, :, None] * nine[:, None, :], nominal * own)

    recipe = Recipe(NetworkSettings(width=8, coordinates=coordinates), TrainingSettings(epochs=40))
    identifier, fresh = trained(drawn(1), actuator, recipe), drawn(2, 400)
    second = identifier.calibrated.network
    x, units = fresh.features.astype(np.float32), fresh.units.astype(np.float32)
    export_onnx(identifier, tmp_path / "network.onnx", x)
    difference = export_calibrated_onnx(identifier, tmp_path / "calibrated.onnx", x, units)
    assert difference["against_torch"] < 1e-4 and difference["against_float64"] < 2e-4
    taken = write_c(identifier, tmp_path / "network.c")
    identify, identify_calibrated = compiled(tmp_path / "network.c")
    without, beside = identify(x), identify_calibrated(x, units)
    assert_same(without, by_onnx(tmp_path / "network.onnx", features=x), identifier.network)
    assert_same(beside, by_onnx(tmp_path / "calibrated.onnx", features=x, unit=units), second)
    for row, unit in enumerate(units[:3]):  # one unit for all runs
        shared = by_onnx(tmp_path / "calibrated.onnx", features=x, unit=unit[None])
        assert_same(shared[row : row + 1], beside[row : row + 1], second)
    assert taken["constants"] == 4 * (9 + 2 * (identifier.parameters + 30))
    # each tells what its own identifier does: the unit's inductance tells the turns where it is known
    error = {name: np.mean(np.abs(found - fresh.faults)[:, :3]) for name, found in (("", without), ("own", beside))}
    assert error["own"] < 0.3 * error[""]


def test_a_closed_form_is_refused(make_set, actuator, tmp_path):
    known = make_set(50, 1)
    identifier = fit_identifier(TrainingRows(known.features, known.faults), Prior(actuator)).identifier
    with pytest.raises(InputError, match="accepted is an identifier with a network"):
        write_c(identifier, tmp_path / "network.c")
    assert not list(tmp_path.iterdir())

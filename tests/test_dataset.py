"""Datasets: the same numbers however they are shared out, readable run by run, refused in one line when damaged."""

import errno
import shutil
from types import SimpleNamespace

import netCDF4
import numpy as np
import pytest
import xarray as xr

from emafault import config, dataset
from emafault.actuator.parameters import ActuatorParameters
from emafault.errors import InputError
from emafault.io.atomic import replace_atomically
from emafault.progress import one_line_errors
from emafault.reconstruction import reconstruct
from emafault.study.features import join_features, read_features, reconstruct_features

RUNS = 11


def _spec(**changes):
    composed = config.compose("smoke", ["recording.duration=0.3", "recording.interval=0.001", f"sampling.fresh={RUNS}"])
    return config.dataset_spec(composed, "fresh") | {"runs": RUNS} | changes


def _write(folder, spec):
    paths = []
    for shard in range(spec["shards"]):
        paths.append(folder / f"{spec['shards']}" / f"shard_{shard}.nc")
        dataset.simulate_shard(paths[-1], spec, shard)
    return paths


def _join(paths):
    blocks = list(dataset.read_blocks(paths))
    assert [block.first_run for block in blocks] == list(np.cumsum([0, *(len(b.faults) for b in blocks)])[:-1])
    names = blocks[0].signals
    return {name: np.concatenate([b.signals[name] for b in blocks]) for name in names} | {
        "fault": np.concatenate([b.faults for b in blocks])
    }


def test_sharding_does_not_change_a_bit(tmp_path):
    one, three = _join(_write(tmp_path, _spec(shards=1))), _join(_write(tmp_path, _spec(shards=3)))
    assert len(one["fault"]) == RUNS
    for name, values in one.items():
        assert np.array_equal(values, three[name]), name


def test_block_size_does_not_change_a_bit(tmp_path, monkeypatch):
    one = _join(_write(tmp_path / "a", _spec(shards=1)))
    monkeypatch.setattr(dataset, "BLOCK", 4)
    four = _join(_write(tmp_path / "b", _spec(shards=1)))
    for name, values in one.items():
        assert np.array_equal(values, four[name]), name


def test_layout_units_and_configuration(tmp_path):
    (path,) = _write(tmp_path, _spec(shards=1))
    with netCDF4.Dataset(path) as file:
        voltage = file["phase_voltage"]
        assert voltage.dimensions == ("run", "phase", "time") and voltage.units == "V" and voltage.dtype == np.float32
        assert voltage.chunking() == [1, 3, 300]
        assert file["rotor_speed"].units == "rad/s"
        assert '"duration": 0.3' in file.configuration and "emafault" in file.software
    assert not list(path.parent.glob(".*"))


def test_one_run_is_read_alone_as_a_recording(tmp_path):
    paths = _write(tmp_path, _spec(shards=3))
    every = _join(paths)
    recording = dataset.read_run(paths, 7)
    assert np.array_equal(recording.fault, every["fault"][7])
    assert np.array_equal(recording.phase_current, every["phase_current"][7])
    with pytest.raises(InputError, match="no such run"):
        dataset.read_run(paths, RUNS)


def test_units_of_a_reference_are_those_of_the_fresh_part():
    spec = config.compose("unit_tolerance", ["unit.reference_recordings=2", "sampling.fresh=20"])
    fresh = dataset.sample_runs(config.dataset_spec(spec, "fresh")).records(slice(None))
    sample = dataset.sample_runs(config.dataset_spec(spec, "reference"))
    reference, faults = sample.records(slice(None)), sample.faults
    assert np.array_equal(sample.records(slice(7, 9)), reference[7:9])
    assert np.all(faults[:, :5] == 0.0) and len(np.unique(faults[:, 5])) == 40
    assert np.array_equal(reference["unit_calibration_R_scale"], np.repeat(fresh["unit_calibration_R_scale"], 2))
    assert 0.003 < np.std(fresh["unit_calibration_R_scale"]) < 0.03


def test_magnets_lag_by_the_configured_range():
    spec = config.dataset_spec(config.compose("magnet_lagging"), "training")
    runs = dataset.sample_runs(spec).records(slice(None))
    lag = runs["dT"] - runs["dT_magnet"]
    assert 0.0 <= lag.min() < 2.0 and 38.0 < lag.max() <= 40.0
    assert np.all(runs["magnet_temperature_alpha_m"] == -4e-4)


@pytest.mark.parametrize("damage", ["truncated", "garbage", "foreign", "missing"])
@pytest.mark.parametrize("reader", [lambda path: list(dataset.read_blocks([path])), read_features])
def test_damaged_files_are_refused_in_one_line(tmp_path, damage, reader):
    path = tmp_path / "shard_0.nc"
    if damage == "truncated":
        (good,) = _write(tmp_path, _spec(shards=1))
        path.write_bytes(good.read_bytes()[: good.stat().st_size // 2])
    elif damage == "garbage":
        path.write_text("not netCDF")
    elif damage == "foreign":
        with netCDF4.Dataset(path, "w") as file:
            file.createDimension("x", 3)
            file.createVariable("temperature", "f8", ("x",))[:] = 1.0
    with pytest.raises(InputError) as refused:
        reader(path)
    assert str(path) in str(refused.value) and "\n" not in str(refused.value)


def test_a_folder_that_cannot_be_written_is_refused_and_nothing_is_left(tmp_path):
    (tmp_path / "blocked").write_text("a file where a folder should be")
    with pytest.raises(InputError, match="cannot be written"):
        dataset.simulate_shard(tmp_path / "blocked" / "shard_0.nc", _spec(shards=1), 0)
    assert [p.name for p in tmp_path.iterdir()] == ["blocked"]


@pytest.mark.parametrize("method", ["weighted", "angle_resolved", "nine"])
def test_features_written_block_by_block_are_those_of_all_runs_at_once(tmp_path, monkeypatch, method):
    monkeypatch.setattr(dataset, "BLOCK", 2)
    shards = _write(tmp_path, _spec(shards=2))
    chosen = config.compose("rotor_angle_eccentricity", ["reconstruction=[weighted,angle_resolved,nine]"])
    spec = config.reconstruction_spec(chosen, method)
    reconstruct_features([str(path) for path in shards], spec, tmp_path / "features.nc")
    settings = {key: value for key, value in spec["settings"].items() if key != "method"}
    whole = reconstruct(method, _join(shards), 1e-3, ActuatorParameters(**spec["actuator"]), settings)
    table = read_features(tmp_path / "features.nc")
    np.testing.assert_array_equal(table.features.six, whole.six)
    np.testing.assert_array_equal(table.features.covariance, whole.covariance)
    np.testing.assert_array_equal(table.inputs, whole.inputs)
    np.testing.assert_array_equal(table.features.inputs_covariance, whole.inputs_covariance)
    if method == "angle_resolved":
        np.testing.assert_array_equal(table.inputs[:, 6:], whole.extras["xi"])
    for n, shard in enumerate(shards):
        reconstruct_features([str(shard)], spec, tmp_path / f"block_{n}.nc")
    join_features([tmp_path / "block_0.nc", tmp_path / "block_1.nc"], tmp_path / "joined.nc")
    xr.testing.assert_identical(xr.load_dataset(tmp_path / "joined.nc"), xr.load_dataset(tmp_path / "features.nc"))


def test_a_full_disk_ends_in_one_line_though_the_log_cannot_be_written_either(capsys):
    with pytest.raises(SystemExit), one_line_errors("/dev/full"):
        raise OSError(errno.ENOSPC, "No space left on device", "results/a.nc")
    assert capsys.readouterr().err == "emafault: results/a.nc: cannot be used (No space left on device)\n"


def test_a_full_disk_is_named_where_the_library_does_not(tmp_path, monkeypatch):
    def write(temporary):
        temporary.write_text("half")
        raise RuntimeError("NetCDF: HDF error")

    monkeypatch.setattr(shutil, "disk_usage", lambda folder: SimpleNamespace(free=0))
    (tmp_path / "a.nc").write_text("made before")
    with pytest.raises(InputError, match=r"a.nc: cannot be written \(No space left on device\)$"):
        replace_atomically(tmp_path / "a.nc", write)
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [("a.nc", "made before")]

"""Features of a part of a dataset: reconstructed from its shards, kept in one netCDF file."""

import contextlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..dataset import BLOCK, count_runs, read_blocks
from ..errors import InputError
from ..faults import FAULT_NAMES
from ..io.atomic import replace_atomically
from ..io.recording import PHASES
from ..places import file_at
from ..progress import progress
from ..reconstruction import Features, reconstruct

_UNITS = {"R": "ohm", "k": "V s/rad", "L": "H", "offset": "V"}
_SIGNALS = ("phase_voltage", "phase_current", "phase_current_end", "rotor_speed", "rotor_angle", "bus_voltage")


@dataclass(frozen=True)
class FeatureTable:
    """Features of many runs with what is known of each run."""

    features: Features
    faults: np.ndarray  # (run, 6)
    ambient_temperature: np.ndarray  # (run,) degC, measured

    @property
    def inputs(self) -> np.ndarray:
        """What is identified from, see ``Features.inputs``."""
        return self.features.inputs

    @property
    def covariance(self) -> np.ndarray | None:
        """(run, 6, 6) of R and k, or (run, 9, 9) with L; None where the method gives none."""
        covariance = self.features.inputs_covariance
        known = self.features.identified
        return covariance if np.any(known) and np.all(np.isfinite(covariance[known])) else None

    @property
    def known(self) -> np.ndarray:
        """(run,) whether the record held enough to estimate all features."""
        return np.all(np.isfinite(self.inputs), axis=1)

    def identified(self) -> "FeatureTable":
        """The runs whose records held enough to estimate all features."""
        known = self.known
        return self if np.all(known) else self.rows(known)

    def rows(self, rows: np.ndarray) -> "FeatureTable":
        """Some of the runs."""
        f = self.features
        extras = {name: values[rows] for name, values in f.extras.items()}
        kept = Features(f.R[rows], f.k[rows], f.L[rows], f.offset[rows], f.covariance[rows], extras)
        return FeatureTable(kept, self.faults[rows], self.ambient_temperature[rows])


def reconstruct_features(shards: Sequence[str], spec: Mapping[str, Any], output: str | Path) -> None:
    """Reconstruct every run of a part by one method.

    Parameters
    ----------
    spec : the sub-tree ``config.reconstruction_spec``

    Raises
    ------
    InputError : shards that cannot be read, or no run that determines the features
    """
    settings = dict(spec["settings"])
    method, actuator = settings.pop("method"), ActuatorParameters(**spec["actuator"])
    runs = count_runs(shards)

    def tables() -> Iterator[FeatureTable]:
        for block in progress(read_blocks(shards, _SIGNALS), f"reconstruct {Path(output).stem}", -(-runs // BLOCK)):
            found = reconstruct(method, block.signals, block.interval, actuator, settings)
            yield FeatureTable(found, block.faults, block.signals["ambient_temperature"])

    write_features(output, tables(), runs)


def write_features(path: str | Path, tables: Iterable[FeatureTable], runs: int) -> None:
    """Write tables of features one after the other into one netCDF file of ``runs`` runs; none is kept in memory.

    Raises
    ------
    InputError : the file cannot be written
    """
    import netCDF4

    def write(temporary: Path) -> None:
        with netCDF4.Dataset(temporary, "w", format="NETCDF4") as file:
            first = 0
            for table in tables:
                values = _variables(table)
                if not first:
                    _create(file, values, runs)
                for name, (_, array, _) in values.items():
                    file[name][first : first + len(array)] = array
                first += len(table.faults)

    replace_atomically(Path(path), write)


def join_features(paths: Sequence[str | Path], output: str | Path) -> None:
    """Write files of features as one, one after the other; the runs of one of them are in memory at a time.

    Raises
    ------
    InputError : a file that cannot be read or written
    """
    import netCDF4

    def write(temporary: Path) -> None:
        with netCDF4.Dataset(temporary, "w", format="NETCDF4") as joined:
            first = 0
            for path in paths:
                with netCDF4.Dataset(file_at(path)) as part:
                    part.set_auto_mask(False)
                    if not first:
                        _create_like(joined, part, sum(runs_in(p) for p in paths))
                    for name, variable in part.variables.items():
                        if variable.dimensions[0] == "run":
                            joined[name][first : first + len(variable)] = variable[:]
                    first += len(part.dimensions["run"])

    replace_atomically(Path(output), write)


def _create_like(joined, part, runs: int) -> None:
    """The dimensions, variables and attributes of a file of features, with so many runs."""
    joined.setncatts({key: part.getncattr(key) for key in part.ncattrs()})
    for name, dimension in part.dimensions.items():
        joined.createDimension(name, runs if name == "run" else len(dimension))
    for name, variable in part.variables.items():
        made = joined.createVariable(name, variable.dtype, variable.dimensions, fill_value=False)
        made.setncatts({key: variable.getncattr(key) for key in variable.ncattrs()})
        if variable.dimensions[0] != "run":
            made[:] = variable[:]


def _variables(table: FeatureTable) -> dict[str, tuple[tuple[str, ...], np.ndarray, dict[str, str]]]:
    """Name -> dimensions, values and attributes of everything that is kept of a table."""
    f = table.features
    variables: dict[str, tuple[tuple[str, ...], np.ndarray, dict[str, str]]] = {
        name: (("run", "phase"), getattr(f, name), {"units": unit}) for name, unit in _UNITS.items()
    }
    variables["covariance"] = (("run", "feature", "feature_"), f.covariance, {"long_name": "of R and k, SI"})
    variables["fault"] = (("run", "component"), table.faults, {})
    variables["ambient_temperature"] = (("run",), table.ambient_temperature, {"units": "degC"})
    for name, values in f.extras.items():
        if values.size:
            variables[f"extra_{name}"] = (("run", *(f"{name}_{n}" for n in range(1, values.ndim))), values, {})
    return variables


def _create(file, variables: Mapping[str, tuple[tuple[str, ...], np.ndarray, dict[str, str]]], runs: int) -> None:
    """Dimensions with their labels, variables and attributes of a file of features."""
    features = [f"{quantity}_{phase}" for quantity in "Rk" for phase in PHASES]
    labels = {"phase": PHASES, "component": FAULT_NAMES, "feature": features, "feature_": features}
    file.setncatts({"title": "reconstructed phase parameters", "Conventions": "CF-1.11"})
    file.createDimension("run", runs)
    for name, words in labels.items():
        file.createDimension(name, len(words))
        variable = file.createVariable(name, str, (name,))
        for j, word in enumerate(words):
            variable[j] = word
    for name, (dimensions, array, attributes) in variables.items():
        for dimension, size in zip(dimensions, array.shape):
            if dimension not in file.dimensions:
                file.createDimension(dimension, size)
        file.createVariable(name, array.dtype, dimensions, fill_value=False).setncatts(attributes)


def read_features(path: str | Path) -> FeatureTable:
    """Read what ``write_features`` wrote; of the extras only what is identified from.

    Raises
    ------
    InputError : no such file, or not one of these
    """
    with _opened(path) as file:
        return _read(file, slice(None))


def read_features_in_blocks(path: str | Path, size: int) -> Iterator[FeatureTable]:
    """The same, so many runs at a time.

    Raises
    ------
    InputError : no such file, or not one of these
    """
    with _opened(path) as file:
        for first in range(0, len(file.dimensions["run"]), size):
            yield _read(file, slice(first, first + size))


def runs_in(path: str | Path) -> int:
    """How many runs a file of features holds.

    Raises
    ------
    InputError : no such file, or not one of these
    """
    with _opened(path) as file:
        return len(file.dimensions["run"])


@contextlib.contextmanager
def _opened(path: str | Path) -> Iterator[Any]:
    import netCDF4

    if not Path(path).is_file():
        raise InputError(f"{path}: no such file")
    try:
        with netCDF4.Dataset(path) as file:
            file.set_auto_mask(False)
            yield file
    except (OSError, RuntimeError, KeyError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path}: not a readable table of features ({error})") from error


def _read(file, rows: slice) -> FeatureTable:
    data = file.variables
    kept = [name for name in ("xi", "nine_covariance") if f"extra_{name}" in data]
    extras = {name: data[f"extra_{name}"][rows] for name in kept}
    R, k, L, offset, covariance = (data[n][rows] for n in (*_UNITS, "covariance"))
    features = Features(R, k, L, offset, covariance, extras)
    return FeatureTable(features, data["fault"][rows], data["ambient_temperature"][rows])

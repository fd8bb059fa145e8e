"""netCDF and plain HDF5."""

from pathlib import Path

import numpy as np

from ...units import factor
from . import dataset
from .frame import is_time


def read(path: Path):
    """Channels of a netCDF or HDF5 file and its groups: vectors, and the rows of arrays whose last axis is the time."""
    import xarray as xr

    groups: dict[str, tuple[np.ndarray | None, dict]] = {}
    for group, found in xr.open_groups(path, engine="netcdf4", decode_times=False).items():
        above = f"{group.strip('/')}/" if group != "/" else ""
        for name, variable in found.variables.items():
            if variable.dtype.kind not in "fiu" or not variable.ndim or variable.size < 2:
                continue
            key, unit = f"{above}{variable.dims[-1]}", str(variable.attrs.get("units", variable.attrs.get("unit", "")))
            time, channels = groups.get(key, (None, {}))
            values = variable.to_numpy()
            if values.ndim == 1 and is_time(str(name)):
                groups[key] = values * factor(unit.split(" since ")[0] or "s", "s", str(name)), channels
                continue
            rows = {f"{above}{name}": values} if values.ndim == 1 else _rows(f"{above}{name}", found, variable)
            groups[key] = time, {**channels, **{n: (v, unit) for n, v in rows.items()}}
    return dataset(groups)


def _rows(name: str, found, variable) -> dict[str, np.ndarray]:
    """Rows of an array, named by the labels of its first axis where it has any."""
    axis = variable.dims[0]
    labels = found[axis].to_numpy() if axis in found.coords else np.arange(variable.shape[0])
    values = variable.to_numpy().reshape(len(labels), -1, variable.shape[-1])
    return {f"{name}({label})": row[0] for label, row in zip(labels, values) if row.shape[0] == 1}

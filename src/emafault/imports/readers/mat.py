"""MATLAB files, v5 and v7.3; MATLAB keeps no units."""

from pathlib import Path

import numpy as np

from . import dataset
from .frame import is_time


def read(path: Path):
    """Channels of a MAT file: numeric vectors; those of one structure and length share its vector of times."""
    from pymatreader import read_mat

    groups: dict[str, tuple[np.ndarray | None, dict]] = {}
    for name, values in _vectors(read_mat(str(path)), ""):
        group = f"{name.rpartition('/')[0] or 'samples'}:{len(values)}"
        time, channels = groups.get(group, (None, {}))
        groups[group] = (values, channels) if is_time(name) else (time, {**channels, name: (values, "")})
    return dataset(groups)


def _vectors(content, above: str):
    """Yield (path in the file, vector) of every numeric vector; the columns of a matrix one by one."""
    for key, value in content.items():
        name = f"{above}/{key}" if above else key
        if isinstance(value, dict):
            yield from _vectors(value, name)
            continue
        array = np.asarray(value)
        if key.startswith("__") or array.dtype.kind not in "fiub" or array.size < 2:
            continue
        array = array.squeeze()
        if array.ndim == 1:
            yield name, array
        elif array.ndim == 2:
            columns = array if array.shape[0] >= array.shape[1] else array.T
            yield from ((f"{name}({k + 1})", column) for k, column in enumerate(columns.T))

"""Readers of measurement files: one file a format, chosen by the file's extension.

A reader has ``read(path)`` and returns an ``xarray.Dataset``: channels are one-dimensional variables with their unit in
``units`` ("" where the file has none); channels sampled together share a dimension, and its coordinate, where there is
one, is their time in seconds.
"""

import importlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ...errors import InputError

#: extension -> module here, and the extra that installs its library
READERS = {
    ".csv": ("text", "import"), ".tsv": ("text", "import"), ".txt": ("text", "import"),
    ".csv.gz": ("text", "import"), ".tsv.gz": ("text", "import"), ".txt.gz": ("text", "import"),
    ".npz": ("npz", "import"),
    ".parquet": ("parquet", "parquet"), ".mat": ("mat", "mat"), ".tdms": ("tdms", "tdms"),
    ".mf4": ("mdf", "mdf"), ".mdf": ("mdf", "mdf"), ".bag": ("ros", "ros"), ".mcap": ("ros", "ros"),
    ".nc": ("netcdf", "import"), ".h5": ("netcdf", "import"), ".hdf5": ("netcdf", "import"),
}  # fmt: skip
INSTEAD = {
    ".xlsx": "save the sheet as CSV", ".xls": "save the sheet as CSV", ".ods": "save the sheet as CSV",
    ".trc": "save the waveform as CSV on the oscilloscope", ".wfm": "save the waveform as CSV on the oscilloscope",
    ".isf": "save the waveform as CSV on the oscilloscope", ".bin": "save the waveform as CSV on the oscilloscope",
    ".psdata": "save the waveform as CSV or MAT in PicoScope", ".slx": "log to a .mat file", ".tdm": "save as TDMS",
    ".blf": "convert it to MF4 with its database", ".asc": "convert it to MF4 with its database",
    ".dat": "convert it to MF4 or CSV", ".ulg": "convert it to CSV",
    ".npy": "save it as .npz, HDF5 or CSV", ".json": "save it as CSV or Parquet", ".zip": "unpack it",
    ".gz": "unpack it",
}  # fmt: skip


def read_raw(path: str | Path):
    """Every numeric channel of a file as an ``xarray.Dataset``; a folder is read as a ROS 2 bag.

    Raises
    ------
    InputError : a file that is missing, damaged, of an unknown format or without numbers, or an extra that is not
        installed
    """
    path = Path(path)
    if not path.exists():
        raise InputError(f"{path}: no such file")
    suffix = ".mcap" if path.is_dir() else path.suffix.lower()
    packed = "".join(path.suffixes[-2:]).lower()
    suffix = packed if packed in READERS else suffix
    if suffix in INSTEAD:
        raise InputError(f"{path}: {suffix} cannot be read; {INSTEAD[suffix]}")
    if suffix not in READERS:
        raise InputError(f"{path}: no reader for '{suffix}', there are readers for {', '.join(READERS)}")
    module, extra = READERS[suffix]
    try:
        found = importlib.import_module(f".{module}", __name__).read(path)
    except ImportError as error:
        raise InputError(f"{path}: needs {error.name}, which emafault[{extra}] installs") from error
    except InputError:
        raise
    except Exception as error:  # libraries of many authors raise what they like on a damaged file
        raise InputError(f"{path}: cannot be read as {suffix} ({type(error).__name__}: {error})") from error
    if not found.data_vars:
        raise InputError(f"{path}: holds no numeric channel")
    return found


def dataset(groups: Mapping[str, tuple[np.ndarray | None, Mapping[str, tuple[np.ndarray, str]]]]):
    """Dataset of groups of channels: group -> time (sample,) in seconds or None, and channel -> values and unit."""
    import xarray as xr

    variables, times = {}, {}
    for group, (time, channels) in groups.items():
        if time is not None:
            times[group] = (group, np.asarray(time, float))
        for name, (values, unit) in channels.items():
            variables[name] = (group, np.asarray(values, float), {"units": unit})
    return xr.Dataset(variables, times)

"""From a table of columns to channels: units in the names of columns, and the column that is the time."""

import re

import numpy as np

from ...units import factor
from . import dataset

_WITH_UNIT = re.compile(r"^\s*(.*?)\s*[\[(]\s*([^\[\]()]*)\s*[\])]\s*$")
TIME_NAMES = ("time", "t", "zeit", "temps", "timestamp", "seconds", "sec", "time axis", "x")


def name_and_unit(text: str) -> tuple[str, str]:
    """``speed [rad/s]`` or ``speed (rad/s)`` -> name and unit."""
    found = _WITH_UNIT.match(text)
    return (found[1] or text.strip(), found[2]) if found else (text.strip(), "")


def is_time(name: str) -> bool:
    """Whether a column's name says that it is the time."""
    return name.lower().split("/")[-1].rstrip("_s").rstrip() in TIME_NAMES or name.lower() in TIME_NAMES


def from_frame(frame, units=None):
    """Dataset of the numeric columns of a data frame; the first column named as a time is the time base."""
    import pandas as pd

    time, channels = None, {}
    for column in frame.columns:
        values = frame[column]
        name, unit = name_and_unit(str(column))
        unit = (units or {}).get(column, unit)
        if time is None and is_time(name):
            if not pd.api.types.is_numeric_dtype(values):
                if not pd.api.types.is_datetime64_any_dtype(values):
                    # some loggers write the milliseconds behind a third colon
                    values = values.astype(str).str.replace(r"(:\d\d:\d\d):(\d+)$", r"\1.\2", regex=True)
                stamps = pd.to_datetime(values)
                time = (stamps - stamps.iloc[0]).dt.total_seconds().to_numpy()
            else:
                time = values.to_numpy(float) * factor(unit or "s", "s", str(column))
        elif pd.api.types.is_numeric_dtype(values) and not values.isna().all():
            channels[name] = values.to_numpy(np.float64, na_value=np.nan), unit
    return dataset({"time": (time, channels)})


def from_arrays(content):
    """Dataset of the numeric vectors in nested arrays; those of one level and length share its vector of times."""
    groups: dict[str, tuple[np.ndarray | None, dict]] = {}
    for name, values in _vectors(content, ""):
        group = f"{name.rpartition('/')[0] or 'samples'}:{len(values)}"
        time, channels = groups.get(group, (None, {}))
        first = time is None and is_time(name)  # a later one, as x beside t, is a channel
        groups[group] = (values, channels) if first else (time, {**channels, name: (values, "")})
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

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
                stamps = pd.to_datetime(values)
                time = (stamps - stamps.iloc[0]).dt.total_seconds().to_numpy()
            else:
                time = values.to_numpy(float) * factor(unit or "s", "s", str(column))
        elif pd.api.types.is_numeric_dtype(values) and not values.isna().all():
            channels[name] = values.to_numpy(np.float64, na_value=np.nan), unit
    return dataset({"time": (time, channels)})

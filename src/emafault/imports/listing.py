"""What a file holds: its channels with units, rates and ranges."""

from pathlib import Path

import numpy as np

from .readers import read_raw

HEADER = ("channel", "unit", "samples", "rate", "from", "to")


def listed(path: str | Path) -> list[tuple[str, ...]]:
    """Rows of the channels of a file, under ``HEADER``.

    Raises
    ------
    InputError : a file that cannot be read
    """
    found = read_raw(path)
    rows: list[tuple[str, ...]] = []
    for name, channel in found.data_vars.items():
        axis, values = channel.dims[0], channel.to_numpy()
        rate = "no times"
        if axis in found.coords and channel.size > 1:
            time = found[axis].to_numpy()
            rate = f"{(channel.size - 1) / (time[-1] - time[0]):.6g} Hz" if time[-1] > time[0] else "times stand still"
        low, high = (np.nanmin(values), np.nanmax(values)) if np.isfinite(values).any() else (np.nan, np.nan)
        rows.append((str(name), channel.attrs["units"] or "none", str(channel.size), rate, f"{low:.4g}", f"{high:.4g}"))
    return rows


def as_text(rows: list[tuple[str, ...]]) -> str:
    """A table in lines."""
    table = [HEADER, *rows]
    width = [max(len(row[k]) for row in table) for k in range(len(HEADER))]
    return "\n".join("  ".join(cell.ljust(w) for cell, w in zip(row, width)).rstrip() for row in table)

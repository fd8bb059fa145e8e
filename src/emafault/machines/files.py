"""Readers of tables and arrays, which refuse in one line what cannot be used, and their writer."""

import csv
import gzip
import io
import zipfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..errors import InputError
from .statement import Arrays


def read_columns(path: Path, required: Sequence[str]) -> Arrays:
    """Numeric columns of a CSV file, plain or gzip; a cell that is no number becomes NaN.

    Raises
    ------
    InputError
        when the file cannot be read or a required column is missing.
    """
    table = read_table(path)
    missing = [name for name in required if name not in table]
    if missing:
        raise InputError(f"{path}: column {missing[0]!r} is missing; needed are {', '.join(required)}")
    return {name: to_numbers(cells) for name, cells in table.items()}


def read_table(path: Path) -> dict[str, list[str]]:
    """Columns of a CSV file as text (first line names them).

    Raises
    ------
    InputError
        when the file is absent, not text, empty, or has no rows.
    """
    try:
        raw = Path(path).read_bytes()
        text = (gzip.decompress(raw) if raw[:2] == b"\x1f\x8b" else raw).decode("utf-8-sig")
    except (OSError, EOFError, UnicodeDecodeError) as problem:
        raise InputError(f"{path}: cannot be read as a CSV file ({problem})") from None
    rows = list(csv.reader(io.StringIO(text)))
    if len(rows) < 2:
        raise InputError(f"{path}: no rows; a header line and data are needed")
    header = rows[0]
    body = [row for row in rows[1:] if row]
    for number, row in enumerate(body, start=2):
        if len(row) != len(header):
            raise InputError(f"{path}: line {number} has {len(row)} cells, the header {len(header)}")
    return {name: [row[k] for row in body] for k, name in enumerate(header)}


def to_numbers(cells: Sequence[str]) -> np.ndarray:
    """(row,) float64, NaN where the text is no number."""

    def number(text: str) -> float:
        try:
            return float(text)
        except ValueError:
            return np.nan

    return np.array([number(text) for text in cells])


def read_arrays(path: Path) -> Arrays:
    """Arrays of an .npz file.

    Raises
    ------
    InputError
        when the file is not a readable .npz of numbers.
    """
    try:
        with np.load(path, allow_pickle=False) as store:
            return {name: np.asarray(store[name], float) for name in store.files}
    except (OSError, ValueError, EOFError, AttributeError, zipfile.BadZipFile) as problem:
        raise InputError(f"{path}: cannot be read as an .npz file of numbers ({problem})") from None


def write_columns(path: Path, columns: Arrays) -> None:
    """Write columns as an .npz file, or as gzip CSV in which a single number () stands in every row."""
    if path.suffix == ".npz":
        np.savez_compressed(path, **columns)  # type: ignore[arg-type]  # numpy takes a keyword of another type too
        return
    cells = [
        ["" if np.isnan(x) else repr(x) for x in values.tolist()] for values in np.broadcast_arrays(*columns.values())
    ]
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([list(columns), *zip(*cells, strict=True)])
    path.write_bytes(gzip.compress(text.getvalue().encode(), mtime=0))


def require_finite(path: object, arrays: Arrays, names: Sequence[str], rows: int) -> None:
    """Check that these columns are finite, equally long and have at least ``rows`` rows.

    Raises
    ------
    InputError
        naming the column and the first bad row.
    """
    for name in names:
        values = arrays[name]
        if values.shape[0] < rows:
            raise InputError(f"{path}: {name!r} has {values.shape[0]} rows, at least {rows} are needed")
        if values.shape[0] != arrays[names[0]].shape[0]:
            raise InputError(f"{path}: {name!r} and {names[0]!r} differ in length")
        bad = ~np.isfinite(values.reshape(values.shape[0], -1)).all(axis=1)
        if bad.any():
            raise InputError(f"{path}: {name!r} is not a finite number in row {int(np.argmax(bad)) + 1}")

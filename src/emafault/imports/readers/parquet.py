"""Parquet tables."""

from pathlib import Path

from .frame import from_frame


def read(path: Path):
    """Channels of a Parquet file; units stand in the names of columns or in a column's metadata as ``unit``."""
    import pyarrow.parquet as pq

    table = pq.read_table(path)
    said = {f.name: (f.metadata or {}) for f in table.schema}
    units = {
        name: (m.get(b"units") or m[b"unit"]).decode() for name, m in said.items() if m.keys() & {b"unit", b"units"}
    }
    return from_frame(table.to_pandas(), units)

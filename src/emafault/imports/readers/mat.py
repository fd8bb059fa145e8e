"""MATLAB files, v5 and v7.3; MATLAB keeps no units."""

from pathlib import Path

from .frame import from_arrays


def read(path: Path):
    """Channels of a MAT file: numeric vectors; those of one structure and length share its vector of times."""
    from pymatreader import read_mat

    return from_arrays(read_mat(str(path)))

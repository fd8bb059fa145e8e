"""Archives of NumPy, which keep no units."""

from pathlib import Path

import numpy as np

from .frame import from_arrays


def read(path: Path):
    """Channels of an archive: numeric vectors and columns of matrices; those of one length share their times."""
    with np.load(path, allow_pickle=False) as content:
        return from_arrays(content)

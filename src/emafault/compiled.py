"""One decorator for everything that numba compiles, with a cache that knows every source it depends on."""

import hashlib
import os
from pathlib import Path
from typing import Any

from .paths import CACHE, EFFECTS, PACKAGE

_SOURCES = [
    Path(__file__).resolve(),
    *sorted((PACKAGE / "actuator").glob("*.py")),
    *sorted(EFFECTS.glob("*.yaml")),
]


def source_digest() -> str:
    """Digest of the sources and of the catalogue that the compiled code depends on."""
    digest = hashlib.sha256()
    for path in _SOURCES:
        digest.update(path.name.encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:16]


# numba invalidates a cached function by the time of its own file only; a folder per digest covers its callees too.
# It must be set before numba is imported, and never overrides what the user has set.
os.environ.setdefault("NUMBA_CACHE_DIR", str(CACHE / source_digest()))

import numba  # noqa: E402
import numpy as np  # noqa: E402

numba.config.CACHE_DIR = os.environ["NUMBA_CACHE_DIR"]  # type: ignore[attr-defined]
OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "fastmath": {"contract", "nsz", "arcp"}}
compiled = numba.njit(cache=True, **OPTIONS)
compiled_inline = numba.njit(cache=True, forceinline=True, **OPTIONS)  # into its one caller, whose arrays it takes


def attributed(records: np.ndarray) -> np.ndarray:
    """Structured array whose records have their fields as attributes, which compiled code gives them anyway."""
    return records.view(np.recarray) if numba.config.DISABLE_JIT else records  # type: ignore[attr-defined]

"""Where configuration, example and results are: of a clone beside the sources, of an installed package in it and in the
working folder."""

import os
from pathlib import Path

#: what can be made again: compiled code, digests of sources
CACHE = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "emafault"
PACKAGE = Path(__file__).resolve().parent
_CLONE = PACKAGE.parents[1]
_CLONED = (_CLONE / "conf" / "config.yaml").is_file()

CONF = _CLONE / "conf" if _CLONED else PACKAGE / "conf"
EFFECTS = CONF / "effect"
EXAMPLE = _CLONE / "examples" / "bench" if _CLONED else PACKAGE / "example"


def results_folder() -> Path:
    """``results`` here, else that of the clone."""
    here = Path("results")
    return here if here.is_dir() or not _CLONED else _CLONE / "results"

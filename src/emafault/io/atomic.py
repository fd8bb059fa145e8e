"""Files written whole or not at all."""

import contextlib
import glob
import os
import shutil
from pathlib import Path

from ..errors import InputError, shown
from ..places import refuse_irregular

_FULL = 2**20  # bytes; a disk with less is a full one


def replace_atomically(path: Path, write) -> None:
    """Write through a temporary name beside ``path`` and rename, so that a killed job leaves no half file.

    Raises
    ------
    InputError : a link, a device or a folder stands there, the folder cannot be written or the disk is full
    """
    refuse_irregular(path)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _remove_abandoned(path)
        write(temporary)
        os.replace(temporary, path)
    except OSError as error:
        raise InputError(f"{shown(path)}: cannot be written ({error.strerror or error})") from error
    except RuntimeError as error:  # how the netCDF library reports a full disk, among other things
        full = shutil.disk_usage(path.parent).free < _FULL
        raise InputError(
            f"{shown(path)}: cannot be written ({'No space left on device' if full else error})"
        ) from error
    finally:
        with contextlib.suppress(OSError):  # nothing to remove where nothing could be written
            temporary.unlink(missing_ok=True)


def _remove_abandoned(path: Path) -> None:
    """Remove what processes that were killed while writing ``path`` left behind."""
    for part in path.parent.glob(f".{glob.escape(path.name)}.*.part"):
        process = part.suffixes[-2].removeprefix(".")
        if process.isdigit() and not Path(f"/proc/{process}").exists():
            part.unlink(missing_ok=True)


def write_text(path: str | Path, text: str) -> None:
    """Write a text file, whole or not at all.

    Raises
    ------
    InputError : the file cannot be written
    """
    replace_atomically(Path(path), lambda temporary: temporary.write_text(text, encoding="utf-8"))

"""Paths that users give: what stands there, and whether something may be written there.

An output never takes the place of what was read, of a link, a device or a folder, and of an existing file only when
asked to. All of that is refused before the work whose result is to be written.
"""

import os
import stat
import tempfile
from collections.abc import Iterable
from pathlib import Path

from .errors import InputError, shown

LONGEST_NAME, LONGEST_PATH = 255, 4095  # bytes
LONGEST_STEM = 150  # characters of a name that is made of another
TEMPORARY = 45  # bytes that the name of a file has more while it is written


def kind(path: str | Path, what: str = "") -> str:
    """``file``, ``folder``, ``device`` (pipes and sockets too) or, where there is nothing, an empty string.

    Parameters
    ----------
    what : key or option that gives the path, which messages begin with

    Raises
    ------
    InputError : a path that no file can have, or that may not be looked at
    """
    _check_name(path, what)
    try:
        mode = os.stat(path).st_mode
    except (FileNotFoundError, NotADirectoryError):
        return ""
    except OSError as error:
        raise InputError(f"{_named(path, what)}: cannot be read ({error.strerror})") from error
    return "file" if stat.S_ISREG(mode) else "folder" if stat.S_ISDIR(mode) else "device"


def file_at(path: str | Path, what: str = "") -> Path:
    """The path of a file that is there.

    Raises
    ------
    InputError : there is none, or something else
    """
    found = kind(path, what)
    if found != "file":
        reason = f"is a {found}, accepted is a file" if found else "no such file"
        raise InputError(f"{_named(path, what)}: {reason}")
    return Path(path)


def refuse_output(path: str | Path, what: str = "", *, read: Iterable[str | Path] = (), force: bool = False) -> None:
    """Refuse a file that may not be written, before the work whose result it is to hold.

    Parameters
    ----------
    what : key or option that gives the path
    read : files that the work reads, which are never replaced
    force : whether another existing file may be replaced

    Raises
    ------
    InputError : a link, a device, a folder, a file that is read or exists, or a place that cannot be written
    """
    path = Path(path)
    _check_name(path, what, TEMPORARY)
    refuse_irregular(path, what)
    if kind(path, what):
        for other in read:
            if kind(other) and os.path.samefile(path, other):
                raise InputError(f"{_named(path, what)}: is read by this command, accepted is another file")
        if not force:
            raise InputError(f"{_named(path, what)}: exists already, --force replaces it")
    _refuse_unwritable(path, path.parent, what)


def refuse_irregular(path: Path, what: str = "") -> None:
    """Refuse to put a file where a link, a device or a folder stands.

    Raises
    ------
    InputError : naming what stands there
    """
    found = "link" if path.is_symlink() else kind(path, what)
    if found not in ("", "file"):
        raise InputError(f"{_named(path, what)}: is a {found}, accepted is a file")


def refuse_folder(path: str | Path, what: str = "") -> None:
    """Refuse a folder that cannot be written to; one that does not exist must be possible to make.

    Raises
    ------
    InputError : it is a file or device, or cannot be written
    """
    path = Path(path)
    _check_name(path, what)
    if kind(path, what) not in ("", "folder"):
        raise InputError(f"{_named(path, what)}: is not a folder, results cannot be written there")
    _refuse_unwritable(path, path, what)


def _refuse_unwritable(path: Path, folder: Path, what: str) -> None:
    """Refuse a path whose folder, or the nearest one that there is, takes no file."""
    nearest = next(p for p in (folder, *folder.absolute().parents) if os.path.lexists(p))
    try:
        with tempfile.TemporaryFile(dir=nearest):
            pass
    except OSError as error:
        raise InputError(f"{_named(path, what)}: cannot be written ({error.strerror})") from error


def _check_name(path: str | Path, what: str, more: int = 0) -> None:
    text = os.fsencode(path)
    if not text:
        raise InputError(f"{what or 'path'}: got an empty path")
    if b"\0" in text:
        raise InputError(f"{_named(path, what)}: a path cannot hold NUL")
    if len(text) > LONGEST_PATH or max(map(len, text.split(b"/"))) + more > LONGEST_NAME:
        raise InputError(
            f"{_named(path, what)}: the path is too long, accepted is a name of {LONGEST_NAME - more} bytes"
        )


def _named(path: str | Path, what: str) -> str:
    return f"{what}: {shown(path)}" if what else shown(path)


def file_name(text: str) -> str:
    """Text as the name of a file and of an experiment."""
    kept = "".join(c if (c.isalnum() and c.isascii()) or c in "_-" else "_" for c in text)
    return kept.lstrip("_-")[:LONGEST_STEM] or "bench"

"""Files and folders written whole or not at all."""

import contextlib
import errno
import glob
import os
import shutil
import time
from collections.abc import Iterator
from pathlib import Path

from ..errors import InputError, shown
from ..places import refuse_irregular
from ..processes import mark, marked_still_there

_FULL = 2**20  # bytes; a disk with less is a full one
_ABANDONED = 24 * 3600.0  # s without a change, after which a half file of another host's process is left over


def replace_atomically(path: Path, write) -> None:
    """Write through a temporary name beside ``path`` and rename, so that a killed job leaves no half file.

    Raises
    ------
    InputError : a link, a device or a folder stands there, the folder cannot be written or the disk is full
    """
    refuse_irregular(path)
    temporary = _half(path)
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


def _half(path: Path, word: str = "") -> Path:
    """The name under which this process writes ``path``; ``places.TEMPORARY`` is how much longer it is at most."""
    return path.with_name(f".{path.name}{word}.{mark()}.part")


def _remove_abandoned(path: Path) -> None:
    """Remove what processes that were killed while writing ``path`` left behind."""
    for part in path.parent.glob(f".{glob.escape(path.name)}.*.part"):
        if not _abandoned(part):
            continue
        if part.is_dir():
            shutil.rmtree(part, ignore_errors=True)
        else:
            part.unlink(missing_ok=True)


def _abandoned(part: Path) -> bool:
    """Whether nobody writes to a half file: its process is gone, or, of another host, it is old."""
    there = marked_still_there(part.suffixes[-2].removeprefix("."))
    if there is not None:
        return not there
    with contextlib.suppress(FileNotFoundError):
        return time.time() - part.stat().st_mtime > _ABANDONED
    return False


@contextlib.contextmanager
def whole_folder(path: Path) -> Iterator[Path]:
    """A folder to write into, which takes the place of ``path`` once all is written.

    A job may outlive its killed run, and the next run removes what it finds: of files written one after the other those
    before that moment would be missing from a folder that counts as finished.

    Raises
    ------
    InputError : a link, a device or a file stands there, or the folder cannot be written
    """
    if path.is_symlink() or (path.exists() and not path.is_dir()):
        raise InputError(f"{shown(path)}: is no folder, accepted is a folder or nothing")
    temporary, old = _half(path), _half(path, ".old")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _remove_abandoned(path)
        temporary.mkdir()
        yield temporary
        while True:
            with contextlib.suppress(FileNotFoundError):
                os.replace(path, old)
            try:
                os.replace(temporary, path)
                break
            except OSError as error:  # another process was faster, with the same
                if error.errno not in (errno.ENOTEMPTY, errno.EEXIST):
                    raise
                shutil.rmtree(old, ignore_errors=True)
    except InputError as error:
        raise InputError(str(error).replace(temporary.name, path.name)) from error
    except OSError as error:
        raise InputError(f"{shown(path)}: cannot be written ({error.strerror or error})") from error
    finally:
        for left in (temporary, old):
            shutil.rmtree(left, ignore_errors=True)


def write_text(path: str | Path, text: str) -> None:
    """Write a text file, whole or not at all.

    Raises
    ------
    InputError : the file cannot be written
    """
    replace_atomically(Path(path), lambda temporary: temporary.write_text(text, encoding="utf-8"))

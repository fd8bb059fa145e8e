"""Progress of long steps, one line every few seconds on the standard error stream."""

import contextlib
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import BinaryIO, TypeVar

from .errors import InputError, one_line

T = TypeVar("T")


def progress(items: Iterable[T], label: str, total: int, every: float = 3.0) -> Iterator[T]:
    """Pass items on and say every few seconds how many of ``total`` are done, and at the end how long it took."""
    start = last = time.monotonic()
    for done, item in enumerate(items):
        if time.monotonic() - last >= every:
            last = time.monotonic()
            say(f"{label}: {done} of {total}, {last - start:.0f} s")
        yield item
    say(f"{label}: {total} of {total}, {time.monotonic() - start:.1f} s")


def say(text: str) -> None:
    """One line on the standard error stream, and in the log of the script that runs."""
    print(text, file=sys.stderr, flush=True)
    for log in _logs:
        with contextlib.suppress(OSError):  # a full disk must not hide what is said
            log.write(f"{text}\n".encode())


_logs: list[BinaryIO] = []  # unbuffered, so that nothing is left to be written when they are closed


@contextmanager
def one_line_errors(log: str) -> Iterator[None]:
    """For scripts: keep what is said in a log as well, and turn an InputError into one line and exit code 2."""
    with contextlib.ExitStack() as stack:
        try:
            try:
                _logs.append(stack.enter_context(open(log, "wb", buffering=0)))
            except OSError as error:
                raise InputError(f"{log}: cannot be written ({error.strerror})") from error
            yield
        except InputError as error:
            say(f"emafault: {one_line(error)}")
            raise SystemExit(2) from None
        except OSError as error:  # a disk that is full or a folder that is read-only shows itself anywhere
            say(f"emafault: {error.filename or 'a file'}: cannot be used ({error.strerror or error})")
            raise SystemExit(2) from None
        finally:
            _logs.clear()

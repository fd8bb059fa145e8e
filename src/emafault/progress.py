"""Progress of long steps, one line every few seconds on the standard error stream."""

import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import TypeVar

from .errors import InputError

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
    """One line on the standard error stream."""
    print(text, file=sys.stderr, flush=True)


@contextmanager
def one_line_errors() -> Iterator[None]:
    """Turn an InputError into one line and exit code 2, for scripts and the command line."""
    try:
        yield
    except InputError as error:
        say(f"emafault: {error}")
        raise SystemExit(2) from None

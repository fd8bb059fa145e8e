"""A function of recordings done in forked processes, which share what has been read without a copy."""

import multiprocessing
from collections.abc import Callable, Sequence

_task: Callable | None = None


def _done(name: str):
    assert _task is not None
    return _task(name)


def forked(task: Callable[[str], object], names: Sequence[str], processes: int) -> list:
    """Results of ``task`` by name, in the order of ``names``; processes live as long as the call.

    Where processes cannot be forked they are done one after the other.
    """
    global _task
    if "fork" not in multiprocessing.get_all_start_methods():
        return [task(n) for n in names]
    _task = task
    try:
        with multiprocessing.get_context("fork").Pool(min(processes, len(names))) as pool:
            return pool.map(_done, names, chunksize=1)
    finally:
        _task = None

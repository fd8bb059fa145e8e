"""A function of recordings done in forked processes, which share what has been read without a copy."""

import multiprocessing
import weakref
from collections.abc import Callable, Sequence

_shared: object = None


def _begin(shared: object) -> None:
    global _shared
    _shared = shared


def _done(call: tuple[Callable, tuple]):
    task, arguments = call
    return task(_shared, *arguments)


class Workers:
    """Processes that live as long as their owner; ``shared`` is theirs from the fork on.

    Where processes cannot be forked everything is done here.
    """

    def __init__(self, owner: object, shared: object, processes: int):
        self.shared = shared
        self.pool = None
        if processes > 1 and "fork" in multiprocessing.get_all_start_methods():
            self.pool = multiprocessing.get_context("fork").Pool(processes, _begin, (shared,))
            weakref.finalize(owner, self.pool.terminate)

    def map(self, task: Callable, arguments: Sequence[tuple]) -> list:
        """Results of ``task(shared, *arguments)`` in order; ``task`` is a function of a module."""
        if self.pool is None:
            return [task(self.shared, *a) for a in arguments]
        return self.pool.map(_done, [(task, a) for a in arguments], chunksize=1)

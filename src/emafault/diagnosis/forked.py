"""A method of a shared object called in forked processes, which share what has been read without a copy."""

import multiprocessing
import weakref
from collections.abc import Sequence
from typing import Any

_shared: Any = None


def _begin(shared: object) -> None:
    global _shared
    _shared = shared


def _done(call: tuple[str, tuple]):
    method, arguments = call
    return getattr(_shared, method)(*arguments)


class Workers:
    """Processes that live as long as their owner; ``shared`` is theirs from the fork on.

    Call n of every ``map`` goes to the same process, which may keep what it needs again. Where processes cannot be
    forked everything is done here.
    """

    def __init__(self, owner: object, shared: object, processes: int):
        self.shared = shared
        self.pools: list = []
        if processes > 1 and "fork" in multiprocessing.get_all_start_methods():
            context = multiprocessing.get_context("fork")
            self.pools = [context.Pool(1, _begin, (shared,)) for _ in range(processes)]
            for pool in self.pools:
                weakref.finalize(owner, pool.terminate)

    def map(self, method: str, arguments: Sequence[tuple]) -> list:
        """Results of ``shared.method(*arguments)`` in order."""
        if not self.pools:
            return [getattr(self.shared, method)(*a) for a in arguments]
        count = len(self.pools)
        begun = [
            pool.map_async(_done, [(method, a) for a in arguments[k::count]], chunksize=1)
            for k, pool in enumerate(self.pools)
        ]
        out: list = [None] * len(arguments)
        for k, results in enumerate(begun):
            out[k::count] = results.get()
        return out

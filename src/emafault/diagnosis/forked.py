"""A method of a shared object called in forked processes, which share what has been read without a copy."""

import multiprocessing
import os
import weakref
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from functools import cache
from typing import Any

from ..processes import end_with

_shared: Any = None


def _begin(shared: object, parent: int) -> None:
    global _shared
    _shared = shared
    end_with(parent)


def _done(call: tuple[str, tuple]):
    method, arguments = call
    return getattr(_shared, method)(*arguments)


@contextmanager
def beside(shared: object, method: str) -> Iterator[Callable[[], Any]]:
    """Gives the result of ``shared.method()``, done in a forked process meanwhile, or here once it is asked for."""
    if "fork" not in multiprocessing.get_all_start_methods():
        yield cache(getattr(shared, method))
        return
    with ProcessPoolExecutor(1, multiprocessing.get_context("fork"), _begin, (shared, os.getpid())) as pool:
        yield pool.submit(_done, (method, ())).result


class Workers:
    """Processes that live as long as their owner; ``shared`` is theirs from the fork on.

    Calls of one place go to the same process, which may keep what it needs again. Where processes cannot be
    forked everything is done here.
    """

    def __init__(self, owner: object, shared: object, processes: int):
        self.shared = shared
        self.sent: dict = {}  # by name, what the processes keep, so that it is not sent again
        self.pools: list = []
        if processes > 1 and "fork" in multiprocessing.get_all_start_methods():
            context = multiprocessing.get_context("fork")
            self.pools = [context.Pool(1, _begin, (shared, os.getpid())) for _ in range(processes)]
            for pool in self.pools:
                weakref.finalize(owner, pool.terminate)

    @property
    def count(self) -> int:
        """Number of places at which calls are done side by side."""
        return max(1, len(self.pools))

    def tell(self, method: str, *arguments) -> None:
        """Call ``shared.method`` in every process."""
        self.map(method, [arguments] * self.count)

    def map(self, method: str, arguments: Sequence[tuple], places: Sequence[int] | None = None) -> list:
        """Results of ``shared.method(*arguments)`` in order; ``places``: numbers that go to one process where they are
        the same (otherwise the calls')."""
        if not self.pools:
            return [getattr(self.shared, method)(*a) for a in arguments]
        count = len(self.pools)
        at = [n % count for n in (range(len(arguments)) if places is None else places)]
        mine = [[n for n, k in enumerate(at) if k == place] for place in range(count)]
        begun = [
            pool.map_async(_done, [(method, arguments[n]) for n in calls], chunksize=max(1, len(calls)))
            for pool, calls in zip(self.pools, mine, strict=True)
        ]
        out: list = [None] * len(arguments)
        for calls, results in zip(mine, begun, strict=True):
            for n, found in zip(calls, results.get(), strict=True):
                out[n] = found
        return out

"""One recording linearised at a point: its blocks made white, weighed and compressed."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from .linear import Weights, White, compressed, correct, key_of, weights_from, white_rows
from .model import Block

SETTINGS = ("control", "commutation")  # equations of the controller, whose form is its own business
KEPT = 2e8  # bytes of white rows that a process keeps from a pass to the one that renews the weights


@dataclass(frozen=True)
class Task:
    """What is to be linearised: where, by which columns, with which equations' remainders (None: all).

    ``own``: sizes of the units that carry their own form; ``full``: deviations of a full model at this very task, from
    whose residual the weights are renewed; ``corrected`` takes out what the noise in the regressors adds; ``again``
    says that a pass with ``full`` follows.
    """

    values: Mapping[str, float]
    wanted: tuple[str, ...]
    remainders: frozenset[str] | None = None
    own: Mapping[str, Mapping[str, float]] | None = None
    full: Mapping[str, float] | None = None
    corrected: bool = True
    again: bool = False


Parts = tuple[list[Block], list[tuple[list[str], np.ndarray]]]


class Linearisation:
    """Recordings of a machine in one process."""

    def __init__(self, machine):
        self.machine = machine
        self.kept: dict[str, Parts] = {}

    def compress(
        self, task: Task, recording: str, weights: Mapping[tuple[str, str], Weights]
    ) -> tuple[list[White], dict[tuple[str, str], Weights]]:
        """Normal matrices of a recording's blocks, and the weights that a full model renews."""
        blocks, parts = self.kept.pop(recording) if recording in self.kept else self._white(task, recording)
        if task.again and self._size() + _size(parts) < KEPT:
            self.kept[recording] = blocks, parts
        renewed: dict[tuple[str, str], Weights] = {}
        if task.full is not None:
            renewed = {key_of(b): weights_from(b, *p, task.full) for b, p in zip(blocks, parts, strict=True)}
        weights = {**weights, **renewed}
        out = [compressed(b, *p, weights.get(key_of(b))) for b, p in zip(blocks, parts, strict=True)]
        if task.corrected:
            disturbed = self.machine.blocks(task.values, recording, disturbed=True, wanted=set(task.wanted))
            for white, block, other in zip(out, blocks, disturbed, strict=True):
                correct(white, block, other, weights.get(key_of(block)))
        return out, renewed

    def _white(self, task: Task, recording: str) -> Parts:
        blocks = self.machine.blocks(task.values, recording, wanted=set(task.wanted))
        parts = [
            white_rows(
                b, task.wanted, task.remainders is None or b.equation in task.remainders,
                task.own if b.equation not in SETTINGS else None,
            )
            for b in blocks
        ]  # fmt: skip
        return blocks, parts

    def _size(self) -> int:
        return sum(_size(parts) for _, parts in self.kept.values())


def _size(parts: list[tuple[list[str], np.ndarray]]) -> int:
    return sum(rows.nbytes for _, rows in parts)

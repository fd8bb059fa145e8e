"""One recording linearised at a point: its blocks made white, weighed and compressed."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from .linear import Weights, White, compressed, correct, weights_from, white_rows
from .model import Block

SETTINGS = ("control", "commutation")  # equations of the controller, whose form is its own business
KEPT = 2e8  # bytes of white rows that a process keeps from a pass to the one that renews the weights


@dataclass(frozen=True)
class Task:
    """What is to be linearised: where, by which columns, with which equations' remainders (None: all).

    ``own``: sizes of the units that carry their own form; ``full``: deviations of a full model at this very task, from
    whose residual the weights are renewed; ``again`` says that a pass with ``full`` follows; ``corrected`` takes out
    what the noise in the regressors adds.
    """

    values: Mapping[str, float]
    wanted: tuple[str, ...]
    remainders: frozenset[str] | None = None
    own: Mapping[str, Mapping[str, float]] | None = None
    full: Mapping[str, float] | None = None
    again: bool = False
    corrected: bool = True


Parts = tuple[list[Block], list[tuple[list[str], np.ndarray]]]
Carried = dict[str, Weights]  # of a recording's blocks, by equation


class Linearisation:
    """Recordings of a machine in one process."""

    def __init__(self, machine):
        self.machine = machine
        self.kept: dict[str, Parts] = {}

    def compress(self, task: Task, recording: str, weights: Carried) -> tuple[list[White], Carried]:
        """Normal matrices of a recording's blocks, and its weights from here on."""
        blocks, parts = self.kept.pop(recording) if recording in self.kept else self._white(task, recording)
        if task.again and self._size() + _size(parts) < KEPT:
            self.kept[recording] = blocks, parts
        if task.full is not None:
            weights = {b.equation: weights_from(b, *p, task.full) for b, p in zip(blocks, parts, strict=True)}
        out = [compressed(b, *p, weights.get(b.equation)) for b, p in zip(blocks, parts, strict=True)]
        if task.corrected:
            disturbed = self.machine.blocks(task.values, recording, disturbed=True, wanted=set(task.wanted))
            for white, block, other in zip(out, blocks, disturbed, strict=True):
                own = task.own if block.equation not in SETTINGS else None
                correct(white, block, other, weights.get(block.equation), own)
        return out, weights

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

"""One recording linearised at a point: its blocks made white, weighed and compressed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from .described import Described, with_forms
from .left import Left
from .linear import (
    FEW,
    OwnForms,
    White,
    assemble,
    columns_of_forms,
    compressed_columns,
    correct,
    disturbance,
    raw_columns,
    weights_from,
)
from .model import SETTINGS, Block
from .scanning import Proposal, scanned
from .whitening import Weights

KEPT = 2e8  # bytes of columns that a process keeps from a pass to the one that renews the weights


@dataclass(frozen=True)
class Task:
    """What is to be linearised: where, by which columns, with which equations' remainders (None: all).

    ``own``: units that carry their own form; ``full``: deviations of a full model at this very task, from
    whose residual the weights are renewed; ``again`` says that a pass with ``full`` follows; ``corrected`` takes out
    what the noise in the regressors adds.
    """

    values: Mapping[str, float]
    wanted: tuple[str, ...]
    remainders: frozenset[str] | None = None
    own: OwnForms | None = None
    full: Mapping[str, float] | None = None
    leads: bool = False
    again: bool = False
    corrected: bool = True
    on: frozenset[str] = frozenset()

    @property
    def columns(self) -> set[str]:
        """What blocks are to have a column by."""
        return {*self.wanted} | columns_of_forms(self.own)


Carried = dict[str, Weights]  # of a recording's blocks, by equation


class Linearisation:
    """Recordings of a machine in one process."""

    def __init__(self, machine):
        self.machine = machine
        self.kept: dict[str, tuple[list[Block], list[Block]]] = {}  # by recording, see ``_blocks``
        self.carried: dict[str, Carried] = {}

    def compress(self, task: Task, recording: str, given: Carried | None) -> tuple[list[White], Carried | None]:
        """Normal matrices of a recording's blocks, and its weights from here on where they are new.

        ``given``: its weights; None: as they were the last time.
        """
        weights = self.carried[recording] if given is None else given
        blocks, disturbed = self.kept.pop(recording) if recording in self.kept else self._blocks(task, recording)
        held = sum(_size(b) for both in self.kept.values() for b in both)
        if task.again and held + _size(blocks) + _size(disturbed) < KEPT:
            self.kept[recording] = blocks, disturbed
        renewed: Carried = {}
        out = []
        for b in blocks:
            names, columns = raw_columns(
                b, task.wanted, task.remainders is None or b.equation in task.remainders,
                task.own if b.equation not in SETTINGS else None,
            )  # fmt: skip
            if task.full is not None:
                renewed[b.equation] = weights_from(b, names, columns, task.full, task.leads)
            weight = weights.get(b.equation) if task.full is None else renewed[b.equation]
            out.append(compressed_columns(b, names, columns, weight))
        if task.full is not None:
            weights = renewed
        if task.corrected:
            for white, block, other in zip(out, blocks, disturbed, strict=True):
                own = task.own if block.equation not in SETTINGS else None
                correct(white, disturbance(block, other, white.names, weights.get(block.equation), own))
        self.carried[recording] = weights
        return out, weights if task.full is not None else None

    def describe(self, forms: Sequence[Described]) -> None:
        """Take these forms in the place of those before."""
        self.machine = with_forms(self.machine, forms)

    def scan(
        self,
        values: Mapping[str, float],
        names: Sequence[str],
        carried: Mapping[str, Carried],
        free: Mapping[str, tuple[float, float]],
        mark: str,
        part: int,
        parts: int,
    ) -> list[Proposal]:
        """See ``scanned``: of recordings at a point."""
        blocks = [b for n in names for b in self.machine.blocks(values, n, wanted=set(free))]
        return scanned(self.machine, blocks, carried, free, mark, part, parts)

    @staticmethod
    def load() -> None:
        """Load what is compiled: processes that are forked afterwards need not, each for itself."""
        rows = 2 * FEW
        block = Block("", "", np.cos(np.arange(rows)), {"x": np.ones(rows)}, [np.ones(rows)], np.ones(rows, bool))
        names, columns = raw_columns(block, ["x"], False)
        weights = weights_from(block, names, columns, {}, leads=True)
        white = compressed_columns(block, names, columns, weights)
        correct(white, disturbance(block, block, names, weights))
        assemble([white], names, {})
        cells = Left("", [block], [weights], {"x": (0.0, 1.0)})
        block.coordinates["drivers"] = np.ones((1, rows))
        cells.cells(lambda b: np.zeros(rows, int), 1, 0)

    def _blocks(self, task: Task, recording: str) -> tuple[list[Block], list[Block]]:
        """Blocks of a recording, and with one more draw of its noise where that is to be taken out."""
        blocks = self.machine.blocks(task.values, recording, wanted=task.columns)
        if not task.corrected:
            return blocks, []
        return blocks, self.machine.blocks(task.values, recording, disturbed=True, wanted=task.columns)


def _size(blocks: list[Block]) -> int:
    """Bytes of the columns."""
    return sum(np.asarray(c).nbytes for b in blocks for c in b.columns.values())

"""One recording linearised at a point: its blocks made white, weighed and compressed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from .described import Described, Proposal, scanned, with_forms
from .linear import White, compressed_columns, correct, disturbance, raw_columns, weights_from
from .model import SETTINGS, Block
from .whitening import Weights

ALIKE = 0.1  # of a column's power, by which it may change until its noise is drawn again
KEPT = 2e8  # bytes of columns that a process keeps from a pass to the one that renews the weights


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
    leads: bool = False
    again: bool = False
    corrected: bool = True
    on: frozenset[str] = frozenset()


Carried = dict[str, Weights]  # of a recording's blocks, by equation


@dataclass(frozen=True)
class Noise:
    """Products (column, column) that noise adds to those of a block's columns and its residual, the last.

    They are of a pass at ``values`` with the units ``on``.
    """

    products: np.ndarray
    names: Sequence[str]
    power: np.ndarray  # (column,) of the block's columns
    values: Mapping[str, float]
    on: frozenset[str]

    def serves(self, white: White, on: frozenset[str]) -> bool:
        """Whether a block's columns are among these, and as they were."""
        index = {n: k for k, n in enumerate(self.names)}
        if self.on != on or not set(white.names) <= set(index):
            return False
        before = self.power[[index[n] for n in white.names]]
        return bool(np.all(np.abs(np.diag(white.gram)[:-1] - before) <= ALIKE * before))

    def of(self, names: Sequence[str], values: Mapping[str, float]) -> np.ndarray:
        """Of these columns and the residual, whose noise at other values is that of the columns too."""
        index = {n: k for k, n in enumerate(self.names)}
        k = np.array([*(index[n] for n in names), len(self.names)])
        moved = np.array([values.get(n, 0.0) - self.values.get(n, 0.0) for n in self.names])
        found = self.products[np.ix_(k, k)]
        added = self.products[:, :-1] @ moved
        found[-1, :] += added[k]
        found[:, -1] += added[k]
        found[-1, -1] += moved @ added[:-1]
        return found


class Linearisation:
    """Recordings of a machine in one process."""

    def __init__(self, machine):
        self.machine = machine
        self.kept: dict[str, list[Block]] = {}
        self.carried: dict[str, Carried] = {}
        self.noise: dict[str, dict[str, Noise]] = {}  # by recording and equation, under the weights that it has

    def compress(self, task: Task, recording: str, given: Carried | None) -> tuple[list[White], Carried | None]:
        """Normal matrices of a recording's blocks, and its weights from here on where they are new.

        ``given``: its weights; None: as they were the last time.
        """
        weights = self.carried[recording] if given is None else given
        if given is not None or task.full is not None:
            self.noise.pop(recording, None)
        blocks = self.kept.pop(recording) if recording in self.kept else self._blocks(task, recording)
        if task.again and sum(map(_size, self.kept.values())) + _size(blocks) < KEPT:
            self.kept[recording] = blocks
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
            for white, noise in zip(out, self._noise(task, recording, blocks, out, weights), strict=True):
                correct(white, noise)
        self.carried[recording] = weights
        return out, weights if task.full is not None else None

    def _noise(
        self, task: Task, recording: str, blocks: Sequence[Block], whites: Sequence[White], weights: Carried
    ) -> list[np.ndarray]:
        """What noise adds to the blocks' normal matrices, of a second draw of it.

        Products of noise hardly depend on the point: where the columns are as they were in a pass before, with the same
        weights, what that pass had is taken again.
        """
        known = self.noise.setdefault(recording, {})
        if known and all(known[w.equation].serves(w, task.on) for w in whites):
            return [known[w.equation].of(w.names, task.values) for w in whites]
        disturbed = self.machine.blocks(task.values, recording, disturbed=True, wanted=set(task.wanted))
        found = []
        for white, block, other in zip(whites, blocks, disturbed, strict=True):
            own = task.own if block.equation not in SETTINGS else None
            noise = disturbance(block, other, white.names, weights.get(block.equation), own)
            power = np.diag(white.gram)[:-1].copy()
            known[block.equation] = Noise(noise, white.names, power, task.values, task.on)
            found.append(noise)
        return found

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

    def _blocks(self, task: Task, recording: str) -> list[Block]:
        return self.machine.blocks(task.values, recording, wanted=set(task.wanted))


def _size(blocks: list[Block]) -> int:
    """Bytes of the columns."""
    return sum(np.asarray(c).nbytes for b in blocks for c in b.columns.values())

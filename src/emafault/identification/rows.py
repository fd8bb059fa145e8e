"""Rows that an identifier learns from: in memory, or many of them in files, of which a block is in memory at a time.

A file of rows is read anew for each block and let go: a table of a million runs takes no more memory than one of some
thousand, but for the numbers of its rows.
"""

import math
import os
import tempfile
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..errors import InputError
from .network import logarithmic
from .posterior import nominal_nine

BLOCK = 2000  # rows that are worked on at a time
MOST_AT_ONCE = 10_000  # rows that are in memory together, and that intervals are calibrated on
LEAST_ROWS = 10  # that an identifier is made from


class Stored:
    """A table (row, ...) of numbers in a file; what is asked for is read, nothing else is in memory."""

    def __init__(self, path: Path, shape: tuple[int, ...]):
        self.path, self.shape = path, shape

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, rows: slice | np.ndarray) -> np.ndarray:
        """(row, ...) of consecutive rows, or of the numbers of rows, whatever their order."""
        if isinstance(rows, slice):
            start, stop, _ = rows.indices(len(self))
            return self._read(start, stop)
        out = np.empty((len(rows), *self.shape[1:]))
        order = np.argsort(rows, kind="stable")
        blocks, firsts = np.unique(rows[order] // BLOCK, return_index=True)
        for block, here in zip(blocks.tolist(), np.split(order, firsts[1:])):
            start = BLOCK * block
            out[here] = self._read(start, min(start + BLOCK, len(self)))[rows[here] - start]
        return out

    def _read(self, start: int, stop: int) -> np.ndarray:
        size = math.prod(self.shape[1:])
        table = np.fromfile(self.path, float, (stop - start) * size, offset=8 * start * size)
        return table.reshape(stop - start, *self.shape[1:])


#: rows in memory or in a file; both give an array for a slice or for numbers of rows
Table = np.ndarray | Stored


def in_blocks(rows: int) -> Iterator[slice]:
    """Slices of ``BLOCK`` rows that together are all."""
    return (slice(start, min(start + BLOCK, rows)) for start in range(0, rows, BLOCK))


def at_most(rows: np.ndarray, seed: int, parts: int = 1) -> np.ndarray:
    """Numbers of rows, or ``MOST_AT_ONCE`` of them drawn at random, in order; of one of several parts its share."""
    most = MOST_AT_ONCE // parts
    return rows if len(rows) <= most else np.sort(np.random.default_rng([seed, 50]).choice(rows, most, replace=False))


@dataclass(frozen=True)
class Rows(ABC):
    """Features of simulated runs in SI units, with their truth, wherever they are kept."""

    features: Table  # (run, 6), (run, 8) or (run, 9), NaN where a record gave none
    faults: Table  # (run, 6)
    covariance: Table | None = None  # (run, 6, 6) of R and k, or (run, 9, 9); None where none is told
    units: Table | None = None  # (run, 9) R0 (ohm), k0 (V s/rad) and L0 (H) of each run's; None: all are nominal

    @property
    def scaled(self) -> int:
        """How many features a unit has a value of its own of."""
        return logarithmic(self.features.shape[1])

    def rows(self, index: Any) -> "TrainingRows":
        """The same with some of the rows, in memory."""
        covariance, units = (None if a is None else a[index] for a in (self.covariance, self.units))
        return TrainingRows(self.features[index], self.faults[index], covariance, units)

    def blocks(self) -> Iterator["TrainingRows"]:
        """All rows, block by block."""
        return (self.rows(block) for block in in_blocks(len(self.features)))

    def some(self, seed: int = 0) -> "TrainingRows":
        """The rows, at most ``MOST_AT_ONCE`` of them, in memory."""
        return self.rows(at_most(np.arange(len(self.features)), seed))

    @abstractmethod
    def each(self, function: Callable[["TrainingRows"], "TrainingRows"]) -> "Rows":
        """What a function makes of the rows, kept as they are."""

    def identified(self) -> "Rows":
        """The rows that have features, with a covariance if all of them tell one.

        Raises
        ------
        InputError : fewer than ``LEAST_ROWS`` have
        """
        count = sum(int(np.sum(block.known)) for block in self.blocks())
        if count < LEAST_ROWS:
            raise InputError(
                f"identification: {count} runs have features, at least {LEAST_ROWS} are needed to learn from"
            )
        rows = self if count == len(self.features) else self.each(lambda block: block.rows(block.known))
        told = all(b.covariance is not None and np.all(np.isfinite(b.covariance)) for b in rows.blocks())
        return rows if told else replace(rows, covariance=None)

    def of_nominal(self, actuator: ActuatorParameters) -> "Rows":
        """As the nominal unit would have given them: features and covariance are scaled by what each unit is off."""
        nominal = nominal_nine(actuator)
        return self if self.units is None else self.each(lambda block: block.scaled_to(nominal))

    def extremes(self) -> tuple[np.ndarray, np.ndarray]:
        """Least and greatest (feature,) of all rows."""
        ends = [(block.features.min(axis=0), block.features.max(axis=0)) for block in self.blocks()]
        return np.min([low for low, _ in ends], axis=0), np.max([high for _, high in ends], axis=0)


@dataclass(frozen=True)
class TrainingRows(Rows):
    """Rows in memory."""

    features: np.ndarray
    faults: np.ndarray
    covariance: np.ndarray | None = None
    units: np.ndarray | None = None

    def each(self, function: Callable[["TrainingRows"], "TrainingRows"]) -> "TrainingRows":
        """What a function makes of the rows."""
        return function(self)

    @property
    def known(self) -> np.ndarray:
        """(run,) which rows have all features."""
        return np.all(np.isfinite(self.features), axis=1)

    def scaled_to(self, nominal: np.ndarray) -> "TrainingRows":
        """As a unit of ``nominal`` (9,) R0, k0 and L0 would have given them."""
        assert self.units is not None
        features, covariance, scaled = self.features.copy(), self.covariance, self.scaled
        scale = nominal[:scaled] / self.units[:, :scaled]
        features[:, :scaled] *= scale
        if covariance is not None:
            covariance = covariance * scale[:, :, None] * scale[:, None, :]
        return TrainingRows(features, self.faults, covariance)


@dataclass(frozen=True)
class StoredRows(Rows):
    """Rows in files of one folder, which is removed by whoever made it."""

    features: Stored
    faults: Stored
    covariance: Stored | None = None
    units: Stored | None = None

    def each(self, function: Callable[[TrainingRows], TrainingRows]) -> "StoredRows":
        """What a function makes of the rows, block by block, in files beside theirs."""
        return store(self.features.path.parent, map(function, self.blocks()))


def store(folder: Path, blocks: Iterable[TrainingRows]) -> StoredRows:
    """Rows in files of a folder, written block by block.

    Parameters
    ----------
    blocks : at least one, with the same tables
    """
    stored: dict[str, Stored] = {}
    for block in blocks:
        for f in fields(block):
            table = getattr(block, f.name)
            if table is None:
                continue
            before = stored.get(f.name)
            path = _new_file(folder, f.name) if before is None else before.path
            with open(path, "ab") as file:
                file.write(np.ascontiguousarray(table, float).tobytes())
            stored[f.name] = Stored(path, ((0 if before is None else len(before)) + len(table), *table.shape[1:]))
    return StoredRows(**stored)


def _new_file(folder: Path, name: str) -> Path:
    handle, path = tempfile.mkstemp(f".{name}", dir=folder)
    os.close(handle)
    return Path(path)

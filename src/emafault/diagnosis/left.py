"""What one equation leaves in all recordings at a point, as the scans of described forms take it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from .evidence import Definite
from .model import Block
from .whitening import Weights, factored, substituted, substituted_back

Shape = Mapping[str, float]
Columns = Callable[[Block], np.ndarray]  # of a block -> (column, row)


@dataclass(frozen=True)
class Found:
    """A form where a scan has it.

    ``shape``: name, value, standard deviation and unit of what is not linear; ``evidence``: approximate log Bayes
    factor at that shape; ``among``: how many shapes the scan could have told apart.
    """

    shape: tuple[tuple[str, float, float, str], ...]
    evidence: float
    among: float


class Left:
    """An equation's blocks with what they leave, divided by the noise's covariance."""

    def __init__(self, equation: str, blocks: Sequence[Block], weights: Sequence[Weights]):
        self.equation, self.blocks, self.weights = equation, list(blocks), list(weights)
        self.factors = [factored(b.bands, b.usable) for b in self.blocks]
        self.white = [
            self._white(k, np.asarray(b.residual, float)[:, None].copy())[:, 0] for k, b in enumerate(self.blocks)
        ]
        #: (row,) inverse covariance times what is left: its product with a column is the score of that column
        self.weighed = [
            substituted_back(f, b.usable, w / np.sqrt(o.variance))
            for f, b, w, o in zip(self.factors, self.blocks, self.white, self.weights, strict=True)
        ]
        #: (row,) the same of ones: what a row says of a column that changes slowly
        self.known = [
            np.maximum(substituted_back(f, b.usable, w / np.sqrt(o.variance)), 0.0)
            for f, b, o, w in zip(
                self.factors, self.blocks, self.weights,
                [self._white(k, np.ones((len(b.residual), 1)))[:, 0] for k, b in enumerate(self.blocks)], strict=True,
            )
        ]  # fmt: skip

    def _white(self, k: int, rows: np.ndarray) -> np.ndarray:
        """(row, column) of a block divided by its noise, in place; rows not used become zero."""
        substituted(self.factors[k], self.blocks[k].usable, rows)
        rows *= (self.weights[k].usable / np.sqrt(self.weights[k].variance))[:, None]
        return rows

    @property
    def drivers(self) -> int:
        """Number of drivers that a form may multiply."""
        return len(self.blocks[0].coordinates["drivers"])

    @property
    def longest(self) -> float:
        """Time of the longest recording (s)."""
        return max(float(b.coordinates["time"][-1]) for b in self.blocks)

    def scale(self, driver: int) -> float:
        """Noise of a row over the root mean square of a driver."""
        noise = np.median([np.sqrt(np.median(b.bands[0])) for b in self.blocks])
        power = np.mean([np.mean(np.square(b.coordinates["drivers"][driver])) for b in self.blocks])
        return float(noise / np.sqrt(max(power, 1e-24)))

    def cells(self, cell: Callable[[Block], np.ndarray], count: int, driver: int) -> tuple[np.ndarray, np.ndarray]:
        """Score and, as of slow columns, information (cell,) of a driver in each cell of the rows."""
        g, power = np.zeros(count), np.zeros(count)
        for b, weighed, known in zip(self.blocks, self.weighed, self.known, strict=True):
            d = np.asarray(b.coordinates["drivers"][driver])
            at = np.clip(cell(b), 0, count - 1)
            g += np.bincount(at, weighed * d, count)
            power += np.bincount(at, known * d * d, count)
        return g, power

    def products(self, columns: Columns, driver: int) -> tuple[np.ndarray, np.ndarray]:
        """Score (column,) and information (column, column) of columns times a driver over all recordings."""
        parts = self.each(columns, driver)
        return np.sum([g for g, _ in parts], axis=0), np.sum([G for _, G in parts], axis=0)

    def each(self, columns: Columns, driver: int) -> list[tuple[np.ndarray, np.ndarray]]:
        """The same of each recording."""
        out = []
        for k, b in enumerate(self.blocks):
            rows = np.ascontiguousarray((columns(b) * np.asarray(b.coordinates["drivers"][driver])).T, float)
            rows = self._white(k, rows)
            out.append((rows.T @ self.white[k], rows.T @ rows))
        return out


def gain(g: np.ndarray, G: np.ndarray) -> float:
    """Approximate log Bayes factor of columns with score ``g`` and information ``G``, at the best width of their prior.

    With a prior as wide as what is found, r columns lose r/2 (1 + ln(2 L / r)) of the gain L in log likelihood.
    """
    scale = np.sqrt(np.maximum(np.diag(G), 0.0))
    used = scale > 1e-9 * max(scale.max(initial=0.0), 1e-300)
    if not used.any():
        return -np.inf
    unit = g[used] / scale[used]
    M = G[np.ix_(used, used)] / np.outer(scale[used], scale[used])
    found = float(0.5 * unit @ Definite(M + 1e-6 * np.eye(len(M))).solve(unit))
    return float(_less_width(np.array([found]), int(used.sum()))[0])


def _less_width(found: np.ndarray, count: int) -> np.ndarray:
    share = np.maximum(2.0 * found / count, 1.0)
    return np.maximum(found, 0.5 * count) - 0.5 * count * (1.0 + np.log(share))


def singly(g: np.ndarray, G: np.ndarray) -> np.ndarray:
    """(column,) the same of each column alone."""
    power = np.diag(G)
    with np.errstate(divide="ignore", invalid="ignore"):
        found = np.where(power > 1e-12 * max(power.max(initial=0.0), 1e-300), 0.5 * g**2 / power, 0.0)
    return _less_width(found, 1)


def of_cells(columns: np.ndarray, g: np.ndarray, power: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Score and information of columns (column, cell) that are constant in each cell, a constant of all apart."""
    shares = columns @ power / max(power.sum(), 1e-300)
    columns = columns - shares[:, None]
    return columns @ g, (columns * power) @ columns.T


def without(g: np.ndarray, G: np.ndarray, known: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Score and information of columns less their part along a combination ``known`` of them, which is free anyway."""
    along = G @ known
    power = float(known @ along)
    if power <= 0.0:
        return g, G
    return g - along * float(known @ g) / power, G - np.outer(along, along) / power


def beside_first(g: np.ndarray, G: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Score and information of all columns but the first, less their part along that one."""
    g, G = without(g, G, np.eye(len(g))[0])
    return g[1:], G[1:, 1:]

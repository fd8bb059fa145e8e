"""What one equation leaves in all recordings at a point, as the scans of described forms take it."""

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_triangular

from ..compiled import compiled
from .linear import ROUNDING
from .model import Block
from .whitening import Weights, filtered, substituted, substituted_back

APART = 1e-6  # of a column's information, that must be left of it once what is free is taken out
ROUNDED = 10.0  # times the error that a negative power shows, for a column to be apart from others
Shape = Mapping[str, float]
Known = tuple[tuple[str, float, float, str], ...]  # name, value, standard deviation and unit of a shape's numbers
Columns = Callable[[Block], np.ndarray]  # of a block -> (column, row)


@dataclass(frozen=True)
class Found:
    """A form where a scan has it.

    ``shape``: of what is not linear; ``evidence``: approximate log Bayes factor at that shape; ``among``: how many
    shapes the scan could have told apart.
    """

    shape: Known
    evidence: float
    among: float


class Left:
    """An equation's blocks with what they leave, divided by the noise's covariance.

    ``free``: by name of a block's column, mean and standard deviation of what it may deviate by from the present point:
    scores and informations are those with these marginalised.
    """

    def __init__(
        self,
        equation: str,
        blocks: Sequence[Block],
        weights: Sequence[Weights],
        free: Mapping[str, tuple[float, float]] | None = None,
    ):
        self.equation, self.blocks, self.weights = equation, list(blocks), list(weights)
        self.factors = [b.factor for b in self.blocks]
        self.white = [
            self._white(k, np.asarray(b.residual, float)[:, None].copy())[:, 0] for k, b in enumerate(self.blocks)
        ]
        #: (row,) inverse covariance times what is left: its product with a column is the score of that column
        self.weighed = [self._back(k, white) for k, white in enumerate(self.white)]
        #: (row,) the same of ones: what a row says of a column that changes slowly
        self.known = [
            np.maximum(self._back(k, self._white(k, np.ones((len(b.residual), 1)))[:, 0]), 0.0)
            for k, b in enumerate(self.blocks)
        ]
        self._once: dict[Hashable, np.ndarray] = {}
        self._take_out(free or {})

    def _take_out(self, free: Mapping[str, tuple[float, float]]) -> None:
        names = [n for n in free if any(n in b.columns for b in self.blocks)]
        index = {n: k for k, n in enumerate(names)}
        prior = np.array([free[n] for n in names]).reshape(len(names), 2)
        #: of each block, places of its own among all that are free, and their columns (column, row)
        self.own: list[tuple[np.ndarray, np.ndarray]] = []
        for b in self.blocks:
            mine = [n for n in names if n in b.columns]
            rows = np.empty((len(mine), len(b.residual)))
            for row, n in zip(rows, mine, strict=True):
                row[:] = -np.asarray(b.columns[n])
            self.own.append((np.array([index[n] for n in mine], int), rows))
        self.own_white = [self._white(k, np.ascontiguousarray(rows.T)) for k, (_, rows) in enumerate(self.own)]
        right = prior[:, 0] / prior[:, 1] ** 2
        exact, slow = np.diag(1.0 / prior[:, 1] ** 2), np.diag(1.0 / prior[:, 1] ** 2)
        g, g_slow = right.copy(), right.copy()
        for k, (at, rows) in enumerate(self.own):
            exact[np.ix_(at, at)] += self.own_white[k].T @ self.own_white[k]
            slow[np.ix_(at, at)] += (rows * self.known[k]) @ rows.T
            g[at] += self.own_white[k].T @ self.white[k]
            g_slow[at] += rows @ self.weighed[k]
        self._exact, self._slow = _Free(exact, g), _Free(slow, g_slow)
        #: (row,) inverse covariance times what is left once what is free is fitted
        self.remaining = [
            self._back(k, white - own @ self._exact.fitted[at])
            for k, (white, own, (at, _)) in enumerate(zip(self.white, self.own_white, self.own, strict=True))
        ]
        #: of each recording by itself
        self._alone = [
            _Free(np.diag(1.0 / prior[at, 1] ** 2) + own.T @ own, right[at] + own.T @ white)
            for (at, _), own, white in zip(self.own, self.own_white, self.white, strict=True)
        ]

    def _white(self, k: int, rows: np.ndarray) -> np.ndarray:
        """(row, column) of a block divided by its noise; overwrites ``rows``, and rows not used become zero.

        The error of rounding comes back with what it is an error of, as in beats of counts with samples, and has the
        colour that the weights say; that of other noise is as often of what is looked for.
        """
        substituted(self.factors[k], self.blocks[k].usable, rows)
        if self.blocks[k].rounded:
            return filtered(rows, self.weights[k])
        rows *= (self.weights[k].usable / np.sqrt(self.weights[k].variance))[:, None]
        return rows

    def _back(self, k: int, white: np.ndarray) -> np.ndarray:
        """(row,) the same, transposed: inverse covariance times what ``white`` rows are of."""
        weights = self.weights[k]
        white = white / np.sqrt(weights.variance)
        if self.blocks[k].rounded:
            plain = replace(weights, usable=weights.usable[::-1], variance=np.ones(len(white)), wander=0.0)
            white = filtered(white[::-1, None], plain)[::-1, 0]
        return substituted_back(self.factors[k], self.blocks[k].usable, white)

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

    def cells(self, cell: Callable[[Block], np.ndarray], count: int, driver: int) -> "Scored":
        """Score and, as of slow columns, information of a driver in each cell of the rows."""
        g, power, cross = np.zeros(count), np.zeros(count), np.zeros((len(self._slow), count))
        for b, weighed, known, (own, rows) in zip(self.blocks, self.weighed, self.known, self.own, strict=True):
            d = np.asarray(b.coordinates["drivers"][driver])
            at = np.clip(cell(b), 0, count - 1)
            g += np.bincount(at, weighed * d, count)
            power += np.bincount(at, known * d * d, count)
            cross[own] += _binned(at, known * d, rows, count)
        return Scored(g, power, cross, self._slow)

    def once(self, key: Hashable, compute: Callable[[], np.ndarray]) -> np.ndarray:
        """What several drivers are asked with, computed at the first call with this key."""
        if key not in self._once:
            self._once[key] = compute()
        return self._once[key]

    def products(self, columns: Columns, driver: int) -> tuple[np.ndarray, np.ndarray]:
        """Score (column,) and information (column, column) of columns times a driver over all recordings."""
        return self._added(columns, driver, False)

    def slowly(self, columns: Columns, driver: int) -> tuple[np.ndarray, np.ndarray]:
        """The same, as of slow columns."""
        return self._added(columns, driver, True)

    def _added(self, columns: Columns, driver: int, slow: bool) -> tuple[np.ndarray, np.ndarray]:
        free = self._slow if slow else self._exact
        g: np.ndarray | float = 0.0
        G: np.ndarray | float = 0.0
        cross = None
        for k, b in enumerate(self.blocks):
            rows = np.asarray(columns(b) * np.asarray(b.coordinates["drivers"][driver]), float)
            if slow:
                weighed = rows * self.known[k]
                g, G, with_own = g + rows @ self.weighed[k], G + weighed @ rows.T, self.own[k][1] @ weighed.T
            else:
                white = self._white(k, np.ascontiguousarray(rows.T))
                g, G, with_own = g + white.T @ self.white[k], G + white.T @ white, self.own_white[k].T @ white
            cross = np.zeros((len(free), len(rows))) if cross is None else cross
            cross[self.own[k][0]] += with_own
        assert cross is not None
        return free.taken_out(np.asarray(g), np.asarray(G), cross)

    def each(self, columns: Columns, driver: int) -> list[tuple[np.ndarray, np.ndarray]]:
        """The same of each recording by itself."""
        out = []
        for k, b in enumerate(self.blocks):
            rows = np.ascontiguousarray((columns(b) * np.asarray(b.coordinates["drivers"][driver])).T, float)
            rows = self._white(k, rows)
            out.append(self._alone[k].taken_out(rows.T @ self.white[k], rows.T @ rows, self.own_white[k].T @ rows))
        return out


class _Free:
    """What is free beside a form: its information and score, to be taken out of a form's."""

    def __init__(self, information: np.ndarray, score: np.ndarray):
        self.scale = 1.0 / np.sqrt(np.diag(information))
        self.lower = np.linalg.cholesky(information * np.outer(self.scale, self.scale) + ROUNDING * np.eye(len(score)))
        self.score = self._through(score)

    def __len__(self) -> int:
        return len(self.score)

    @property
    def fitted(self) -> np.ndarray:
        """(free,) what is free, fitted."""
        if not len(self.scale):
            return self.score
        return self.scale * solve_triangular(self.lower, self.score, lower=True, trans="T", check_finite=False)

    def _through(self, x: np.ndarray) -> np.ndarray:
        if not len(self.scale):
            return x
        return solve_triangular(self.lower, (x.T * self.scale).T, lower=True, check_finite=False)

    def taken_out(self, g: np.ndarray, G: np.ndarray, cross: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Score and information of columns with what is free marginalised; ``cross`` (free, column)."""
        X = self._through(cross)
        found = G - X.T @ X
        apart = np.diag(found) > APART * np.diag(G)
        return np.where(apart, g - X.T @ self.score, 0.0), np.where(np.outer(apart, apart), found, np.diag(np.diag(G)))


@dataclass(frozen=True)
class Scored:
    """Score and information (cell,) of a driver in cells, and that which each shares with what is free (free, cell)."""

    g: np.ndarray
    power: np.ndarray
    cross: np.ndarray
    free: _Free


@compiled
def _binned(at, weight, rows, count):
    """(row, cell) sums of weighed rows over cells."""
    out = np.zeros((count, len(rows)))  # rows side by side: no sum waits for the one before it
    for k in range(len(at)):
        w, cell = weight[k], at[k]
        for q in range(len(rows)):
            out[cell, q] += w * rows[q, k]
    return out.T


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
    # columns may be one and the same, as of a part of a range that no row lies in
    power, along = np.linalg.eigh(M)
    apart = power > max(APART, -ROUNDED * power[0])
    found = float(0.5 * np.sum((along.T @ unit)[apart] ** 2 / power[apart]))
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


def likeliest(values: np.ndarray, tried: np.ndarray) -> tuple[int, float]:
    """Which of some shapes tried (shape,) has the largest log Bayes factor, and the standard deviation about it."""
    k = int(np.argmax(values))
    weight = np.exp(values - values[k])
    return k, float(np.sqrt(weight @ (tried - tried[k]) ** 2 / weight.sum()))


def of_cells(columns: np.ndarray, cells: Scored) -> tuple[np.ndarray, np.ndarray]:
    """Score and information of columns (column, cell) that are constant in each cell, a constant of all apart."""
    shares = columns @ cells.power / max(cells.power.sum(), 1e-300)
    columns = columns - shares[:, None]
    return cells.free.taken_out(columns @ cells.g, (columns * cells.power) @ columns.T, cells.cross @ columns.T)


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

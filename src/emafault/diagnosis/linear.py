"""Blocks of rows made white and compressed to normal matrices, one a recording and equation."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..compiled import compiled
from .evidence import Definite, Normal, factored
from .model import Block
from .whitening import OUTLIER, Weights, coloured, filtered, products, substituted

OWN_FORM = 0.3 / np.sqrt(3.0)  # of an effect's size, each of these functions
OWN_SHARES = (1.0, 0.2)  # of that: as far from the library's as a form is, or near it
SEEN = 4.0  # squared size of its white rows, from which an effect's form in a block matters
MOST_NOISE = 0.9  # of a column's power that may be taken for noise
FEW = 30  # rows
ROUNDING = 1e-10  # of a unit diagonal
UNDERFLOW = 1e-200  # squared size of a column in units of the noise, below which its products are no numbers


@dataclass
class White:
    """A block made white and compressed: its columns' ``names`` and normal matrix ``gram``, the residual last.

    ``own`` is what a second draw of the noise changes the residual by, squared: the noise's part of the misfit;
    ``noise`` (column, column) what it changes the columns by, taken out of ``gram``; ``count`` the number of rows used;
    ``spread`` the log determinant of their noise's covariance, which a parameter may widen.
    """

    recording: str
    equation: str
    names: list[str]
    gram: np.ndarray
    count: int
    own: float = 0.0
    noise: np.ndarray | None = None
    spread: float = 0.0

    @property
    def misfit(self) -> float:
        """-2 log likelihood up to a constant of the rows, less the noise's part of it."""
        return float(self.gram[-1, -1]) - self.own + self.spread


def remainder_columns(block: Block, size: float) -> tuple[list[str], list[np.ndarray]]:
    """Columns of an equation's undescribed remainder, ``size`` high: functions of each coordinate, the equation's own
    drivers with coefficients that change along them, and slow functions with coefficients of each recording's own."""
    phi = block.coordinates["phi"]
    columns = {f"remainder.{block.equation}.0.{f}": size * function for f, function in enumerate(phi)}
    columns |= _driven_columns(block, size, block.coordinates["drivers"])
    for f in block.coordinates.get("each", ()):
        columns[f"remainder.{block.equation}.0.{f}@{block.recording}"] = size * phi[f]
    return list(columns), list(columns.values())


def _driven_columns(block: Block, size: float, drivers: np.ndarray) -> dict[str, np.ndarray]:
    """Those of them that drivers (driver, row) have a coefficient in, or what changes of these change them by."""
    phi = block.coordinates["phi"]
    sizes = block.coordinates.get("sizes", {})  # of drivers whose coefficient is known to change by so much
    return {
        f"remainder.{block.equation}.{d}.{f}": sizes.get(d, size) * driver * phi[f]
        for d, driver in enumerate(drivers[1:], start=1)
        if sizes.get(d, size) > 0.0
        for f in block.coordinates["slow"]
    }


def _noise_of(block: Block) -> float:
    """Standard deviation of the noise of a block's rows, the median."""
    return float(np.sqrt(np.median(block.bands[0])))


@dataclass(frozen=True)
class OwnForm:
    """A unit that may have another form than the library's: ``amounts`` of its parameters from off, and ``sizes`` that
    the parameters which its form may have besides are of, by column."""

    amounts: Mapping[str, float]
    sizes: Mapping[str, float] = field(default_factory=dict)

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns that it is made of."""
        return (*self.amounts, *self.sizes)


OwnForms = Mapping[str, OwnForm]  # by unit


def columns_of_forms(own: OwnForms | None) -> set[str]:
    """Names of the columns that own forms are made of."""
    return {n for form in (own or {}).values() for n in form.columns}


def own_columns(block: Block, unit: str, own: OwnForm) -> tuple[list[str], list[np.ndarray]]:
    """What a unit's amounts add to a block, times functions of the coordinates, the first of them constant, and what
    else its form may have, at its size, which needs none of them: its form where that is not the library's."""
    columns = {f"own.{unit}.{n}": x * block.columns[n] for n, x in own.sizes.items() if n in block.columns}
    added = _added(block, own.amounts)
    if np.sum(_white(block, added) ** 2) >= SEEN:
        columns |= {_name(unit, block, f): added * function for f, function in enumerate(block.coordinates["own"])}
    return list(columns), list(columns.values())


def _name(unit: str, block: Block, function: int) -> str:
    return f"own.{unit}.{block.equation}.{function}"


def function_of(own: str) -> int | None:
    """Number of the function that a column of an own form multiplies the unit's by; None where it is a parameter's."""
    last = own.rpartition(".")[2]
    return int(last) if last.isdigit() else None


def _added(block: Block, amounts: Mapping[str, float]) -> np.ndarray:
    """What amounts of parameters add to a block (row,)."""
    parts = [amount * np.asarray(block.columns[n]) for n, amount in amounts.items() if n in block.columns]
    return np.broadcast_to(sum(parts, np.zeros(1)), len(block.residual))


def white_rows(
    block: Block, wanted: Sequence[str], remainder: bool, own: OwnForms | None = None
) -> tuple[list[str], np.ndarray]:
    """A block's columns as ``raw_columns`` has them: names, and (row, column) divided by the noise's covariance."""
    names, columns = raw_columns(block, wanted, remainder, own)
    rows = columns_of(columns, len(block.residual))
    substituted(block.factor, block.usable, rows)
    return names, rows


def _white(block: Block, x: np.ndarray) -> np.ndarray:
    """(row,) divided by the noise's covariance."""
    rows = np.array(x, float)[:, None]
    substituted(block.factor, block.usable, rows)
    return rows[:, 0]


def raw_columns(
    block: Block, wanted: Sequence[str], remainder: bool, own: OwnForms | None = None
) -> tuple[list[str], list]:
    """A block's columns ``wanted`` that act in it, with its remainder's and units' own forms, and its residual last:
    names without that of the residual, and columns, each (row,) or a scalar."""
    names = [n for n in wanted if n in block.columns]
    columns = [block.columns[n] for n in names]
    if remainder:
        more, extra = remainder_columns(block, _noise_of(block))
        names, columns = names + more, columns + extra
    for unit, form in (own or {}).items():
        more, extra = own_columns(block, unit, form)
        names, columns = names + more, columns + extra
    return names, [*columns, block.residual]


def columns_of(columns: Sequence, count: int) -> np.ndarray:
    """(row, column) in the order of memory that the filters go along."""
    out = np.empty((len(columns), count))
    for k, c in enumerate(columns):
        out[k] = c
    return np.ascontiguousarray(out.T)


def compressed(block: Block, names: list[str], rows: np.ndarray, weights: Weights | None) -> White:
    """Normal matrix of a block's white rows under its weights."""
    weighed = _weighed(rows, weights)
    used = block.usable if weights is None else weights.usable
    gram = weighed.T @ weighed
    return White(block.recording, block.equation, names, gram, int(used.sum()), spread=_spread(block, used))


def compressed_columns(block: Block, names: list[str], columns: Sequence, weights: Weights | None) -> White:
    """The same of raw columns, without all of their white rows in memory at once."""
    w = weights if weights is not None else Weights(block.usable, np.zeros(0), np.ones(len(block.usable)))
    gram = products(block.factor, block.usable, columns, w)
    return White(
        block.recording, block.equation, names, gram, int(w.usable.sum()), spread=_spread(block, w.usable)
    )  # fmt: skip


def _spread(block: Block, used: np.ndarray) -> float:
    """Log determinant of the noise's covariance over the rows used, where the point changes how large errors may be.

    Of a noisy signal that the point only filters it says nothing: the likelihood with the true signal at its best has
    none (functional errors in variables: Fuller 1987, Measurement Error Models, section 1.1.2).
    """
    return 0.0 if block.filters else 2.0 * float(np.sum(np.log(block.factor[0][used & block.usable])))


def _weighed(rows: np.ndarray, weights: Weights | None) -> np.ndarray:
    return rows if weights is None else filtered(rows, weights)


def disturbance(
    block: Block,
    disturbed: Block,
    names: Sequence[str],
    weights: Weights | None,
    own: OwnForms | None = None,
) -> np.ndarray:
    """(column, column) what noise adds to the products of a block's columns ``names`` and its residual, the last.

    To the first order a second draw of the noise changes the columns and the residual as the first did; the products
    of these changes with one another are what noise adds on average (Fuller 1987, Measurement Error Models, section
    2.2).
    """
    changes = {n: disturbed.columns.get(n, 0.0) - block.columns[n] for n in names if n in block.columns}
    wanted = set(names)
    for unit, form in (own or {}).items():  # an own form has the noise of what it is a form of
        more = _added(disturbed, form.amounts) - _added(block, form.amounts)
        for f, function in enumerate(block.coordinates["own"]):
            if (name := _name(unit, block, f)) in wanted:
                changes[name] = more * function
        for n, size in form.sizes.items():
            if (name := f"own.{unit}.{n}") in wanted:
                changes[name] = size * (disturbed.columns[n] - block.columns[n])
    if "changes" in block.coordinates:
        driven = _driven_columns(block, _noise_of(block), block.coordinates["changes"])
        changes |= {n: c for n, c in driven.items() if n in wanted}
    changed = {n: c for n, c in changes.items() if np.any(c)}
    used = weights if weights is not None else Weights(block.usable, np.zeros(0), np.ones(len(block.usable)))
    residual = np.asarray(disturbed.residual - block.residual)
    # a draw that is an outlier would not have been used
    drawn = _white(block, residual)
    used = replace(used, usable=used.usable & (np.abs(drawn) < OUTLIER * np.sqrt(used.variance)))
    some = products(block.factor, block.usable, [*changed.values(), residual], used)
    index = {n: k for k, n in enumerate(names)}
    k = np.array([*(index[n] for n in changed), len(names)], int)
    gram = np.zeros((len(names) + 1, len(names) + 1))
    gram[np.ix_(k, k)] = some
    return gram


def correct(white: White, noise: np.ndarray) -> None:
    """Take out of a normal matrix what the noise in the regressors adds to it, in place.

    ``noise``: products of the changes of its columns, the residual's last, as ``disturbance`` has them.
    """
    last = len(white.names)
    power = np.diag(noise)
    most = np.append(MOST_NOISE * np.diag(white.gram)[:last], np.inf)
    scale = np.where(power > most, np.sqrt(np.maximum(most, 0.0) / np.where(power > most, power, 1.0)), 1.0)
    taken = noise * np.outer(scale, scale)
    misfit = white.gram[-1, -1]  # the same for all hypotheses
    white.gram -= taken
    white.noise = taken[:-1, :-1]
    white.own = misfit - float(white.gram[-1, -1])
    white.gram[-1, -1] = misfit
    white.gram = _definite(white.gram)
    white.gram[-1, -1] = misfit  # whatever columns there are, sets are compared by it


def _definite(gram: np.ndarray) -> np.ndarray:
    """The nearest matrix without negative eigenvalues, on the scale of a unit diagonal."""
    power = np.diag(gram)
    scale = np.where(power > 0.0, np.sqrt(np.maximum(power, 0.0)), 1.0)
    scaled = gram / np.outer(scale, scale)
    if factored(scaled + ROUNDING * np.eye(len(gram))):
        return gram
    values, vectors = np.linalg.eigh(scaled)
    vectors *= scale[:, None]
    return (vectors * np.maximum(values, 0.0)) @ vectors.T


def assemble(whites: Sequence[White], names: Sequence[str], aliases: dict[str, str]) -> Normal:
    """Sum of the normal matrices over blocks; a column that is an alias repeats its quantity's."""
    index = {n: k for k, n in enumerate(names)}
    of: dict[str, list[int]] = {}
    for n in names:
        of.setdefault(aliases.get(n, n), []).append(index[n])
    size = len(names)
    H, g, c = np.zeros((size, size)), np.zeros(size), 0.0
    noise = np.zeros((size, size))
    for w in whites:
        source, target = [], []
        for k, n in enumerate(w.names):
            for t in of.get(n, ()):
                source.append(k)
                target.append(t)
        rows, into = np.array(source, int), np.array(target, int)
        _add(H, w.gram, rows, into)
        g[into] += w.gram[rows, -1]
        c += w.misfit
        if w.noise is not None:
            _add(noise, w.noise, rows, into)
    return Normal(list(names), *_as_sure(H, g, noise), c, sum(w.own for w in whites))


@compiled
def _add(H, gram, rows, into):
    """Adds some ``rows`` and columns of a matrix to those of another where they go ``into``, each to its own."""
    for k in range(len(rows)):
        for m in range(len(rows)):
            H[into[k], into[m]] += gram[rows[k], rows[m]]


def _as_sure(H: np.ndarray, g: np.ndarray, noise: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Normal equations with the same solution, which say no more than noisy regressors do.

    Corrected for the noise N in the columns, H a = -g has no bias, but the scatter of g is that of the columns as they
    were, U = H + N. The covariance of a is H^-1 U H^-1 (the sandwich; White 1982, Econometrica 50, 1), and what says
    just that is H U^-1 H in the place of H, with H U^-1 g in the place of g.
    """
    noisy = np.flatnonzero(np.diag(noise) > 0.0)
    if not len(noisy):
        return H, g
    U = H + noise
    # along what the data say nothing of, U and N are rounding, whose ratio must not count
    U[np.diag_indices_from(U)] += np.where(np.diag(U) > UNDERFLOW, ROUNDING * np.diag(U), 1.0)
    solved = Definite(U).solve(np.column_stack([noise[:, noisy], g]))
    inner = noise[noisy][:, noisy] - noise[noisy] @ solved[:, :-1]
    H, g = H.copy(), g.copy()
    H[np.ix_(noisy, noisy)] -= 0.5 * (inner + inner.T)
    g[noisy] -= noise[noisy] @ solved[:, -1]
    return H, g


def full_model(whites: Sequence[White], prior: Mapping[str, tuple[float, float]]) -> dict[str, float]:
    """Deviations with everything free under its prior: what they leave is noise, or beyond all of the library.

    ``prior`` column -> mean and standard deviation; remainders have one of unit width.
    """
    names = list(dict.fromkeys(n for w in whites for n in w.names))
    normal = assemble(whites, names, {})
    mean, sd = np.array([prior.get(n, (0.0, OWN_FORM if n.startswith("own.") else 1.0)) for n in names]).T
    A = normal.H * np.outer(sd, sd) + np.eye(len(names))
    d = mean + sd * Definite(A).solve(-(normal.g + normal.H @ mean) * sd)
    return dict(zip(names, d.tolist(), strict=True))


def weights_from(
    block: Block, names: Sequence[str], columns: Sequence, deviations: Mapping[str, float], leads: bool = False
) -> Weights:
    """Weights of a block from what a full model's deviations leave of its rows; common to all hypotheses.

    ``columns`` as ``raw_columns`` has them. Of the set that ``leads``, at its own optimum, what is left may wander or
    come and go; of a linear model far from its optimum it is not known to be noise.
    """
    usable = block.usable
    if not usable.any():
        return Weights(usable, np.zeros(0), np.ones(len(usable)))
    raw = np.array(block.residual, float)
    for n, column in zip(names, columns, strict=False):
        raw += deviations.get(n, 0.0) * column
    left = _white(block, raw)
    scale = np.median(np.abs(left[usable])) / 0.6745
    out = usable & (np.abs(left) > OUTLIER * max(scale, 1.0 if block.rounded else 1e-12))
    keep = usable & ~(out | np.roll(out, 1))
    if keep.sum() < 0.5 * usable.sum():
        keep = usable
    if keep.sum() < FEW:  # no spectrum: the noise as stated, or more
        return Weights(keep, np.zeros(0), np.full(len(keep), max(float(np.mean(left[keep] ** 2)), 1.0)))
    # most rows may leave nothing where all of a current is rounded off, the others have no less of an error for it
    found = coloured(np.where(keep, left, 0.0), keep, leads, 1.0 if block.rounded else 0.0)
    return replace(found, wandering=()) if block.rounded else found

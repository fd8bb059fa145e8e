"""What the twins of measured machines share: blocks of statistics, the model evaluated on them, readers, checks."""

import csv
import gzip
import io
import zipfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from emafault.errors import InputError
from emafault.gap.twin import Cell, Hypothesis, Parameter

Arrays = dict[str, np.ndarray]


@dataclass(frozen=True)
class Block:
    """The statistics of one recording, and what the model needs to predict them.

    Parameters
    ----------
    cells : one per statistic
    observed : (statistic,)
    covariance : (statistic, statistic)
    inputs : anything the twin's model reads; arrays whose last axis is the statistic, or keyed tables
    """

    cells: Sequence[Cell]
    observed: np.ndarray
    covariance: np.ndarray
    inputs: Mapping[str, np.ndarray] = field(default_factory=dict)


Model = Callable[[Mapping[str, np.ndarray], Block], np.ndarray]


@dataclass
class MeasuredTwin:
    """A measured machine as the diagnosis sees it (see ``emafault.gap.twin.Twin``).

    ``model`` maps parameters by name, each (point, 1), and one block to (point, statistic). ``reference`` holds what an
    independent measurement or the nameplate says, ``notes`` what the reader should know of the split and the data.
    """

    name: str
    case: str
    explore: tuple[str, ...]
    confirm: tuple[str, ...]
    blocks: Mapping[str, Block]
    parameters: Sequence[Parameter]
    hypotheses: Sequence[Hypothesis]
    model: Model
    notes: tuple[str, ...] = ()
    coordinates: Mapping[str, str] = field(default_factory=dict)  # in words, where not those of a rotor

    def cells(self, part: Sequence[str]) -> list[Cell]:
        """One cell per statistic of these recordings."""
        return [cell for recording in part for cell in self.blocks[recording].cells]

    def observed(self, part: Sequence[str]) -> np.ndarray:
        """(statistic,) statistics of the recordings as brought."""
        return np.concatenate([self.blocks[recording].observed for recording in part])

    def predict(self, values: np.ndarray, part: Sequence[str]) -> np.ndarray:
        """(point, parameter) parameter values -> (point, statistic) expected statistics."""
        values = np.atleast_2d(np.asarray(values, float))
        named = {p.name: values[:, [k]] for k, p in enumerate(self.parameters)}
        return np.concatenate([self.model(named, self.blocks[recording]) for recording in part], axis=1)

    def covariance(self, values: np.ndarray, part: Sequence[str]) -> np.ndarray:
        """(statistic, statistic) covariance of the statistics; recordings are independent of each other."""
        sizes = [len(self.blocks[recording].observed) for recording in part]
        total = np.zeros((sum(sizes), sum(sizes)))
        start = 0
        for recording, size in zip(part, sizes):
            total[start : start + size, start : start + size] = self.blocks[recording].covariance
            start += size
        return total

    def without(self, *effects: str) -> "MeasuredTwin":
        """The same machine with these effects taken out of the library; their parameters stay off.

        Raises
        ------
        InputError
            when an effect is not in the library.
        """
        known = [h.effect for h in self.hypotheses]
        for effect in effects:
            if effect not in known:
                raise InputError(f"twin {self.name}: effect {effect!r} is not in the library: {', '.join(known)}")
        return replace(self, hypotheses=tuple(h for h in self.hypotheses if h.effect not in effects))


@dataclass(frozen=True)
class Distortion:
    """A known change of the raw arrays for the withheld check, with the effects any of which rightly names it.

    ``effects`` is empty where nothing in the library can express the change: the verdict should then be unknown in
    ``equation``.
    """

    name: str
    apply: Callable[[Arrays], Arrays]
    effects: tuple[str, ...]
    equation: str


def nuisance(
    name: str, units: str, mean: float, sd: float, low: float = -np.inf, high: float = np.inf, **keys
) -> Parameter:
    """A parameter of the base model, always free, with a Gaussian prior of mean and sd."""
    step = 1e-3 * sd
    return Parameter(name, units, mean, mean, sd, low, high, step, **keys)


def freedom(
    effect: str,
    name: str,
    units: str,
    sd: float,
    low: float = -np.inf,
    high: float = np.inf,
    mean: float = 0.0,
    off: float = 0.0,
) -> Parameter:
    """A parameter that an effect frees: zero (``off``) without the effect."""
    return Parameter(name, units, off, mean, sd, low, high, 1e-3 * sd, effect=effect)


def library(
    parameters: Sequence[Parameter],
    equations: Mapping[str, tuple[str, ...]],
    starts: Mapping[str, tuple[tuple[float, ...], ...]] | None = None,
) -> tuple[Hypothesis, ...]:
    """One hypothesis per effect of ``equations``, with its parameters; a fit starts at one prior width unless told.

    An instrument's gain, offset or drift is an effect like any other here: no tolerance of these instruments is known.
    """
    found = []
    for effect, where in equations.items():
        own = [p for p in parameters if p.effect == effect]
        usual = tuple(p.mean if p.mean != 0 else min(p.sd, p.high) for p in own)
        found.append(Hypothesis(effect, where, tuple(p.name for p in own), (starts or {}).get(effect, (usual,))))
    return tuple(found)


def smooth_covariance(x: np.ndarray, sd: float | np.ndarray, length: float) -> np.ndarray:
    """(n, n) covariance of a smooth instrument error of size sd that decorrelates over ``length`` along x.

    Squared exponential; a little of it is taken as white so that the matrix stays well conditioned.
    """
    x = np.asarray(x, float)
    kernel = np.exp(-0.5 * ((x[:, None] - x[None, :]) / length) ** 2)
    scale = np.broadcast_to(np.asarray(sd, float), x.shape)
    return (0.95 * kernel + 0.05 * np.eye(x.size)) * scale[:, None] * scale[None, :]


def mean_variance(samples: np.ndarray, batches: int = 5) -> np.ndarray:
    """Variance of the mean of autocorrelated samples (time, ...) from the scatter of batch means about a straight line.

    The trend is removed because the model predicts it; with fewer than two samples per batch they are taken as white.
    """
    samples = np.asarray(samples, float)
    count = samples.shape[0]
    if count < 2 * batches:
        return samples.var(axis=0, ddof=1) / count if count > 1 else np.zeros(samples.shape[1:])
    edges = np.linspace(0, count, batches + 1).astype(int)
    means = np.stack([samples[a:b].mean(axis=0) for a, b in pairwise(edges)])
    line = np.linspace(-1, 1, batches).reshape((-1,) + (1,) * (means.ndim - 1))
    slope = (line * means).sum(axis=0) / (line**2).sum()
    rest = means - means.mean(axis=0) - slope * line
    return (rest**2).sum(axis=0) / (batches - 2) / batches


def read_columns(path: Path, required: Sequence[str]) -> Arrays:
    """Numeric columns of a CSV file, plain or gzip; a cell that is no number becomes NaN.

    Raises
    ------
    InputError
        when the file cannot be read or a required column is missing.
    """
    table = read_table(path)
    missing = [name for name in required if name not in table]
    if missing:
        raise InputError(f"{path}: column {missing[0]!r} is missing; needed are {', '.join(required)}")
    return {name: to_numbers(cells) for name, cells in table.items()}


def read_table(path: Path) -> dict[str, list[str]]:
    """Columns of a CSV file as text (first line names them).

    Raises
    ------
    InputError
        when the file is absent, not text, empty, or has no rows.
    """
    try:
        raw = Path(path).read_bytes()
        text = (gzip.decompress(raw) if raw[:2] == b"\x1f\x8b" else raw).decode("utf-8-sig")
    except (OSError, EOFError, UnicodeDecodeError) as problem:
        raise InputError(f"{path}: cannot be read as a CSV file ({problem})") from None
    rows = list(csv.reader(io.StringIO(text)))
    if len(rows) < 2:
        raise InputError(f"{path}: no rows; a header line and data are needed")
    header = rows[0]
    body = [row for row in rows[1:] if row]
    for number, row in enumerate(body, start=2):
        if len(row) != len(header):
            raise InputError(f"{path}: line {number} has {len(row)} cells, the header {len(header)}")
    return {name: [row[k] for row in body] for k, name in enumerate(header)}


def to_numbers(cells: Sequence[str]) -> np.ndarray:
    """(row,) float64, NaN where the text is no number."""

    def number(text: str) -> float:
        try:
            return float(text)
        except ValueError:
            return np.nan

    return np.array([number(text) for text in cells])


def read_arrays(path: Path) -> Arrays:
    """Arrays of an .npz file.

    Raises
    ------
    InputError
        when the file is not a readable .npz of numbers.
    """
    try:
        with np.load(path, allow_pickle=False) as store:
            return {name: np.asarray(store[name], float) for name in store.files}
    except (OSError, ValueError, EOFError, AttributeError, zipfile.BadZipFile) as problem:
        raise InputError(f"{path}: cannot be read as an .npz file of numbers ({problem})") from None


def require_finite(path: object, arrays: Arrays, names: Sequence[str], rows: int) -> None:
    """Check that these columns are finite, equally long and have at least ``rows`` rows.

    Raises
    ------
    InputError
        naming the column and the first bad row.
    """
    for name in names:
        values = arrays[name]
        if values.shape[0] < rows:
            raise InputError(f"{path}: {name!r} has {values.shape[0]} rows, at least {rows} are needed")
        if values.shape[0] != arrays[names[0]].shape[0]:
            raise InputError(f"{path}: {name!r} and {names[0]!r} differ in length")
        bad = ~np.isfinite(values.reshape(values.shape[0], -1)).all(axis=1)
        if bad.any():
            raise InputError(f"{path}: {name!r} is not a finite number in row {int(np.argmax(bad)) + 1}")

"""A jump at a time, the same in all recordings."""

from collections.abc import Callable, Mapping

import numpy as np

from ..left import Found, Left, Shape, beside_first, likeliest, of_cells, singly

AXIS = "time (s)"  # of its picture
ALONG = "time"
EACH = False
POSITIVE: tuple[str, ...] = ()
ENDS: tuple[str, ...] = ()
CHANNELS: tuple[str, ...] = ("current", "voltage", "angle", "output")  # of the measuring chain that may have it
COEFFICIENTS = ("jump",)
CELLS = 32
FINER = 6


def columns(coordinates: Mapping, shape: Shape) -> np.ndarray:
    """(1, row) zero before, one after."""
    return after(coordinates, np.array([shape["time"]]))


def after(coordinates: Mapping, times: np.ndarray) -> np.ndarray:
    """(time, row) the part of each row after some times: of a sample none or all, of a mean over an interval that of
    the interval, of an acceleration, which a second difference weighs with a triangle of two, that of its area."""
    intervals = coordinates.get("averaged", 0)
    away = (np.asarray(coordinates["time"]) - times[:, None]) / _spacing(coordinates)
    if intervals == 0:
        return (away > 0.0).astype(float)
    if intervals == 1:
        return np.clip(away + 0.5, 0.0, 1.0)
    rise = 0.5 * (1.0 - np.minimum(np.abs(away), 1.0)) ** 2
    return np.where(away < 0.0, rise, 1.0 - rise)


def _spacing(coordinates: Mapping) -> float:
    """Time from row to row (s)."""
    return float(np.median(np.diff(coordinates["time"])))


def nearer(left: Left, at: float, columns: Callable[[Mapping, np.ndarray], np.ndarray], driver: int):
    """The best of some times near one, their standard deviation and its approximate log Bayes factor, a constant of the
    driver apart; ``columns`` (time, row) of a block's coordinates and times."""
    width, finest = left.longest / CELLS, min(_spacing(b.coordinates) for b in left.blocks)
    while True:
        times = at + width * np.linspace(-1.0, 1.0, 2 * FINER + 1)

        def of(b, times=times):
            return np.vstack([np.ones(len(b.residual)), columns(b.coordinates, times)])

        values = singly(*beside_first(*left.products(of, driver)))
        k, deviation = likeliest(values, times)
        at, width = float(times[k]), width / FINER
        if width < finest:
            return at, deviation + width, float(values[k])


def coarse(left: Left, driver: int) -> tuple[Shape, float] | None:
    """The best of times that divide the longest recording."""
    width = left.longest / CELLS
    cells = left.cells(lambda b: (np.asarray(b.coordinates["time"]) / width).astype(int), CELLS, driver)
    values = singly(*of_cells(np.array([np.arange(CELLS) >= k for k in range(1, CELLS)], float), cells))
    return {"time": float(width * (1 + np.argmax(values)))}, float(values.max())


def fine(left: Left, driver: int, shape: Shape) -> list[Found]:
    """The time."""
    at, deviation, value = nearer(left, shape["time"], after, driver)
    return [Found((("time", at, deviation, "s"),), value, float(CELLS * FINER))]


def told(values: np.ndarray, shape: Shape) -> dict[str, float]:
    """The jump itself."""
    return {"jump": float(values[0])}


def position(coordinates: Mapping, shape: Shape, values: np.ndarray) -> np.ndarray:
    """(row,) time."""
    return np.asarray(coordinates["time"])

"""A jump at a time, the same in all recordings."""

from collections.abc import Mapping

import numpy as np

from ..left import Found, Left, Shape, beside_first, of_cells, singly

AXIS = "time (s)"  # of its picture
ALONG = "time"
EACH = False
POSITIVE: tuple[str, ...] = ()
CHANNELS: tuple[str, ...] = ("current", "voltage", "output")  # of the measuring chain that may have it
COEFFICIENTS = ("jump",)
CELLS = 32
FINER = 6


def columns(coordinates: Mapping, shape: Shape) -> np.ndarray:
    """(1, row) zero before, one after."""
    return (np.asarray(coordinates["time"]) > shape["time"])[None].astype(float)


def _values(left: Left, driver: int, times: np.ndarray) -> np.ndarray:
    """(time,) approximate log Bayes factors, a constant of the driver apart."""
    after = np.concatenate([[-1.0], times])[:, None]
    return singly(*beside_first(*left.products(lambda b: b.coordinates["time"] > after, driver)))


def coarse(left: Left, driver: int) -> tuple[Shape, float] | None:
    """The best of times that divide the longest recording."""
    width = left.longest / CELLS
    cells = left.cells(lambda b: (np.asarray(b.coordinates["time"]) / width).astype(int), CELLS, driver)
    values = singly(*of_cells(np.array([np.arange(CELLS) >= k for k in range(1, CELLS)], float), cells))
    return {"time": float(width * (1 + np.argmax(values)))}, float(values.max())


def fine(left: Left, driver: int, shape: Shape) -> list[Found]:
    """The time."""
    at, width = shape["time"], left.longest / CELLS
    for _ in range(2):
        times = at + width * np.linspace(-1.0, 1.0, 2 * FINER + 1)
        values = _values(left, driver, times)
        at, width = float(times[int(np.argmax(values))]), width / FINER
    weight = np.exp(values - values.max())
    deviation = float(np.sqrt(weight @ (times - at) ** 2 / weight.sum())) + width
    return [Found((("time", at, deviation, "s"),), float(values.max()), float(CELLS * FINER))]


def told(values: np.ndarray) -> dict[str, float]:
    """The jump itself."""
    return {"jump": float(values[0])}


def position(coordinates: Mapping, shape: Shape, values: np.ndarray) -> np.ndarray:
    """(row,) time."""
    return np.asarray(coordinates["time"])

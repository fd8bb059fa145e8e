"""A jump that is undone at a later time, the same in all recordings."""

from collections.abc import Mapping

import numpy as np

from ..left import Found, Left, Shape, of_cells, singly
from . import step_change

# beside its two times it is what a jump is
ENDS = ("time", "until")
AXIS, ALONG, EACH, POSITIVE = step_change.AXIS, step_change.ALONG, step_change.EACH, step_change.POSITIVE
CHANNELS, COEFFICIENTS, CELLS = step_change.CHANNELS, step_change.COEFFICIENTS, step_change.CELLS
told, position = step_change.told, step_change.position


def columns(coordinates: Mapping, shape: Shape) -> np.ndarray:
    """(1, row) one from the one time to the other, zero elsewhere."""
    begun, over = step_change.after(coordinates, np.array([shape["time"], shape["until"]]))
    return (begun - over)[None]


def coarse(left: Left, driver: int) -> tuple[Shape, float] | None:
    """The best of times that divide the longest recording."""
    width = left.longest / CELLS
    cells = left.cells(lambda b: (np.asarray(b.coordinates["time"]) / width).astype(int), CELLS, driver)
    tried = [(k, m) for k in range(1, CELLS - 1) for m in range(k + 1, CELLS)]
    at = np.arange(CELLS)
    values = singly(*of_cells(np.array([(at >= k) & (at < m) for k, m in tried], float), cells))
    k, m = tried[int(np.argmax(values))]
    return {"time": float(width * k), "until": float(width * m)}, float(values.max())


def fine(left: Left, driver: int, shape: Shape) -> list[Found]:
    """Both times, one after the other."""

    def begun(coordinates: Mapping, times: np.ndarray) -> np.ndarray:
        return step_change.after(coordinates, times) - step_change.after(coordinates, np.array([until]))

    def over(coordinates: Mapping, times: np.ndarray) -> np.ndarray:
        return step_change.after(coordinates, np.array([time])) - step_change.after(coordinates, times)

    time, until = shape["time"], shape["until"]
    for _ in range(2):  # the second is looked for beside the first, which was beside a coarse second one
        time, first, _ = step_change.nearer(left, time, begun, driver)
        until, second, value = step_change.nearer(left, until, over, driver)
    found = (("time", time, first, "s"), ("until", until, second, "s"))
    return [Found(found, value, float(CELLS * (CELLS - 1) // 2 * step_change.FINER**2))]

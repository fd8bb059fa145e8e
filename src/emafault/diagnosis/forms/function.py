"""A function of one coordinate: a cubic spline through six knots, constant beyond them. Its values at the knots add up
to nothing, for a constant is a coefficient that every machine has; what goes with the current is nothing at none, and
what goes with the output angle nothing at its zero: no machine has a constant torque."""

from collections.abc import Mapping

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import null_space

from ..left import Found, Left, Shape, beside_first, gain, of_cells
from ..model import Block

AXIS = "coordinate"  # of its picture
ALONG = "function"  # the coordinate that its shape names
EACH = False
POSITIVE: tuple[str, ...] = ()
CHANNELS: tuple[str, ...] = ()
KNOTS = 6
VALUES = tuple(f"at_{k + 1}" for k in range(KNOTS))
COEFFICIENTS = tuple(f"c_{k + 1}" for k in range(KNOTS - 1))
#: coordinate -> unit
COORDINATES = {"rotor_speed": "rad/s", "current": "A", "output_angle": "rad", "time": "s", "temperature": "degC"}
FROM_ZERO = ("current", "output_angle")  # the coordinates at whose zero the machine is as it is without the form
#: (knot, coefficient) values that add up to nothing, and that begin with it
BALANCED, ABOVE = null_space(np.ones((1, KNOTS))), np.eye(KNOTS)[:, 1:]
CELLS = 40  # of the range
FEWEST = 3  # temperatures that show a function of it


def columns(coordinates: Mapping, shape: Shape) -> np.ndarray:
    """(coefficient, row) splines of values at the knots."""
    return _splines(shape, coordinates[_along(shape)])


def _along(shape: Shape) -> str:
    return tuple(COORDINATES)[int(shape["coordinate"])]


def _values(shape: Shape) -> np.ndarray:
    """(knot, coefficient) values at the knots of a function of a coordinate."""
    if _along(shape) not in FROM_ZERO:
        return BALANCED
    if shape["from"] >= 0.0:
        return ABOVE
    knots = np.linspace(shape["from"], shape["to"], KNOTS)
    at_zero = CubicSpline(knots, np.eye(KNOTS), bc_type="not-a-knot")(min(0.0, knots[-1]))
    return null_space(at_zero[None])


def _splines(shape: Shape, x) -> np.ndarray:
    knots = np.linspace(shape["from"], shape["to"], KNOTS)
    of = CubicSpline(knots, _values(shape), bc_type="not-a-knot")
    return np.ascontiguousarray(of(np.clip(x, knots[0], knots[-1])).T)


def coarse(left: Left, driver: int) -> tuple[Shape, float] | None:
    """The coordinate along which most stands out, a constant of the driver apart."""
    best: tuple[Shape, float] | None = None
    for number, along in enumerate(COORDINATES):
        of = left.blocks[0].coordinates
        if along not in of or (along == "rotor_speed" and driver in of.get("by_speed", ())):
            continue
        x = [np.asarray(b.coordinates[along]) for b in left.blocks]
        low, high = float(min(v.min() for v in x)), float(max(v.max() for v in x))
        if (along == "temperature" and len({float(v[0]) for v in x}) < FEWEST) or high - low < 1e-9:
            continue
        if along == "current":
            low = 0.0
        shape = {"coordinate": float(number), "from": low, "to": high}
        step = (high - low) / CELLS

        def cell(b: Block, along: str = along, low: float = low, step: float = step) -> np.ndarray:
            return ((np.asarray(b.coordinates[along]) - low) / step).astype(int)

        cells = left.cells(cell, CELLS, driver)
        splines = _splines(shape, low + step * (np.arange(CELLS) + 0.5))
        value = gain(*of_cells(splines, cells))
        if best is None or value > best[1]:
            best = shape, value
    return best


def fine(left: Left, driver: int, shape: Shape) -> list[Found]:
    """The same: knots are where the range has them."""

    def of(b: Block) -> np.ndarray:
        return np.vstack([np.ones(len(b.residual)), columns(b.coordinates, shape)])

    value = gain(*beside_first(*left.products(of, driver)))
    along = _along(shape)
    found = tuple((n, v, 0.0, "" if n == "coordinate" else COORDINATES[along]) for n, v in shape.items())
    return [Found(found, value, float(len(COORDINATES)))]


def told(values: np.ndarray, shape: Shape) -> dict[str, float]:
    """Values at the knots."""
    return dict(zip(VALUES, (_values(shape) @ values).tolist(), strict=True))


def position(coordinates: Mapping, shape: Shape, values: np.ndarray) -> np.ndarray:
    """(row,) the coordinate that the shape names."""
    return np.asarray(coordinates[_along(shape)])

"""A function of one coordinate: a cubic spline through six knots, constant beyond them, over the whole range of the
coordinate or over a part of it. Its values at the knots add up to nothing, for a constant is a coefficient that every
machine has; over a part it is nothing on one side of that. What goes with the current is nothing at none, and what goes
with the output angle nothing at its zero: no machine has a constant torque."""

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import null_space

from ..left import Found, Known, Left, Shape, beside_first, gain, of_cells
from ..model import Block

AXIS = "coordinate"  # of its picture
ALONG = "function"  # the coordinate that its shape names
EACH = False
POSITIVE: tuple[str, ...] = ()
CHANNELS: tuple[str, ...] = ("output",)  # of the measuring chain that may have it: a bent sensor
KNOTS = 6
VALUES = tuple(f"at_{k + 1}" for k in range(KNOTS))
COEFFICIENTS = tuple(f"c_{k + 1}" for k in range(KNOTS - 1))
#: coordinate -> unit
COORDINATES = {"rotor_speed": "rad/s", "current": "A", "output_angle": "rad", "time": "s", "temperature": "degC"}
FROM_ZERO = ("current", "output_angle")  # the coordinates at whose zero the machine is as it is without the form
#: (knot, coefficient) values that add up to nothing, that begin with it, and that end with it
BALANCED, ABOVE, BELOW = null_space(np.ones((1, KNOTS))), np.eye(KNOTS)[:, 1:], np.eye(KNOTS)[:, :-1]
NOTHING = (BALANCED, ABOVE, BELOW)  # by the number that a shape has, of what differs by a constant
CELLS = 64  # of the range
PARTS = (2, 4, 8)  # of the range, each of which half overlaps the next
ENDS = ("from", "to")
NEARER = 4  # times that the ends of a part are looked for, each to half the width
FEWEST = 3  # temperatures that show a function of it


def columns(coordinates: Mapping, shape: Shape) -> np.ndarray:
    """(coefficient, row) splines of values at the knots."""
    return _splines(shape, coordinates[_along(shape)])


def _along(shape: Shape) -> str:
    return tuple(COORDINATES)[int(shape["coordinate"])]


def _values(shape: Shape) -> np.ndarray:
    """(knot, coefficient) values at the knots of a function of a coordinate."""
    if _along(shape) not in FROM_ZERO:
        return NOTHING[int(shape.get("nothing", 0.0))]
    if shape["from"] >= 0.0:
        return ABOVE
    knots = np.linspace(shape["from"], shape["to"], KNOTS)
    at_zero = CubicSpline(knots, np.eye(KNOTS), bc_type="not-a-knot")(min(0.0, knots[-1]))
    return null_space(at_zero[None])


def _splines(shape: Shape, x) -> np.ndarray:
    knots = np.linspace(shape["from"], shape["to"], KNOTS)
    of = CubicSpline(knots, _values(shape), bc_type="not-a-knot")
    return np.ascontiguousarray(of(np.clip(x, knots[0], knots[-1])).T)


def _stacked(shapes: Sequence[Shape], x: np.ndarray) -> np.ndarray:
    """(coefficient of each shape, value) splines of several shapes."""
    return np.vstack([_splines(shape, x) for shape in shapes])


def coarse(left: Left, driver: int) -> tuple[Shape, float] | None:
    """The coordinate along which most stands out, over all of its range or a part, a constant of the driver apart."""
    best: tuple[Shape, float] | None = None
    for number, along in enumerate(COORDINATES):
        of = left.blocks[0].coordinates
        if along not in of or (along == "rotor_speed" and driver in of.get("by_speed", ())):
            continue
        low, high = _range(left, along)
        few = along == "temperature" and len({float(b.coordinates[along][0]) for b in left.blocks}) < FEWEST
        if few or high - low < 1e-9:
            continue
        step = (high - low) / CELLS
        parts = _parts(along, low, high)
        shapes = [{"coordinate": float(number), "from": f, "to": t, "nothing": 0.0} for f, t in parts]
        middle = low + step * (np.arange(CELLS) + 0.5)
        splines = left.once(("function", along), partial(_stacked, shapes, middle))

        def cell(b: Block, along: str = along, low: float = low, step: float = step) -> np.ndarray:
            return ((np.asarray(b.coordinates[along]) - low) / step).astype(int)

        g, G = of_cells(splines, left.cells(cell, CELLS, driver))
        for n, shape in enumerate(shapes):
            mine = slice(n * len(COEFFICIENTS), (n + 1) * len(COEFFICIENTS))
            value = gain(g[mine], G[mine, mine]) - float(np.log(max(1, len(shapes) - 1) if n else 1))
            if best is None or value > best[1]:
                best = shape, value
    return best


def _range(left: Left, along: str) -> tuple[float, float]:
    """Least and largest value of a coordinate, a current's from zero."""
    x = [np.asarray(b.coordinates[along]) for b in left.blocks]
    return 0.0 if along == "current" else float(min(v.min() for v in x)), float(max(v.max() for v in x))


def _parts(along: str, low: float, high: float) -> list[tuple[float, float]]:
    """The range of a coordinate and parts of it; temperatures are too few to have any."""
    parts = [(low, high)]
    for n in PARTS if along != "temperature" else ():
        width = (high - low) / n
        parts += [(low + 0.5 * k * width, low + (0.5 * k + 1.0) * width) for k in range(2 * n - 1)]
    return parts


def fine(left: Left, driver: int, shape: Shape) -> list[Found]:
    """The same over the whole range, where knots are where the range has them, or the part's ends, one after the other:
    the whole range is as likely as all parts together."""
    along = _along(shape)
    low, high = _range(left, along)
    parts = len(_parts(along, low, high)) - 1

    def values(shapes: Sequence[Shape]) -> list[float]:
        def of(b: Block) -> np.ndarray:
            return np.vstack([np.ones(len(b.residual)), *(columns(b.coordinates, s) for s in shapes)])

        g, G = left.products(of, driver)
        each = [[0, *range(k, k + len(COEFFICIENTS))] for k in range(1, len(g), len(COEFFICIENTS))]
        return [gain(*beside_first(g[k], G[np.ix_(k, k)])) for k in each]

    whole = {**shape, "from": low, "to": high}
    out = [_found(whole, 0.0, values([whole])[0], 2.0 if parts else 1.0)]
    if (shape["from"], shape["to"]) == (low, high):
        return out
    width, value = 0.25 * (shape["to"] - shape["from"]), -np.inf
    for _ in range(NEARER):
        for end in ENDS:
            ends = np.clip(shape[end] + width * np.arange(-2.0, 3.0), low, high)
            tried = [s for s in ({**shape, end: float(e)} for e in ends) if s["to"] - s["from"] > width]
            at = values(tried)
            shape, value = tried[int(np.argmax(at))], max(at)
        width *= 0.5
    sides = (1.0, 2.0) if along not in FROM_ZERO else (0.0,)
    return out + [_found({**shape, "nothing": side}, width, value, 2.0 * parts) for side in sides]


def _found(shape: Shape, width: float, value: float, among: float) -> Found:
    """A shape whose ends are known to a ``width``."""
    unit = COORDINATES[_along(shape)]
    of = tuple((n, float(v), width if n in ENDS else 0.0, unit if n in ENDS else "") for n, v in shape.items())
    return Found(of, value, len(COORDINATES) * among)


def told(values: np.ndarray, shape: Shape) -> dict[str, float]:
    """Values at the knots."""
    return dict(zip(VALUES, (_values(shape) @ values).tolist(), strict=True))


def position(coordinates: Mapping, shape: Shape, values: np.ndarray) -> np.ndarray:
    """(row,) the coordinate that the shape names."""
    return np.asarray(coordinates[_along(shape)])


def within(coordinates: Mapping, shape: Known) -> np.ndarray | None:
    """(row,) whether anything is known of a function over the whole range of its coordinate there: of recordings that
    go beyond it, not everywhere. None of a part, beyond which it is constant."""
    values = {n: v for n, v, _, _ in shape}
    if _partial(shape):
        return None
    x = np.asarray(coordinates[_along(values)])
    return (x >= values["from"]) & (x <= values["to"])


def _partial(shape: Known) -> bool:
    return any(sd > 0.0 for n, _, sd, _ in shape if n in ENDS)


def widened(shape: Known, ranges: Mapping[str, tuple[float, float]]) -> Known:
    """A shape over the whole range of its coordinate, over what that has in more recordings; a part as it is.

    ``ranges`` : least and largest value of coordinates
    """
    values = {n: v for n, v, _, _ in shape}
    if _partial(shape):
        return shape
    low, high = ranges[_along(values)]
    ends = {"from": min(values["from"], low), "to": max(values["to"], high)}
    return tuple((n, ends.get(n, v), sd, unit) for n, v, sd, unit in shape)


def converted(coefficients: np.ndarray, before: Shape, after: Shape) -> np.ndarray:
    """(coefficient,) of the same function where its shape has other ends."""
    at_knots = coefficients @ _splines(before, np.linspace(after["from"], after["to"], KNOTS))
    return np.linalg.lstsq(_values(after), at_knots)[0]

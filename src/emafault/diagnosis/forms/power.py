"""A power of the speed, as the drag of a fan or of oil that is stirred has it."""

from collections.abc import Mapping

import numpy as np

from ..left import Found, Left, Shape, beside_first, likeliest, of_cells, singly
from ..model import Block

AXIS = "rotor speed (rad/s)"  # of its picture
ALONG = "rotor_speed"
EACH = False
POSITIVE = ("exponent",)
ENDS: tuple[str, ...] = ()
CHANNELS: tuple[str, ...] = ()
COEFFICIENTS = ("at_100_rad_s",)
EXPONENTS = (0.5, 1.5, 2.0, 3.0)  # between them are the constant and the slope that every machine has
FINER = np.geomspace(0.8, 1.25, 9)
CELLS = 40  # of the range of speeds
REFERENCE = 100.0  # rad/s


def columns(coordinates: Mapping, shape: Shape) -> np.ndarray:
    """(1, row) the power of the speed's magnitude, one at ``REFERENCE``."""
    return _powers(np.abs(coordinates["rotor_speed"]), [shape["exponent"]])


def _powers(speed: np.ndarray, exponents) -> np.ndarray:
    return (speed / REFERENCE) ** np.asarray(exponents)[:, None]


def coarse(left: Left, driver: int) -> tuple[Shape, float] | None:
    """The best of a few exponents, a constant of the driver apart."""
    along = left.blocks[0].coordinates
    if "rotor_speed" not in along or driver in along.get("by_speed", ()):
        return None
    top = max(float(np.abs(b.coordinates["rotor_speed"]).max()) for b in left.blocks)
    if top <= 0.0:
        return None
    width = top / CELLS
    cells = left.cells(lambda b: (np.abs(b.coordinates["rotor_speed"]) / width).astype(int), CELLS, driver)
    values = singly(*of_cells(_powers(width * (np.arange(CELLS) + 0.5), EXPONENTS), cells))
    k = int(np.argmax(values))
    return {"exponent": EXPONENTS[k]}, float(values[k])


def fine(left: Left, driver: int, shape: Shape) -> list[Found]:
    """The exponent."""
    tried = shape["exponent"] * FINER

    def of(b: Block) -> np.ndarray:
        return np.vstack([np.ones(len(b.residual)), _powers(np.abs(b.coordinates["rotor_speed"]), tried)])

    values = singly(*beside_first(*left.products(of, driver)))
    k, spread = likeliest(values, tried)
    return [
        Found((("exponent", float(tried[k]), spread + 0.02 * tried[k], "1"),), float(values[k]), float(len(EXPONENTS)))
    ]


def told(values: np.ndarray, shape: Shape) -> dict[str, float]:
    """Its size at the reference."""
    return {"at_100_rad_s": float(values[0])}


def position(coordinates: Mapping, shape: Shape, values: np.ndarray) -> np.ndarray:
    """(row,) the speed's magnitude."""
    return np.abs(coordinates["rotor_speed"])

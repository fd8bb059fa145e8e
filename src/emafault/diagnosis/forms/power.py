"""A power of the speed, as the drag of a fan or of oil that is stirred has it."""

from collections.abc import Mapping, Sequence

import numpy as np

from ..left import Found, Left, Shape, beside_first, of_cells, singly
from ..model import Block
from .spectrum import refined_scale

AXIS = "rotor speed (rad/s)"  # of its picture
ALONG = "rotor_speed"
EACH = False
POSITIVE = ("exponent",)
CHANNELS: tuple[str, ...] = ()
COEFFICIENTS = ("at_100_rad_s",)
EXPONENTS = (0.5, 1.5, 2.0, 3.0)  # between them are the constant and the slope that every machine has
CELLS = 40  # of the range of speeds
REFERENCE = 100.0  # rad/s


def columns(coordinates: Mapping, shape: Shape) -> np.ndarray:
    """(1, row) the power of the speed's magnitude, one at ``REFERENCE``."""
    return _powers(np.abs(coordinates["rotor_speed"]), [shape["exponent"]])


def _powers(speed: np.ndarray, exponents) -> np.ndarray:
    return (speed / REFERENCE) ** np.asarray(exponents)[:, None]


def coarse(left: Left, driver: int) -> tuple[Shape, float] | None:
    """The best of a few exponents, a constant of the driver apart."""
    if "rotor_speed" not in left.blocks[0].coordinates:
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

    def likelihood(exponents: Sequence[float]) -> list[float]:
        def of(b: Block) -> np.ndarray:
            return np.vstack([np.ones(len(b.residual)), _powers(np.abs(b.coordinates["rotor_speed"]), exponents)])

        return singly(*beside_first(*left.products(of, driver))).tolist()

    at, deviation, value = refined_scale(shape["exponent"], EXPONENTS[2] / EXPONENTS[1], likelihood)
    return [Found((("exponent", at, deviation, "1"),), value, float(len(EXPONENTS)))]


def told(values: np.ndarray) -> dict[str, float]:
    """Its size at the reference."""
    return {"at_100_rad_s": float(values[0])}


def position(coordinates: Mapping, shape: Shape, values: np.ndarray) -> np.ndarray:
    """(row,) the speed's magnitude."""
    return np.abs(coordinates["rotor_speed"])

"""A drag that builds up anew over some travel after each reversal, as of a seal or of bristles: the share z of it that
has built up follows dz/dx = (1 - z sgn(dx)) / length (Dahl 1968, Aerospace Corporation report TOR-0158(3107-18)-1)."""

from collections.abc import Mapping

import numpy as np

from ...compiled import compiled
from ..left import Found, Left, Shape, beside_first, likeliest, singly
from ..model import Block

AXIS = "share that has built up"  # of its picture
ALONG = "rotor_angle"
EACH = False
POSITIVE = ("length",)
ENDS: tuple[str, ...] = ()
CHANNELS: tuple[str, ...] = ()
COEFFICIENTS = ("amplitude",)
LENGTHS = 2.0 * np.pi * np.geomspace(0.02, 2.0, 7)  # of turns, to rad
FINER = np.geomspace(0.6, 1.0 / 0.6, 7)


def columns(coordinates: Mapping, shape: Shape) -> np.ndarray:
    """(1, row) the drag of size one."""
    return -_built_up(_travel(coordinates), shape["length"])[None]


def _travel(coordinates: Mapping) -> np.ndarray:
    """(row,) by which the rotor turns from row to row (rad); by its speed, whose noise about rest is the least."""
    return np.asarray(coordinates["rotor_speed"], float) * np.gradient(np.asarray(coordinates["time"], float))


@compiled
def _built_up(travel, length):
    out = np.empty(len(travel))
    z = 0.0
    for n in range(len(travel)):
        side = 1.0 if travel[n] > 0.0 else -1.0
        z = side + (z - side) * np.exp(-abs(travel[n]) / length)
        out[n] = z
    return out


def _values(left: Left, driver: int, lengths: np.ndarray, slow: bool = False) -> np.ndarray:
    def of(b: Block) -> np.ndarray:
        travel = _travel(b.coordinates)
        return np.array([np.ones(len(b.residual)), *(-_built_up(travel, x) for x in lengths)])

    if not slow:
        return singly(*beside_first(*left.products(of, driver)))
    return singly(*beside_first(*left.slowly(lambda b: left.once(("travel", b.recording), lambda: of(b)), driver)))


def coarse(left: Left, driver: int) -> tuple[Shape, float] | None:
    """The best of a few lengths, a constant apart; of a torque alone."""
    known = left.blocks[0].coordinates
    if left.equation != "torque" or driver > 0 or "rotor_speed" not in known or "time" not in known:
        return None
    values = _values(left, driver, LENGTHS, slow=True)
    return {"length": float(LENGTHS[int(np.argmax(values))])}, float(values.max())


def fine(left: Left, driver: int, shape: Shape) -> list[Found]:
    """The length."""
    tried = shape["length"] * FINER
    values = _values(left, driver, tried)
    k, spread = likeliest(values, tried)
    length = float(tried[k])
    return [Found((("length", length, spread + 0.05 * length, "rad"),), float(values[k]), float(len(LENGTHS)))]


def told(values: np.ndarray, shape: Shape) -> dict[str, float]:
    """Its size once it has built up."""
    return {"amplitude": float(values[0])}


def position(coordinates: Mapping, shape: Shape, values: np.ndarray) -> np.ndarray:
    """(row,) the share that has built up, with the sign of the motion."""
    return -columns(coordinates, shape)[0]

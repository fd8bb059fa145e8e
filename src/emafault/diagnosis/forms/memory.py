"""What builds up with a time constant, from nothing at each recording's start: driven by loss or by speed, or as
what warms up once it is switched on; or what is there at the start and goes."""

from collections.abc import Mapping, Sequence

import numpy as np

from ...delays import followed
from ..left import Found, Left, Shape, beside_first, singly
from ..model import Block
from .spectrum import refined

AXIS = "what has built up, or is left"  # of its picture
ALONG = "time"
EACH = False
POSITIVE = ("time_constant",)
ENDS: tuple[str, ...] = ()
CHANNELS: tuple[str, ...] = ("current", "voltage", "output")  # of the measuring chain that may have it
COEFFICIENTS = ("gain",)
#: current squared (A2), magnitude of the speed (100 rad/s), one from the start on, and what that one yet lacks
SOURCES = ("loss", "speed", "start", "decay")
OF_TIME = ("start", "decay")  # which differ by a constant
CONSTANTS = np.geomspace(0.05, 1.0, 6)  # of the longest recording


def columns(coordinates: Mapping, shape: Shape) -> np.ndarray:
    """(1, row) the source through a first-order lag."""
    return _filtered(coordinates, int(shape["source"]), shape["time_constant"], _step(coordinates))[None]


def _filtered(coordinates: Mapping, source: int, constant: float, step: float) -> np.ndarray:
    if SOURCES[source] == "loss":
        x = (0.5 * np.asarray(coordinates["current"])) ** 2
    elif SOURCES[source] in OF_TIME:
        left = np.exp(-np.asarray(coordinates["time"]) / constant)
        return left if SOURCES[source] == "decay" else 1.0 - left
    else:
        x = np.abs(np.asarray(coordinates["rotor_speed"])) / 100.0
    share = 1.0 - np.exp(-step / constant)
    return followed(x, share, 1.0 - share)


def _step(coordinates: Mapping) -> float:
    """Time between rows (s)."""
    steps = np.diff(coordinates["time"])
    return float(np.median(steps)) if len(steps) else np.inf


def _values(left: Left, driver: int, tried: list[tuple[int, float]], slow: bool = False) -> np.ndarray:
    def of(b: Block) -> np.ndarray:
        step = _step(b.coordinates)
        return np.array([np.ones(len(b.residual)), *(_filtered(b.coordinates, *s, step) for s in tried)])

    if not slow:
        return singly(*beside_first(*left.products(of, driver)))
    # of all drivers alike
    return singly(*beside_first(*left.slowly(lambda b: left.once(("memory", b.recording), lambda: of(b)), driver)))


def coarse(left: Left, driver: int) -> tuple[Shape, float] | None:
    """The best of sources and time constants, a constant of the driver apart."""
    if any(n not in left.blocks[0].coordinates for n in ("current", "rotor_speed")):
        return None
    tried = [(k, float(left.longest * c)) for k, of in enumerate(SOURCES) if of != "decay" for c in CONSTANTS]
    values = _values(left, driver, tried, slow=True)
    source, constant = tried[int(np.argmax(values))]
    return {"source": float(source), "time_constant": constant}, float(values.max())


def fine(left: Left, driver: int, shape: Shape) -> list[Found]:
    """The time constant, from the start on both of what builds up and of what goes: the scan takes a constant apart."""
    source = int(shape["source"])

    def likelihood(logs: Sequence[float]) -> list[float]:
        return _values(left, driver, [(source, float(np.exp(x))) for x in logs]).tolist()

    near, half = np.log(shape["time_constant"]), np.log(CONSTANTS[1] / CONSTANTS[0])
    log, deviation = refined(float(near), float(half), likelihood)
    at = float(np.exp(log))
    of = [SOURCES.index(n) for n in OF_TIME] if SOURCES[source] in OF_TIME else [source]
    value, among = likelihood([log])[0], float(len(SOURCES) * len(CONSTANTS))
    return [
        Found((("source", float(k), 0.0, ""), ("time_constant", at, at * deviation, "s")), value, among) for k in of
    ]


def told(values: np.ndarray, shape: Shape) -> dict[str, float]:
    """The gain itself."""
    return {"gain": float(values[0])}


def position(coordinates: Mapping, shape: Shape, values: np.ndarray) -> np.ndarray:
    """(row,) the filtered source."""
    return columns(coordinates, shape)[0]

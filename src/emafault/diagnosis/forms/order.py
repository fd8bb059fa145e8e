"""A wave along the angle of the rotor, a whole number of times a turn or not, in phase over all recordings."""

from collections.abc import Mapping, Sequence

import numpy as np

from ..left import Found, Left, Shape, beside_first, gain
from ..model import Block
from .spectrum import above, refined

AXIS = "phase of the wave (rad)"  # of its picture
ALONG = "order"
EACH = False
POSITIVE = ("order",)
ENDS: tuple[str, ...] = ()
CHANNELS: tuple[str, ...] = ("angle", "output")  # of the measuring chain that may have it
COEFFICIENTS = ("cosine", "sine")
CELLS = 2.5  # of the shortest wave
TURNS = 3.0  # fewest that show an order
AROUND = 30.0  # lines whose level a line stands out of


def columns(coordinates: Mapping, shape: Shape) -> np.ndarray:
    """(2, row) cosine and sine, their means where rows are ``averaged`` over what an interval sweeps."""
    x = shape["order"] * np.asarray(coordinates["angle"])
    half = shape["order"] * np.asarray(coordinates.get("half_sweep", 0.0))
    return np.sinc(half / np.pi) ** coordinates.get("averaged", 0) * np.array([np.cos(x), np.sin(x)])


def coarse(left: Left, driver: int) -> tuple[Shape, float] | None:
    """The order of the line that stands out most of the spectrum along the angle, of all recordings together, or of
    the highest at a whole number if that explains more: low ones stand beside the motion's own."""
    if "angle" not in left.blocks[0].coordinates:
        return None
    first, turns = _span(left)
    if turns < TURNS:
        return None
    highest = _highest(left)
    per_turn = CELLS * highest
    cells = np.zeros(int(turns * per_turn) + 2)
    for b, w in zip(left.blocks, left.remaining, strict=True):
        at = ((np.asarray(b.coordinates["angle"]) - first) / (2.0 * np.pi) * per_turn).astype(int)
        cells += np.bincount(at, w * b.coordinates["drivers"][driver], len(cells))
    size = 1 << int(np.ceil(np.log2(2 * len(cells))))
    power = np.abs(np.fft.rfft(cells, size)) ** 2
    orders = np.arange(len(power)) * per_turn / size
    ratio = above(power, 2 * int(AROUND * size / len(cells)) + 1)
    ratio[(orders < 2.0 / turns) | (orders > highest)] = 0.0
    whole = np.arange(1.0, np.floor(highest) + 1.0)
    most = max(whole, key=lambda n: power[round(n * size / per_turn)], default=1.0)
    tried = [float(orders[int(np.argmax(ratio))]), float(most)]
    value, order = max(zip(_values(left, driver, tried), tried, strict=True))
    return {"order": order}, value


def _span(left: Left) -> tuple[float, float]:
    """Lowest angle (rad) and the turns that all recordings together go over."""
    angles = [np.asarray(b.coordinates["angle"]) for b in left.blocks]
    first = min(a.min() for a in angles)
    return float(first), float((max(a.max() for a in angles) - first) / (2.0 * np.pi))


def _highest(left: Left) -> float:
    """The highest order whose waves rows show, two a wave on average over the way; lower where an equation says so."""
    angles = [np.asarray(b.coordinates["angle"]) for b in left.blocks]
    way = sum(float(np.abs(np.diff(a)).sum()) for a in angles)
    return min(np.pi * sum(map(len, angles)) / way, *(b.coordinates.get("highest_order", np.inf) for b in left.blocks))


def _values(left: Left, driver: int, orders: Sequence[float]) -> list[float]:
    """What a wave of each of several orders explains beside a constant: over a few turns its mean is not zero."""

    def beside_constant(b: Block) -> np.ndarray:
        return np.vstack([np.ones(len(b.residual)), *(columns(b.coordinates, {"order": n}) for n in orders)])

    g, G = left.products(beside_constant, driver)
    each = ([0, k, k + 1] for k in range(1, len(g), 2))
    return [gain(*beside_first(g[k], G[np.ix_(k, k)])) for k in each]


def fine(left: Left, driver: int, shape: Shape) -> list[Found]:
    """The order itself, and the whole number next to it: what turns with the rotor is as likely as all others."""
    _, turns = _span(left)
    highest = _highest(left)
    order, deviation = refined(shape["order"], 0.5 / turns, lambda x: _values(left, driver, x))
    tried = [((("order", order, deviation, "1"),), max(1.0, 2.0 * highest * turns))]
    whole = float(np.round(order))
    if whole >= 1.0 and abs(order - whole) < 1.0 / turns:
        tried.append(((("order", whole, 0.0, "1"),), 2.0 * highest))
    values = _values(left, driver, [s[0][1] for s, _ in tried])
    return [Found(s, value, among) for (s, among), value in zip(tried, values, strict=True)]


def told(values: np.ndarray, shape: Shape) -> dict[str, float]:
    """Amplitude and phase."""
    return {"amplitude": float(np.hypot(*values)), "phase": float(np.arctan2(values[1], values[0]))}


def position(coordinates: Mapping, shape: Shape, values: np.ndarray) -> np.ndarray:
    """(row,) where rows lie along the wave."""
    return np.mod(shape["order"] * np.asarray(coordinates["angle"]) - np.arctan2(values[1], values[0]), 2.0 * np.pi)

"""A Gaussian about one angle of the turn."""

from collections.abc import Mapping

import numpy as np

from ..left import Found, Left, Shape, beside_first, of_cells, singly

AXIS = "angle of the rotor (rad)"  # of its picture
ALONG = "rotor_angle"
EACH = False
POSITIVE = ("width",)
ENDS: tuple[str, ...] = ()
CHANNELS: tuple[str, ...] = ()
COEFFICIENTS = ("depth",)
CELLS = 36  # of the turn
EDGE = 2.0 * np.pi / CELLS
WIDTHS = (0.1, 0.2, 0.4, 0.7)  # rad
WIDEST = 1.0  # rad, standard deviation: what is wider is about no one angle, and beside a constant a wave


def columns(coordinates: Mapping, shape: Shape) -> np.ndarray:
    """(1, row) one at the centre, or its mean where rows are ``averaged`` over what an interval sweeps."""
    return _seen(coordinates, shape["centre"], shape["width"])[None]


def _seen(coordinates: Mapping, centre: float, width: float) -> np.ndarray:
    """A Gaussian averaged: another one, wider by the variance of what it is averaged over."""
    half = np.asarray(coordinates.get("half_sweep", 0.0))
    wide = np.sqrt(width**2 + coordinates.get("averaged", 0) * half**2 / 3.0)
    return width / wide * _about(coordinates["rotor_angle"], centre, wide)


def _about(angle, centre: float, width) -> np.ndarray:
    distance = np.mod(np.asarray(angle) - centre + np.pi, 2.0 * np.pi) - np.pi
    return np.exp(-0.5 * (distance / width) ** 2)


def coarse(left: Left, driver: int) -> tuple[Shape, float] | None:
    """The best of centres and widths, each a sum of cells of the turn."""
    if "angle" not in left.blocks[0].coordinates:
        return None
    cells = left.cells(lambda b: (np.asarray(b.coordinates["rotor_angle"]) / EDGE).astype(int), CELLS, driver)
    middle = EDGE * (np.arange(CELLS) + 0.5)
    tried = [{"centre": float(c), "width": w} for w in WIDTHS for c in middle]
    values = singly(*of_cells(np.array([_about(middle, t["centre"], t["width"]) for t in tried]), cells))
    return tried[int(np.argmax(values))], float(values.max())


def fine(left: Left, driver: int, shape: Shape) -> list[Found]:
    """Centre and width."""
    centre, width = shape["centre"], shape["width"]
    reach, ratio = EDGE, 2.0
    for _ in range(3):
        widths = [min(width * ratio**y, WIDEST) for y in (-1.0, 0.0, 1.0)]
        tried = [(centre + reach * x, w) for x in np.linspace(-1, 1, 5) for w in widths]

        def of(b, tried=tried):
            return np.array([np.ones(len(b.residual)), *(_seen(b.coordinates, *s) for s in tried)])

        values = singly(*beside_first(*left.products(of, driver)))
        (centre, width), reach, ratio = tried[int(np.argmax(values))], reach / 2.5, ratio**0.5
    weight = np.exp(values - values.max())
    spread = [
        float(np.sqrt(weight @ (np.array([s[k] for s in tried]) - at) ** 2 / weight.sum()))
        for k, at in enumerate((centre, width))
    ]
    found = (
        ("centre", float(np.mod(centre, 2.0 * np.pi)), spread[0] + 0.5 * reach, "rad"),
        ("width", width, spread[1] + 0.2 * width * (ratio - 1.0), "rad"),
    )
    return [Found(found, float(values.max()), float(CELLS * len(WIDTHS)))]


def told(values: np.ndarray, shape: Shape) -> dict[str, float]:
    """The depth itself."""
    return {"depth": float(values[0])}


def position(coordinates: Mapping, shape: Shape, values: np.ndarray) -> np.ndarray:
    """(row,) the angle of the turn."""
    return np.asarray(coordinates["rotor_angle"])

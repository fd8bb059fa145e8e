"""Harmonics of the back-EMF of all phases beside its trapezoid, each phase's along its own electrical angle."""

from collections.abc import Mapping

import numpy as np

from ..actuator.grammar import OF_SHAPE, ORDERS
from ..diagnosis.model import Parameter, Unit, Variant
from ..effects import EFFECTS
from .dual import Dual, Number
from .point import Point

UNIT = "~harmonics_emf"
NAMES = {n: f"emf.{name}" for n, name in zip(ORDERS, OF_SHAPE["harmonics"], strict=True)}
CORNERS = "emf.corners"  # of a trapezoid that is averaged over the length of its own ramp, as a share of that
LEAST_RAMP = 1e-6  # electrical rad; corners nearer to each other than so are one


def swept(p: Point, low: np.ndarray, high: np.ndarray, ramp: float) -> Dual | float:
    """Integral over the electrical angle from ``low`` to ``high`` (rad) of what is added to the trapezoid.

    ``ramp`` : electrical angle over which the trapezoid rises from 0 to 1 (rad)
    """
    total = integral({n: p(name) for n, name in NAMES.items()}, low, high)
    corners = p(CORNERS)
    if not (corners.slopes or corners.value):
        return total
    return total + corners * (rounding(high, ramp) - rounding(low, ramp))


def rounding(angle: np.ndarray, ramp: float) -> np.ndarray:
    """Integral, over a whole turn nothing, of what the average over a ramp's length changes about the corners: there it
    is (h - |u|)^2 / (4 h ramp) in the direction of the change, u from the corner, up to half the length h."""
    x, ramp = np.mod(angle, 2.0 * np.pi), max(ramp, LEAST_RAMP)
    h, total = 0.5 * ramp, np.zeros_like(x)
    # where the slope of the trapezoid changes, and which way
    for at, sign in ((ramp, -1.0), (np.pi - ramp, -1.0), (np.pi + ramp, 1.0), (2.0 * np.pi - ramp, 1.0)):
        u = np.clip(x - at, -h, h)
        total += sign * np.where(u < 0.0, (h + u) ** 3, 2.0 * h**3 - (h - u) ** 3)
    return total / (12.0 * h * ramp)


def integral(sizes: Mapping[int, Dual], low: np.ndarray, high: np.ndarray) -> Dual | float:
    """The same of harmonics a sin(n x) of sizes a by odd orders n."""
    known = {n: a for n, a in sizes.items() if a.slopes or a.value}
    total: Dual | float = 0.0
    if not known:
        return total
    before, after = _cosines(low, max(known)), _cosines(high, max(known))
    for n, size in known.items():
        total = total + size * ((before[n] - after[n]) / n)
    return total


def _cosines(angle: np.ndarray, highest: int) -> dict[int, np.ndarray]:
    """cos(n angle) by odd orders, from their recurrence (Chebyshev polynomials of the first kind)."""
    out = {1: np.cos(angle)}
    twice: Number = 4.0 * out[1] * out[1] - 2.0
    out[3] = (twice - 1.0) * out[1]
    for n in range(5, highest + 1, 2):
        out[n] = twice * out[n - 2] - out[n - 4]
    return out


def parameters() -> list[Parameter]:
    """The harmonics, each as wide as those of the catalogue may be, and the rounding of the corners."""
    listed = [p for e in EFFECTS.values() for n, p in e.parameters.items() if n in OF_SHAPE["harmonics"]]
    width = max(abs(x) for p in listed for x in (p.low, p.high))
    harmonics = [Parameter(name, 0.0, 0.0, width, "1") for name in NAMES.values()]
    return [*harmonics, Parameter(CORNERS, 0.0, 0.0, 1.0, "1")]


def unit() -> Unit:
    """The shape as a candidate cause, which both simulators have: one harmonic, or all."""
    every = [p for p in parameters() if p.name != CORNERS]
    return Unit(UNIT, "form", ("electrical", "torque"), [*(Variant([p]) for p in every), Variant(every)])

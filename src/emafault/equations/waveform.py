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


def swept(p: Point, low: np.ndarray, high: np.ndarray) -> Dual | float:
    """Integral over the electrical angle from ``low`` to ``high`` (rad) of what is added to the trapezoid."""
    return integral({n: p(name) for n, name in NAMES.items()}, low, high)


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


def unit() -> Unit:
    """The shape as a candidate cause: one harmonic, or all; as wide as those of the catalogue may be."""
    listed = [p for e in EFFECTS.values() for n, p in e.parameters.items() if n in OF_SHAPE["harmonics"]]
    width = max(abs(x) for p in listed for x in (p.low, p.high))
    every = [Parameter(name, 0.0, 0.0, width, "1") for name in NAMES.values()]
    return Unit(UNIT, "form", ("electrical", "torque"), [*(Variant([p]) for p in every), Variant(every)])

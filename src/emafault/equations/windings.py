"""Coefficients of single phases that differ from what their turns make of those of all, inductances that go with the
rotor's angle, and those between phases."""

from collections.abc import Callable

import numpy as np

from ..actuator.grammar import OF_WINDING, PHASES
from ..diagnosis.model import Parameter, Unit, Variant
from .dual import Dual
from .point import Point
from .signals import Signals

UNIT = "~coefficient_winding"
#: inductance between two phases, over that of one -> both
MUTUAL = {f"mutual.{PHASES[j]}{PHASES[q]}": (j, q) for j, q in ((0, 1), (1, 2), (2, 0))}
Waves = tuple[Callable[[np.ndarray], np.ndarray], Callable[[np.ndarray], np.ndarray]]
DIFFERS = 0.05  # relative, as widely as a phase's coefficient may
WAYS = 3.0  # in which windings may differ: by coefficients of phases, with the angle, between phases


def factor(p: Point, name: str, j: int) -> Dual | float:
    """Factor of phase j's ``back_emf`` or ``inductance``."""
    share = p(f"winding.{name}_{PHASES[j]}")
    return 1.0 + share if share.slopes or share.value else 1.0


def saliency(p: Point, rec: Signals, j: int) -> Dual | float:
    """(sample,) relative change of phase j's self-inductance at the intervals' ends, twice per turn of the field
    (Krause, Wasynczuk, Sudhoff and Pekarek 2013, Analysis of Electric Machinery and Drive Systems); inductances between
    phases, which change likewise where windings are distributed as a sine, are taken as constant."""
    return _twice(p, rec, j, rec.angle, (np.cos, np.sin))


def saliency_slope(p: Point, rec: Signals, j: int) -> Dual | float:
    """(sample,) its derivative by the rotor's angle (1/rad) in the middle of the intervals."""
    per = 2.0 * rec.actuator.pole_pairs
    return _twice(p, rec, j, rec.middle, (lambda x: -per * np.sin(x), lambda x: per * np.cos(x)))


def _twice(p: Point, rec: Signals, j: int, angle: np.ndarray, waves: Waves) -> Dual | float:
    """(sample,) two waves of twice the electrical angle of a phase, each of its size."""
    out: Dual | float = 0.0
    for name, wave in zip(("cos", "sin"), waves, strict=True):
        size = p(f"saliency.{name}")
        if size.slopes or size.value:
            out = out + size * wave(2.0 * (rec.actuator.pole_pairs * angle - rec.axis[j]))
    return out


def salient() -> Unit:
    """Saliency of the rotor as a candidate cause."""
    both = [Parameter(f"saliency.{n}", 0.0, 0.0, DIFFERS, "1") for n in ("cos", "sin")]
    return Unit("~saliency", "form", ("electrical", "torque"), [Variant(both)], among=WAYS)


def mutual() -> Unit:
    """Inductances between phases that differ from one another as a candidate cause; what all have alike is the phases'
    own, for the currents add up to nothing."""
    all_three = [Parameter(n, 0.0, 0.0, DIFFERS, "1") for n in MUTUAL]
    return Unit("~mutual", "form", ("electrical",), [Variant(all_three)], among=WAYS)


def unit() -> Unit:
    """Windings that differ as a candidate cause: one coefficient of a phase, or the inductances of all.

    What differs between the back-EMF coefficients of all is an eccentricity.
    """
    each = {n: Parameter(f"winding.{n}", 0.0, 0.0, DIFFERS, "1") for n in OF_WINDING["coefficient"]}
    unequal = Variant([p for n, p in each.items() if n.startswith("inductance")])
    variants = [*(Variant([p]) for p in each.values()), unequal]
    return Unit(UNIT, "form", ("electrical", "torque"), variants, among=WAYS)

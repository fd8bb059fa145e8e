"""Coefficients of single phases that differ from what their turns make of those of all, inductances that go with the
rotor's angle, and those between phases."""

import numpy as np

from ..actuator.grammar import OF_WINDING, PHASES
from ..diagnosis.model import Parameter, Unit, Variant
from .dual import Dual
from .point import Point
from .signals import Signals

UNIT = "~coefficient_winding"
#: inductance between two phases, over that of one -> both
MUTUAL = {f"mutual.{PHASES[j]}{PHASES[q]}": (j, q) for j, q in ((0, 1), (1, 2), (2, 0))}
DIFFERS = 0.05  # relative, as widely as a phase's coefficient may
WAYS = 3.0  # in which windings may differ: by coefficients of phases, with the angle, between phases


def factor(p: Point, name: str, j: int) -> Dual | float:
    """Factor of phase j's ``back_emf`` or ``inductance``."""
    share = p(f"winding.{name}_{PHASES[j]}")
    return 1.0 + share if share.slopes or share.value else 1.0


def saliency(p: Point, rec: Signals, j: int) -> tuple[Dual | float, Dual | float]:
    """(sample,) relative change of phase j's inductance at the intervals' ends, twice per turn of the field
    (Krause 2013, Analysis of Electric Machinery and Drive Systems, section 1.5), and its derivative by the rotor's
    angle (1/rad) in their middle."""
    out: Dual | float = 0.0
    slope: Dual | float = 0.0
    poles = rec.actuator.pole_pairs
    for name, wave, rate, sign in (("cos", np.cos, np.sin, -1.0), ("sin", np.sin, np.cos, 1.0)):
        size = p(f"saliency.{name}")
        if size.slopes or size.value:
            end, middle = (2.0 * (poles * x - rec.axis[j]) for x in (rec.angle, rec.middle))
            out, slope = out + size * wave(end), slope + size * (2.0 * sign * poles * rate(middle))
    return out, slope


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

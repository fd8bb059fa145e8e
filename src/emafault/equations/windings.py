"""Coefficients of single phases that differ from what their turns make of those of all."""

from ..actuator.grammar import OF_WINDING, PHASES
from ..diagnosis.model import Parameter, Unit, Variant
from .dual import Dual
from .point import Point

UNIT = "~coefficient_winding"
DIFFERS = 0.05  # relative, as widely as a phase's coefficient may


def factor(p: Point, name: str, j: int) -> Dual | float:
    """Factor of phase j's ``back_emf`` or ``inductance``."""
    share = p(f"winding.{name}_{PHASES[j]}")
    return 1.0 + share if share.slopes or share.value else 1.0


def unit() -> Unit:
    """Windings that differ as a candidate cause: one coefficient of a phase, or the inductances of all.

    What differs between the back-EMF coefficients of all is an eccentricity.
    """
    each = {n: Parameter(f"winding.{n}", 0.0, 0.0, DIFFERS, "1") for n in OF_WINDING["coefficient"]}
    unequal = Variant([p for n, p in each.items() if n.startswith("inductance")])
    return Unit(UNIT, "form", ("electrical", "torque"), [*(Variant([p]) for p in each.values()), unequal])

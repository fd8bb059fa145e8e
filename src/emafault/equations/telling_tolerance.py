"""A quantity of the unit's own beyond its tolerance, where the library at hand has no effect for that, in words."""

from collections.abc import Mapping
from typing import Any

from ..diagnosis.model import Parameter
from .telling import EQUATION
from .words import effect_number


def told_of_tolerance(
    effect: str, equation: str, found: Mapping[str, Mapping[str, Any]], expected: Mapping[str, Parameter]
) -> dict[str, Any]:
    """An entry of ``discovered``.

    Parameters
    ----------
    effect : of the catalogue, that the library lacks
    found : by name of its parameters, value with interval and units
    expected : by full name, nominal value and tolerance
    """
    parts = []
    for name, of in found.items():
        words = effect_number(effect, name).replace(": ", ", ")
        units = "" if of["units"] == "1" else f" {of['units']}"
        p = expected[f"{effect}.{name}"]
        parts.append(f"{words}: {of['value']:.4g} where {p.off:.3g} +- {p.sd:.2g}{units} is expected")
    place = EQUATION.get(equation, equation)
    says = f"beyond the unit's tolerance lies {' and '.join(parts)}"
    kept = {n: {k: of[k] for k in ("value", "low", "high", "units")} for n, of in found.items()}
    return {
        "equation": place, "along": "time", "form": "coefficient", "parameters": kept,
        "sentence": f"In the {place.replace('_', ' ')} equation: {says}.",
    }  # fmt: skip

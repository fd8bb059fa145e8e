"""What each effect of the catalogue adds to the equations: one file an effect, its name the file's.

A file defines the hooks it needs, each a term of one equation written for ``Dual`` values, and may state

``SCALES``   what the numbers of a parameter scale with from actuator to actuator (see ``effects.scaling``)
``SHAPES``   values of its parameters at which a secant is taken where no derivative at "off" exists
``WIDTHS``   prior standard deviation of a parameter where it is not 0.6 of its range
``SENTENCE`` what the effect is, as the page says it

The parameters are those of ``conf/effect/<id>.yaml`` unless ``PARAMETERS`` names others.
"""

from functools import cache
from importlib import import_module
from types import ModuleType

from ...effects import EFFECTS

TERMS: dict[str, ModuleType] = {id_: import_module(f"{__name__}.{id_}") for id_ in EFFECTS}


@cache
def with_hook(hook: str) -> list[ModuleType]:
    """Effects that have a term of this kind, in the catalogue's order."""
    return [m for m in TERMS.values() if hasattr(m, hook)]

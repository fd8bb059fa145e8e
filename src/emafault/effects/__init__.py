"""The catalogue of effects that the nominal actuator leaves out.

Each effect is one file ``conf/effect/<id>.yaml`` (kind, equations, parameters with units, nominal value, realistic
range and, for calibration effects, the tolerance of a unit within its specification) and one term in the compiled
physics, which reads the field ``<id>_<parameter>`` of the run's record. At the nominal values the nominal actuator is
had exactly.
"""

from dataclasses import dataclass
from pathlib import Path

import yaml

from ..paths import EFFECTS as FOLDER

_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # every process reads the catalogue, and this is fast


@dataclass(frozen=True)
class EffectParameter:
    """One parameter: units, nominal value (the effect is off), realistic range, tolerance (1 sigma over nominal).

    ``follows`` names the actuator's parameter that is the nominal value where the configuration changes it, ``scales``
    what the numbers go with from actuator to actuator (see ``scaling``).
    """

    units: str
    nominal: float
    low: float
    high: float
    tolerance: float = 0.0
    follows: str = ""
    scales: str = ""

    @property
    def possible(self) -> tuple[float, float]:
        """Low and high end of what may be simulated: ten times the realistic range, of the sign that the range has."""
        low, high = min(self.low, self.nominal), max(self.high, self.nominal)
        return (10.0 * low if low < 0.0 else 0.1 * low), (10.0 * high if high > 0.0 else 0.1 * high)


@dataclass(frozen=True)
class Effect:
    """One row of the catalogue; ``kind`` is ``structural`` or ``calibration``."""

    id: str
    kind: str
    equations: tuple[str, ...]
    parameters: dict[str, EffectParameter]

    def field(self, parameter: str) -> str:
        """Name of the parameter's field in a run's record."""
        return f"{self.id}_{parameter}"

    @property
    def off(self) -> dict[str, float]:
        """Every parameter at its nominal value."""
        return {name: p.nominal for name, p in self.parameters.items()}


def load_effects(folder: Path = FOLDER) -> dict[str, Effect]:
    """Read the catalogue, in alphabetical order of ids."""
    effects = {}
    for path in sorted(folder.glob("*.yaml")):
        raw = yaml.load(path.read_text(), _LOADER)
        parameters = {str(k): EffectParameter(**v) for k, v in raw["parameters"].items()}
        effects[path.stem] = Effect(path.stem, raw["kind"], tuple(raw["equations"]), parameters)
    return effects


EFFECTS = load_effects()

"""What blind cases are drawn from: an actuator's catalogue with its tolerances, and how far its motions reach."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field

from ..actuator.parameters import ActuatorParameters
from ..effects import EFFECTS, Effect
from ..effects.scaling import reference, scaled

Tolerances = Mapping[str, Mapping[str, float]]


@dataclass(frozen=True)
class Population:
    """Units of one actuator.

    Parameters
    ----------
    catalogue : its effects by name
    reach : speeds and lengths of its motions over the reference actuator's
    tolerances : effect -> parameter -> standard deviation over the nominal value, where not the catalogue's
    """

    catalogue: Mapping[str, Effect]
    reach: float = 1.0
    tolerances: Tolerances = field(default_factory=dict)


REFERENCE = Population(EFFECTS)


def population_of(actuator: ActuatorParameters, tolerances: Tolerances | None = None) -> Population:
    """Units of an actuator; those of the reference actuator are drawn to the same bits as without one."""
    known = reference()
    if not tolerances and asdict(actuator) == known:
        return REFERENCE
    speed = actuator.speed_limit / actuator.gear_ratio / (known["speed_limit"] / known["gear_ratio"])
    reach = min(speed, actuator.end_stop / known["end_stop"])
    return Population(scaled(actuator, tolerances), reach, dict(tolerances or {}))

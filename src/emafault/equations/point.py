"""A parameter point as the equations take it: values by name, differentiated by those that a recording knows."""

from collections.abc import Callable, Mapping

from .dual import Dual
from .signals import Signals


class Point:
    """Parameter values at which the equations of one recording are linearised.

    ``values`` holds full names: ``effect.parameter``, ``fault component``, ``quantity@recording``. A name that a
    recording does not know is off and has no derivative.
    """

    def __init__(self, values: Mapping[str, float], recording: str):
        self.values = values
        self.recording = recording

    def own(self, name: str) -> Dual:
        """A parameter of this recording alone where there is one, else the bench's."""
        full = f"{name}@{self.recording}"
        return self(full) if full in self.values else self(name)

    def __call__(self, name: str) -> Dual:
        if name not in self.values:
            return Dual(0.0)
        return Dual(self.values[name], {name: 1.0})

    def of(self, effect: str) -> Callable[[str], Dual]:
        """Access to the parameters of one effect."""
        return lambda name: self(f"{effect}.{name}")


def effect_name(module) -> str:
    """Name of an effect from its file of terms."""
    return module.__name__.rsplit(".", 1)[-1]


class State:
    """What several equations share at one point of one recording: true currents, coefficients, temperatures.

    Everything is derived from the recorded signals and the point; nothing is simulated.
    """

    def __init__(self, rec: Signals, point: Point):
        from . import quantities

        self.rec, self.p = rec, point
        quantities.fill(self)

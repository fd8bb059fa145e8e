"""A parameter point as the equations take it: values by name, differentiated by those that a recording knows."""

from collections.abc import Callable, Collection, Mapping
from copy import copy
from functools import cache

import numpy as np

from .dual import Dual
from .signals import Signals

SEEDED = "seeded."  # before the name of a fault component: what all seeded recordings have of it


class Point:
    """Parameter values at which the equations of one recording are linearised.

    ``values`` holds full names: ``effect.parameter``, ``fault component``, ``quantity@recording``. A name that a
    recording does not know is off and has no derivative. Only those ``wanted`` have derivatives (None: all).
    """

    def __init__(self, values: Mapping[str, float], recording: str, wanted: Collection[str] | None = None):
        self.values = values
        self.recording = recording
        self.wanted = wanted

    def own(self, name: str) -> Dual:
        """A parameter of this recording alone where there is one, else the bench's."""
        full = f"{name}@{self.recording}"
        return self(full) if full in self.values else self(name)

    def __call__(self, name: str) -> Dual:
        if name not in self.values:
            return Dual(0.0)
        if self.wanted is not None and name not in self.wanted:
            return Dual(self.values[name])
        return Dual(self.values[name], {name: 1.0})

    def of(self, effect: str) -> Callable[[str], Dual]:
        """Access to the parameters of one effect."""
        return lambda name: self(f"{effect}.{name}")


@cache
def effect_name(module) -> str:
    """Name of an effect from its file of terms."""
    return module.__name__.rsplit(".", 1)[-1]


class State:
    """What several equations share at one point of one recording, derived from the recorded signals and the point.

    Lists are by phase. ``shown`` mean currents that the sensors show (A), ``lag`` what the recorded ones are beyond
    those on time (A), ``swept`` mean of f w over each interval (rad/s), ``regressor`` the same of a smoothed angle,
    ``conducting`` mean of f over the part in which the phase is switched on, ``inductance`` (H), ``rise`` its voltage
    (V), ``loss`` copper loss (W), ``bus_current`` (A), ``own_load`` of the recording at the rotor (N m), ``drive``
    torque of the motor (N m), ``shared`` the same less that of loads (N m), ``net`` less friction as well, ``inertia``
    that turns with the rotor, over the nominal one.
    """

    dT: Dual
    current: list[Dual]
    shown: list[Dual]
    lag: list[Dual]
    current_end: list[Dual]
    turns: list[Dual]
    k: list[Dual]
    resistance: list[Dual]
    swept: list[Dual]
    regressor: list[Dual]
    conducting: list[Dual]
    rise: list[Dual]
    inductance: list[float]
    loss: np.ndarray
    bus_current: np.ndarray
    drive: np.ndarray
    own_load: Dual
    shared: np.ndarray
    net: np.ndarray
    inertia: float

    def __init__(self, rec: Signals, point: Point, rounds: bool = True):
        """``rounds``: whether the recorded currents are less what coarse steps have added to them."""
        from . import quantities

        self.rec, self.p = rec, point
        quantities.fill(self, rounds)

    def at(self, point: Point) -> "State":
        """The same quantities without their derivatives, for terms at another point."""
        from . import quantities

        out = copy(self)
        out.p = point
        for name in ("current", "k", "conducting"):
            setattr(out, name, [Dual(x.value) for x in getattr(self, name)])
        out.rec = copy(self.rec)
        for name in ("inertia_scale", "play", "ahead", "load", "spring"):
            setattr(out.rec, name, Dual(getattr(self.rec, name).value))
        out.rec.flexible = quantities.flexible(out)
        return out

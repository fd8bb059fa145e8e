"""What a measured machine states of itself: rows of its equations, parameters with priors, candidate effects."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..errors import InputError

Arrays = dict[str, np.ndarray]
#: parameters by name, (point, 1) each, and inputs of the rows -> (point, row) what the equation says of them
Equation = Callable[[Mapping[str, np.ndarray], Mapping[str, np.ndarray]], np.ndarray]

#: equations that a verdict knows; one that is a part of another (``electrical_d``) is told as the whole
EQUATIONS = (
    "electrical", "electrical_a", "electrical_b", "electrical_c", "torque", "sensor_voltage", "sensor_current",
    "sensor_speed", "sensor_angle", "sensor_output", "position", "bus", "control",
)  # fmt: skip
#: coordinates that rows may lie along
COORDINATES = ("rotor_angle", "rotor_speed", "current", "temperature", "direction", "time", "order")


@dataclass(frozen=True)
class Rows:
    """What one recording shows of one equation, a row each.

    Parameters
    ----------
    along, low, high : the coordinate that the rows lie along, and the stretch (row,) of it that each looks at
    observed : (row,) measured values
    variance : (row,) of the error that each row has alone
    inputs : what the equation reads, (row,) or (..., row)
    shared : (row, error) what errors of unit size that several rows have in common add to each
    labels : (row,) kind of each row, where an equation has several
    beside : further coordinates (row,) by name
    """

    recording: str
    equation: str
    along: str
    low: np.ndarray
    high: np.ndarray
    observed: np.ndarray
    variance: np.ndarray
    inputs: Mapping[str, np.ndarray] = field(default_factory=dict)
    shared: np.ndarray | None = None
    labels: Sequence[str] = ()
    beside: Mapping[str, np.ndarray] = field(default_factory=dict)

    @property
    def covariance(self) -> np.ndarray:
        """(row, row) of all errors together."""
        own = np.diag(np.asarray(self.variance, float))
        return own if self.shared is None else own + self.shared @ self.shared.T

    @property
    def size(self) -> int:
        """Number of rows."""
        return len(self.observed)

    def label(self, row: int) -> str:
        """Kind of a row."""
        return self.labels[row] if len(self.labels) else ""


@dataclass(frozen=True)
class Parameter:
    """A parameter with its Gaussian prior; one of an effect is ``off`` without it and bounded by ``low`` and ``high``.

    ``specified``: equation that is in doubt where a parameter of the base model is found far from its prior.
    """

    name: str
    units: str
    off: float
    mean: float
    sd: float
    low: float = -np.inf
    high: float = np.inf
    effect: str | None = None
    specified: str = ""


@dataclass(frozen=True)
class Effect:
    """A candidate cause and the equations that it acts in.

    ``shapes``: values of its parameters at which it is tried, where it has no derivative at "off" (a time constant, an
    angle); none where it has.
    """

    id: str
    equations: tuple[str, ...]
    shapes: tuple[Mapping[str, float], ...] = ()


@dataclass(frozen=True)
class Experiment:
    """One recording that could be made: what one would set, and what that makes of the inputs of an equation."""

    text: str
    change: Callable[[Mapping[str, np.ndarray]], Mapping[str, np.ndarray]]


def scaled(text: str, **factors: float) -> Experiment:
    """The same recording with inputs multiplied by these factors."""
    return Experiment(text, lambda x: {name: factor * x[name] for name, factor in factors.items() if name in x})


@dataclass(frozen=True)
class Distortion:
    """A known change of the raw arrays for the withheld check, with the effects any of which rightly names it.

    ``effects`` is empty where nothing in the library can express the change: the verdict should then be unknown in
    ``equation``.
    """

    name: str
    apply: Callable[[Arrays], Arrays]
    effects: tuple[str, ...]
    equation: str


@dataclass(frozen=True)
class Machine:
    """One machine as it was recorded.

    Parameters
    ----------
    explore, confirm : names of the recordings that are looked at first, and of those set aside
    equations : name -> what it says of rows; names of one equation's parts share their beginning (``electrical_d``)
    observed : effects that the recordings show for certain, with their parameters
    words : coordinates in words with their unit in brackets, where they are not those of a rotor, and parameters in
        words
    """

    name: str
    case: str
    explore: tuple[str, ...]
    confirm: tuple[str, ...]
    rows: Sequence[Rows]
    parameters: Sequence[Parameter]
    effects: Sequence[Effect]
    equations: Mapping[str, Equation]
    notes: tuple[str, ...] = ()
    observed: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    experiments: Sequence[Experiment] = ()
    words: Mapping[str, str] = field(default_factory=dict)

    def without(self, *effects: str) -> "Machine":
        """The same machine with these effects taken out of the library; their parameters stay off.

        Raises
        ------
        InputError
            when an effect is not in the library.
        """
        known = [e.id for e in self.effects]
        for effect in effects:
            if effect not in known:
                raise InputError(
                    f"exclude: '{effect}' is not an effect of {self.name}, accepted are {', '.join(known)}"
                )
        return replace(self, effects=tuple(e for e in self.effects if e.id not in effects))


def nuisance(
    name: str, units: str, mean: float, sd: float, low: float = -np.inf, high: float = np.inf, specified: str = ""
) -> Parameter:
    """A parameter of the base model, always free."""
    return Parameter(name, units, mean, mean, sd, low, high, None, specified)


def freedom(
    effect: str, name: str, units: str, sd: float, low: float = -np.inf, high: float = np.inf, mean: float = 0.0,
    off: float = 0.0,
) -> Parameter:  # fmt: skip
    """A parameter that an effect frees: zero (``off``) without the effect."""
    return Parameter(name, units, off, mean, sd, low, high, effect)


def told(equation: str) -> str:
    """An equation's name in the verdict."""
    return equation if equation in EQUATIONS else equation.rsplit("_", 1)[0]

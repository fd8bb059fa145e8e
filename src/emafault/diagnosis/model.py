"""What the diagnosis needs of a machine: parameters with priors, candidate units, and equations as blocks of rows."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from .whitening import factored

LISTED = ("structural", "calibration")  # kinds of units that the catalogue lists
SETTINGS = ("control", "commutation")  # equations of the controller, whose form is its own business
TOLERANCES = 4.0  # within which a unit's own values lie: its parameters' prior standard deviations
#: kinds of described forms, over which their prior is spread evenly
WORDS = (
    "lag", "clock", "crosstalk", "drift", "sensor_curve", "order", "frequency", "bump", "step_change", "pulse",
    "function", "power", "memory", "travel", "harmonics", "coefficient",
)  # fmt: skip


@dataclass(frozen=True)
class Parameter:
    """One parameter: value at which it does nothing, prior mean and standard deviation where it is free.

    A parameter that multiplies (``vanishes``: where its factor is zero) deviates in the logarithm of its factor, so
    that a product of two keeps its value along the line on which one makes up for the other.
    """

    name: str
    off: float
    mean: float
    sd: float
    units: str = ""
    alias: str | None = None  # a nuisance whose column this one is: the same quantity beyond its tolerance
    secant: Mapping[str, float] | None = None  # values at which a secant stands for a derivative
    fixed: bool = False
    vanishes: float | None = None
    absent: float = 0.0  # of a fault that the unit may not have: standard deviation about off where it has none


@dataclass(frozen=True)
class Variant:
    """One way in which a unit enters the linear model: its parameters and the side of off each lies on (0: either)."""

    parameters: Sequence[Parameter]
    signs: Sequence[int] = ()
    least: float = 0.0  # width of the prior, as a share of the parameters' own, below which the unit never is
    hole: Sequence[float] = ()  # prior standard deviations from off, within which not all parameters may be at once


@dataclass(frozen=True)
class Unit:
    """A listed effect, a described form or an equation's remainder: what a set holds or does not."""

    id: str
    kind: str  # structural | calibration | form | remainder
    equations: tuple[str, ...]
    variants: Sequence[Variant]
    on: Variant | None = None  # once its own parameters are at a point where it acts
    among: float = 1.0  # alternatives of a form that the prior of its kind is spread over
    alike: bool = False  # whether its variants look alike near off, and are told apart at their own optima alone
    proposed: bool = False  # of a form: by a scan of what is left
    same_as: str = ""  # another form that it differs from by what is free beside both

    @property
    def of_controller(self) -> bool:
        """Whether it is a form of the controller alone: no evidence for or against what a machine has."""
        return self.kind == "form" and bool(self.equations) and set(self.equations) <= set(SETTINGS)

    @property
    def parameters(self) -> list[Parameter]:
        """Every parameter of every variant."""
        every = [p for v in self.variants for p in v.parameters]
        return every + [p for p in (self.on.parameters if self.on else ()) if p not in every]


def meet(one: Collection[str], other: Collection[str]) -> bool:
    """Whether two effects act in a common equation; that of one phase is one of the electrical ones."""
    return any(a == b or a.startswith(f"{b}_") or b.startswith(f"{a}_") for a in one for b in other)


@dataclass
class Block:
    """Rows of one equation in one recording.

    ``residual`` (row,), ``columns`` parameter -> scalar or (row,), ``bands`` diagonals of the noise's covariance
    (main first), ``usable`` (row,) bool, ``coordinates`` name -> (row,), with ``phi`` (function, row) and ``drivers``
    (driver, row) for remainders. ``rounded``: a converter's steps are a part of the noise, so that most rows may leave
    nothing, and what slow signals leave wanders. ``filters``: the point changes the covariance only
    in that it filters the noise of recorded signals, which is known, not in how large an error may be.
    """

    recording: str
    equation: str
    residual: np.ndarray
    columns: dict
    bands: list[np.ndarray]
    usable: np.ndarray
    coordinates: dict = field(default_factory=dict)
    rounded: bool = False
    filters: bool = False

    @cached_property
    def factor(self) -> np.ndarray:
        """(band, row) Cholesky factor of the noise's covariance, computed once."""
        return factored(self.bands, self.usable)

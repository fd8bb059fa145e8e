"""What the machine-independent diagnosis needs to know of a machine.

A *twin* turns recordings into a vector of statistics and predicts that vector from parameters. The same code computes
the statistics of measured and of simulated recordings. Everything else (where, which, how far, groups, unknown) is done
by the core from these alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

SPREAD = 1.13  # of standardised errors on development cases: derivatives by simulation are a little noisy
INTERVAL = 1.645 * SPREAD  # standard deviations of a 90 % interval


@dataclass(frozen=True)
class Cell:
    """What one statistic looks at: a recording, an equation and a stretch of one coordinate."""

    recording: str
    equation: str
    along: str  # rotor_angle | rotor_speed | current | temperature | direction | time | order
    low: float
    high: float
    label: str = ""


@dataclass(frozen=True)
class Parameter:
    """One parameter of the twin's model, with its prior.

    Nuisances (``effect`` None) have the Gaussian prior (``mean``, ``sd``) and are always free. The parameters of an
    effect are off at ``off`` and free, with the prior (``mean``, ``sd``) and the hard bounds (``low``, ``high``), only
    in hypotheses that contain the effect. A nuisance may also be the subject of a calibration hypothesis, which widens
    its prior to the bounds. ``recordings`` names the recordings that a per-recording nuisance belongs to, None for all.
    """

    name: str
    units: str
    off: float
    mean: float
    sd: float
    low: float
    high: float
    step: float  # finite-difference step, large against simulation noise and small against curvature
    effect: str | None = None
    recordings: tuple[str, ...] | None = None
    fault: str | None = None  # component of the fault vector that this parameter is, if any
    amplitude: bool = False  # of an effect, which may be any power of ten smaller than its prior is wide
    least: float = 0.0  # distance from ``off`` below which an effect is none: smaller than it ever is
    specified: str = ""  # equation that is in doubt where a nuisance is found far from what was specified or measured


@dataclass(frozen=True)
class Hypothesis:
    """One candidate cause: its parameters by name and the points at which a fit starts (one value per parameter).

    Where each parameter acts alone (``additive``), a fit starts where all are off, with signatures taken one by one.
    """

    effect: str
    equations: tuple[str, ...]
    parameters: tuple[str, ...]
    starts: tuple[tuple[float, ...], ...]
    kind: str = "structural"  # or calibration
    additive: bool = False


class Twin(Protocol):
    """A machine as the diagnosis sees it. ``part`` is a sequence of recording names.

    A twin may also offer ``scatter(part)``, the variance (statistic,) of one prediction where predictions are not
    smooth in their parameters, and ``smooth(values, part)``, a prediction (statistic,) averaged over it;
    ``report(effect, values, deviations)``, which turns the parameters of an effect as fitted into those of the
    catalogue: name -> (value, low, high, units); and ``experiments(values)``, the menu of next experiments.
    """

    @property
    def name(self) -> str:
        """Name of the machine."""

    @property
    def parameters(self) -> Sequence[Parameter]:
        """Nuisances and effects' parameters."""

    @property
    def hypotheses(self) -> Sequence[Hypothesis]:
        """The library."""

    def cells(self, part: Sequence[str]) -> list[Cell]:
        """One cell per statistic of these recordings, in the order of the statistics, recording by recording."""

    def observed(self, part: Sequence[str]) -> np.ndarray:
        """(statistic,) statistics of the recordings as brought."""

    def predict(self, values: np.ndarray, part: Sequence[str]) -> np.ndarray:
        """(point, parameter) parameter values -> (point, statistic) expected statistics."""

    def covariance(self, values: np.ndarray, part: Sequence[str]) -> np.ndarray:
        """(statistic, statistic) covariance of the statistics at one parameter point, block-diagonal by recording."""

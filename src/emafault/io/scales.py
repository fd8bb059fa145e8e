"""Scales of sensors that other channels tell: the speed's by the angle's rate, the currents' by their sum.

What a recording has of both sides of an identity says by how much one of them is off, and with which error, before any
parameter of the actuator comes in.
"""

from dataclasses import dataclass

import numpy as np

from ..effects import EFFECTS
from .recording import Recording

CERTAIN = 6.0  # standard errors by which a scale must differ from one to be told
OVER = 0.01  # s, over which what the speed and the angle's rate leave is taken for noise of its own
MISTAKEN = 20.0  # times the range that a scale has in the catalogue: the unit or the channel, and no sensor's own


@dataclass(frozen=True)
class Scale:
    """What a channel shows over what it should (1), and its standard error."""

    value: float
    error: float

    @property
    def off(self) -> float:
        """By how much it is off one, signed; 0 where that may be noise."""
        return self.value - 1.0 if abs(self.value - 1.0) > CERTAIN * self.error else 0.0


def largest(effect: str, parameter: str) -> float:
    """By how much a scale of the catalogue may be off one before it is a mistake."""
    p = EFFECTS[effect].parameters[parameter]
    return MISTAKEN * max(p.high - p.nominal, p.nominal - p.low)


def speed_scale(recording: Recording) -> Scale:
    """Scale of the speed beside the angle's rate; a speed that is filtered is late and no smaller.

    The integral of a speed behind a first-order filter is scale times the angle less the filter's time constant times
    the speed, exactly.
    """
    turned = np.cumsum(recording.rotor_speed) * recording.interval
    columns = np.stack([recording.rotor_angle, recording.rotor_speed, np.ones(len(turned))], axis=1)
    columns[:, :2] -= columns[:, :2].mean(axis=0)
    size = np.sqrt((columns**2).mean(axis=0))
    if np.any(size == 0.0):
        return Scale(1.0, np.inf)
    solution, *_ = np.linalg.lstsq(columns / size, turned, rcond=1e-9)
    left = turned - columns @ (solution / size)
    # errors of the speed add up on their way: as after that many steps, each as large as over a while
    each = np.diff(left[:: max(1, round(OVER / recording.interval))])
    return Scale(float(solution[0] / size[0]), float(np.std(each) * np.sqrt(len(each)) / size[0]))


def current_scales(recording: Recording, rows: np.ndarray | None = None) -> tuple[Scale, Scale, Scale]:
    """Scales of the currents of phases a, b, c beside one another, by which their sum stays the same; the one in the
    middle is taken for right, and offsets drop out.

    ``rows`` : (sample,) whether a sample is used; None uses all
    """
    current = recording.phase_current if rows is None else recording.phase_current[rows]
    moment = np.cov(current.T)
    values, vectors = np.linalg.eigh(moment)
    weight = vectors[:, 0]  # that the sum of weighted currents varies least with
    if not values[1] > 0.0 or np.any(weight == 0.0):
        return (Scale(1.0, np.inf),) * 3
    scale = np.median(weight) / weight
    # a vector's error across: the noise in the sum beside the smaller of the motions that it is told from
    across = np.sqrt(3.0 * max(values[0], 0.0) / values[1] / len(current))
    a, b, c = (Scale(float(s), float(across * max(abs(s), 1.0))) for s in scale)
    return a, b, c

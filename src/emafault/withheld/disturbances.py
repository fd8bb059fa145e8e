"""Disturbances and other controllers: drawing them, and what a key says of them. None of it is in the catalogue."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..errors import InputError
from .acting import ACTING
from .disturbance import Acting, Kind, Signals
from .measuring import MEASURING

DISTURBANCES: dict[str, Kind] = {**MEASURING.kinds, **ACTING.kinds}
INSIDE = tuple(name for name, kind in DISTURBANCES.items() if kind.inside)
OUTSIDE = tuple(name for name, kind in DISTURBANCES.items() if not kind.inside)
#: smallest size that is drawn, as a share of the largest: about where a typical bench shows it at a squared distance of
#: 10 to 30 (measured on other seeds), so that sizes go from what hardly shows to what cannot be overlooked
SMALLEST = {
    "bent_voltage": 0.3,
    "crosstalk_current": 0.01,
    "drift_current": 0.006,
    "fan_torque": 0.004,
    "flicker_current": 0.05,
    "grease": 0.012,
    "hum_voltage": 0.15,
    "lag_voltage": 0.003,
    "loosened_terminal": 0.04,
    "mains_current": 0.012,
    "once_per_turn": 0.005,
    "order_angle": 0.025,
    "pickup_voltage": 0.1,
    "random_torque": 0.003,
    "ringing": 0.05,
    "seal": 0.006,
    "slip_ring": 0.06,
    "sparking_terminal": 0.05,
    "tight_spot": 0.005,
    "torque_step": 0.002,
    "wander_current": 0.008,
    "warm_up_voltage": 0.015,
    "weak_magnet": 0.02,
}
USUAL_SMALLEST = 0.03
#: settings of the controller that a factor may change, either way by at most ``FARTHEST``
CONTROLLER = ("position_gain", "speed_gain", "speed_integral_gain", "current_limit", "speed_limit", "hysteresis")
FARTHEST = 0.5
FILTER = "filter_time"  # s, a filter of the current's reference that the nominal controller lacks
SLOWEST_FILTER = 1e-3  # s


@dataclass(frozen=True)
class Unlisted:
    """One disturbance of a case; everything about it follows from these three."""

    name: str
    size: float  # share of its largest size
    seed: int

    def kind(self) -> Kind:
        """What it is.

        Raises
        ------
        InputError : an unknown disturbance
        """
        if self.name not in DISTURBANCES:
            raise InputError(f"disturbance: '{self.name}' is not known, accepted are {', '.join(DISTURBANCES)}")
        return DISTURBANCES[self.name]

    def acting(self) -> Acting:
        """The disturbance drawn."""
        return self.kind().draw(self.size, np.random.default_rng([self.seed, 0]))

    def own(self, recording: int) -> np.random.Generator:
        """What is random in a recording of that number."""
        return np.random.default_rng([self.seed, 1 + recording])

    def told(self, distance: float) -> dict:
        """What a key says of it; ``distance`` is the squared distance from the same bench without it."""
        kind, acting = self.kind(), self.acting()
        return {
            "name": self.name, "inside": kind.inside, "form": kind.form, "equation": list(acting.equation),
            "along": list(kind.along), "size": self.size, "distance": distance,
            "parameters": {n: {"value": v, "units": u} for n, (v, u) in acting.parameters.items()},
        }  # fmt: skip


def draw_unlisted(number: int, seed: int, rng: np.random.Generator) -> tuple[Unlisted, ...]:
    """Draw disturbances; every third seed's first one is outside the grammar, and the seeds go through all names."""
    found: list[Unlisted] = []
    for n in range(number):
        turn, outside = divmod(seed + n, 3)
        names = OUTSIDE if outside == 2 else INSIDE
        at = 2 * turn + outside if outside != 2 else turn
        name = names[(at + 7 * n) % len(names)]
        if name not in [u.name for u in found]:
            found.append(
                Unlisted(name, float(SMALLEST.get(name, USUAL_SMALLEST) ** rng.random()), int(rng.integers(2**31)))
            )
    return tuple(found)


def draw_controller(seed: int, rng: np.random.Generator) -> dict[str, float]:
    """Draw factors of a controller's settings, or a filter: one of them by turns, or all gains at once."""
    which = seed % (len(CONTROLLER) + 2)
    if which == len(CONTROLLER):
        return {FILTER: float(SLOWEST_FILTER * rng.uniform(0.1, 1.0))}
    names = CONTROLLER[:3] if which > len(CONTROLLER) else (CONTROLLER[which],)
    return {name: float(1.0 + rng.uniform(-FARTHEST, FARTHEST)) for name in names}


def with_controller(actuator: ActuatorParameters, factors: Mapping[str, float]) -> ActuatorParameters:
    """The actuator under another controller; a filter is not one of its settings."""
    return replace(actuator, **{n: getattr(actuator, n) * f for n, f in factors.items() if n != FILTER})


def terms_of(
    unlisted: Sequence[Unlisted], recording: int, duration: float
) -> tuple[list[np.ndarray], np.ndarray | None]:
    """Terms of the physics in a recording of that number and duration (s), and the table that one may follow."""
    rows: list[np.ndarray] = []
    table = None
    for one in unlisted:
        acting = one.acting()
        if acting.terms is not None:
            more, own = acting.terms(duration, one.own(recording))
            rows += list(more)
            table = own if own is not None else table
    return rows, table


def change(unlisted: Sequence[Unlisted], recording: int, signals: Signals) -> None:
    """Let disturbances of the measuring chain act on the signals of a recording of that number, in place."""
    for one in unlisted:
        acting = one.acting()
        if acting.change is not None:
            acting.change(signals, one.own(recording))


def in_physics(unlisted: Sequence[Unlisted]) -> bool:
    """Whether one of them acts in the physics, and not on the recorded signals alone."""
    return any(one.acting().terms is not None for one in unlisted)

"""What the equations of the reference actuator leave, before and after, for the charts of a page."""

import numpy as np
from scipy.ndimage import uniform_filter1d

from ..diagnosis.model import Block
from ..diagnosis.whitening import whiten
from ..reporting.panels import Curves, Panel
from ..reporting.regions import coordinate
from . import bus
from .coordinates import rows_of
from .diagnose import Diagnosed
from .electrical import NAMES
from .machine import ReferenceActuator
from .point import Point, State
from .signals import Signals, odd

#: coordinates that a reader may choose, in words
ALONG = {n: coordinate(n) for n in ("time", "rotor_speed", "rotor_angle")} | {"current": "pair current (A)"}
#: measured side of each equation, in words
QUANTITY = {
    **{name: f"voltage of phase {name[-1]} (V)" for name in NAMES},
    "torque": "J times acceleration, 10 ms (N m)", "sensor_speed": "recorded speed (rad/s)",
    "sensor_current": "sum of the currents (A)", "position": "output position (rad)", "bus": "bus voltage (V)",
}  # fmt: skip


SMOOTHED = 1e-2  # s, that a second difference of the angle, which is mostly noise, is averaged over for the eye


def panels(found: Diagnosed) -> list[Panel]:
    """One panel an equation: the recalibrated nominal model before, the leading set after.

    An equation that leaves something is shown along the coordinate that most of it lies along.
    """
    confirm = found.verdict["recordings"]["confirm"]
    where = {w["equation"]: ALONG.get(w["along"], "") for w in reversed(found.verdict["where"])}
    machine = found.bench.machine
    curves: dict[str, list[Curves]] = {}
    for name in found.bench.recordings:
        before = machine.blocks(found.before, name, wanted=())
        after = machine.blocks(found.values, name, wanted=())
        for old, new in zip(before, after, strict=True):
            measured = _measured(machine, found, name, old.equation)
            curves.setdefault(old.equation, []).append(
                _curves(old, new, measured, name in confirm, machine.recordings[name].interval)
            )
    return [
        Panel(e, QUANTITY.get(e, ""), c, where.get(e, where.get(e.removesuffix(f"_{e[-1]}"), "")))
        for e, c in curves.items()
    ]


def _curves(before: Block, after: Block, measured: np.ndarray | None, aside: bool, interval: float) -> Curves:
    keep = np.flatnonzero(before.usable)
    size = len(before.residual)
    time = np.broadcast_to(before.coordinates["time"], size)[keep]
    keep = keep[np.argsort(time, kind="stable")]  # commutations come by phase
    deviation = np.sqrt(np.broadcast_to(before.bands[0], size))[keep]
    along = {words: np.broadcast_to(before.coordinates[n], size)[keep] for n, words in ALONG.items()}
    predicted = None
    if measured is not None and before.equation == "torque":
        width = odd(SMOOTHED / interval)
        old, new = (uniform_filter1d(measured - b.residual, width)[keep] for b in (before, after))
        measured, predicted = uniform_filter1d(measured, width), (old, new)
    return Curves(
        before.recording, along, before.residual[keep] / deviation, after.residual[keep] / deviation, deviation,
        None if measured is None else measured[keep], (_square(before), _square(after)), aside, predicted,
    )  # fmt: skip


def _square(block: Block) -> float:
    """r' V^-1 r of a block's residual."""
    residual = np.where(block.usable, block.residual, 0.0)
    return float(np.sum(whiten(block.bands, block.usable, residual[:, None]) ** 2))


def _measured(machine: ReferenceActuator, found: Diagnosed, name: str, equation: str) -> np.ndarray | None:
    """(row,) the recorded side of an equation; None of the controller's, which have none of their own."""
    rec = machine.recordings[name]
    if equation not in QUANTITY:
        return None
    state = State(rec, Point(found.before, name, ()))
    of = rows_of(state, equation)
    signal = np.asarray(bus.measured(state).value) if equation == "bus" else _signal(rec, equation)
    return signal if of is None else of(signal)


def _signal(rec: Signals, equation: str) -> np.ndarray:
    """(sample,) what an equation has measured, in the unit of ``QUANTITY``."""
    if equation in NAMES:
        return rec.voltage[:, NAMES.index(equation)]
    if equation == "torque":
        return _inertial(rec)
    signals = {
        "sensor_speed": rec.speed_recorded, "sensor_current": rec.current.sum(axis=1), "position": rec.output,
    }  # fmt: skip
    return np.asarray(signals[equation])


def _inertial(rec: Signals) -> np.ndarray:
    """(sample,) nominal inertia times the second difference of the recorded angle (N m)."""
    second = np.zeros(rec.size)
    second[1:-1] = np.diff(rec.angle, 2) / rec.interval**2
    return rec.actuator.inertia * second

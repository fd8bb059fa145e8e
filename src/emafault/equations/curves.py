"""What the equations of the reference actuator leave, before and after, for the charts of a page."""

import numpy as np

from ..diagnosis.model import Block
from ..diagnosis.whitening import whiten
from ..reporting.panels import Curves, Panel
from .diagnose import Diagnosed
from .electrical import NAMES
from .machine import ReferenceActuator, rows_of
from .point import Point, State
from .signals import Signals

#: coordinates that a reader may choose, in words
ALONG = {
    "time": "time (s)", "rotor_speed": "rotor speed (rad/s)", "rotor_angle": "rotor angle (rad)",
    "current": "pair current (A)",
}  # fmt: skip
#: measured side of each equation, in words
QUANTITY = {
    **{name: f"voltage of phase {name[-1]} (V)" for name in NAMES},
    "torque": "inertia times acceleration (N m)", "sensor_speed": "recorded speed (rad/s)",
    "sensor_current": "sum of the currents (A)", "position": "output position (rad)", "bus": "bus voltage (V)",
}  # fmt: skip


def panels(found: Diagnosed, confirm: list[str]) -> list[Panel]:
    """One panel an equation: the recalibrated nominal model before, the leading set after."""
    machine = found.bench.machine
    curves: dict[str, list[Curves]] = {}
    for name in found.bench.recordings:
        before = machine.blocks(found.before, name, wanted=())
        after = machine.blocks(found.values, name, wanted=())
        for old, new in zip(before, after, strict=True):
            measured = _measured(machine, found, name, old.equation)
            curves.setdefault(old.equation, []).append(_curves(old, new, measured, name in confirm))
    return [Panel(e, QUANTITY.get(e, ""), c) for e, c in curves.items()]


def _curves(before: Block, after: Block, measured: np.ndarray | None, aside: bool) -> Curves:
    keep = np.flatnonzero(before.usable)
    size = len(before.residual)
    deviation = np.sqrt(np.broadcast_to(before.bands[0], size))[keep]
    along = {words: np.broadcast_to(before.coordinates[n], size)[keep] for n, words in ALONG.items()}
    order = np.argsort(along[ALONG["time"]], kind="stable")  # commutations come by phase
    return Curves(
        before.recording, {n: x[order] for n, x in along.items()}, before.residual[keep][order] / deviation[order],
        after.residual[keep][order] / deviation[order], deviation[order],
        None if measured is None else measured[keep][order], (_square(before), _square(after)), aside,
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
    of = rows_of(State(rec, Point(found.before, name, ())), equation)
    signal = _signal(rec, equation)
    return signal if of is None else of(signal)


def _signal(rec: Signals, equation: str) -> np.ndarray:
    """(sample,) what an equation has measured, in the unit of ``QUANTITY``."""
    if equation in NAMES:
        return rec.voltage[:, NAMES.index(equation)]
    if equation == "torque":
        return _inertial(rec)
    signals = {
        "sensor_speed": rec.speed_recorded, "sensor_current": rec.current.sum(axis=1), "position": rec.output,
        "bus": rec.bus,
    }  # fmt: skip
    return np.asarray(signals[equation])


def _inertial(rec: Signals) -> np.ndarray:
    """(sample,) nominal inertia times the second difference of the recorded angle (N m)."""
    second = np.zeros(rec.size)
    second[1:-1] = np.diff(rec.angle, 2) / rec.interval**2
    return rec.actuator.inertia * second

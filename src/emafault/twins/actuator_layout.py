"""Which statistics a recording of the actuator has: equation, label, coordinate and place of each."""

from itertools import pairwise

import numpy as np

from ..actuator.motor import TWO_PI
from ..gap.twin import Cell

PHASE_EQUATIONS = ("electrical_a", "electrical_b", "electrical_c")
#: rows of the residual array
EQUATIONS = (
    *PHASE_EQUATIONS,
    "sensor_current",
    "sensor_voltage",
    "sensor_speed",
    "torque",
    "position",
    "bus",
    "control",
)
SPEED_EDGES = (2.0, 8.0, 20.0, 50.0, 110.0, 1.0e9)  # rad/s
ORDERS = (1, 2, 4, 8, 12, 24, 36, 72)  # of the mechanical turn; each the double or the sum of earlier ones
ANGLE_BINS = 12
COMMUTATIONS = ("before_on", "after_on", "before_off", "after_off")


def _specification() -> list[tuple[str, str, str, float, float]]:
    """(label, equation, along, from, to) of every statistic, in the order in which they are filled."""
    out: list[tuple[str, str, str, float, float]] = []
    for equation in PHASE_EQUATIONS:
        for label, along in (
            ("plateau k", "rotor_speed"),
            ("plateau R", "current"),
            ("plateau constant", "direction"),
            ("plateau L", "current"),
            ("plateau i2 di", "current"),
            ("plateau k cos", "rotor_angle"),
            ("plateau k sin", "rotor_angle"),
            ("plateau R t", "time"),
            ("plateau k t", "time"),
            ("plateau |i| i", "current"),
            ("plateau sign", "direction"),
            ("floating k", "rotor_speed"),
            ("floating slope", "rotor_angle"),
            ("floating constant", "direction"),
            ("floating k cos", "rotor_angle"),
            ("floating k sin", "rotor_angle"),
            ("commutation L", "current"),
            ("commutation R", "current"),
            ("commutation k", "rotor_speed"),
            ("5th harmonic", "order"),
            ("7th harmonic", "order"),
        ):
            out.append((label, equation, along, 0.0, 0.0))
        for b in range(ANGLE_BINS):
            out.append(
                (f"sector {30 * b}", equation, "rotor_angle", TWO_PI * b / ANGLE_BINS, TWO_PI * (b + 1) / ANGLE_BINS)
            )
    for label in ("constant", "i_a", "i_b", "i_c", "floating a", "floating b", "floating c"):
        out.append((f"sum {label}", "sensor_current", "current", 0.0, 0.0))
    for label, along in (("constant", "direction"), ("sum k", "rotor_speed")):
        out.append((f"sum {label}", "sensor_voltage", along, 0.0, 0.0))
    for label, along in (
        ("constant", "direction"),
        ("scale", "rotor_speed"),
        ("acceleration", "time"),
        ("sign", "direction"),
        ("lattice", "rotor_speed"),
    ):
        out.append((f"speed {label}", "sensor_speed", along, 0.0, 0.0))
    for direction, low, high in (("forward", 0.0, 1.0), ("backward", -1.0, 0.0)):
        for label in ("constant", "speed", "acceleration"):
            out.append((f"{direction} {label}", "torque", "direction", low, high))
        for low, high in pairwise(SPEED_EDGES):
            signed = (low, high) if direction == "forward" else (-high, -low)
            out.append((f"{direction} speed bin", "torque", "rotor_speed", *signed))
    for label, along in (("position", "rotor_angle"), ("drive", "current"), ("time", "time")):
        out.append((label, "torque", along, 0.0, 0.0))
    for order in ORDERS:
        for part in ("cos", "sin"):
            out.append((f"order {order} {part}", "torque", "order", float(order), float(order)))
    for label, along in (
        ("forward", "direction"),
        ("backward", "direction"),
        ("acceleration", "time"),
        ("speed", "rotor_speed"),
        ("torque", "current"),
        ("oscillation", "order"),
    ):
        out.append((f"play {label}", "position", along, 0.0, 0.0))
    for label, along in (("constant", "direction"), ("current", "current"), ("power", "rotor_speed")):
        out.append((f"bus {label}", "bus", along, 0.0, 0.0))
    for label in ("slope ahead", "slope", "slope before"):
        out.append((f"regulator {label}", "control", "time", 0.0, 0.0))
    for letter in "abc":
        for label in COMMUTATIONS:
            out.append((f"{letter} {label}", "control", "rotor_angle", 0.0, 0.0))
    return out


SPECIFICATION = _specification()
SIZE = len(SPECIFICATION)
#: first statistic of each group
PER_PHASE = 21 + ANGLE_BINS
SUM_I_AT = 3 * PER_PHASE
SUM_V_AT = SUM_I_AT + 7
SPEED_AT = SUM_V_AT + 2
TORQUE_AT = SPEED_AT + 5
PER_DIRECTION = 3 + len(SPEED_EDGES) - 1
TORQUE_REST_AT = TORQUE_AT + 2 * PER_DIRECTION
ORDERS_AT = TORQUE_REST_AT + 3
POSITION_AT = ORDERS_AT + 2 * len(ORDERS)
BUS_AT = POSITION_AT + 6
CONTROL_AT = BUS_AT + 3
COMMUTATION_AT = CONTROL_AT + 3
LATTICE = SPEED_AT + 4
OSCILLATION = POSITION_AT + 5
#: statistics of di/dt; how much of it the samples show depends on where they fall on the switching ripple
RIPPLE = np.array([j * PER_PHASE + m for j in range(3) for m in (3, 4, 16)])
SPEED_BINS = np.array([TORQUE_AT + d * PER_DIRECTION + 3 + b for d in (0, 1) for b in range(len(SPEED_EDGES) - 1)])


def cells_of(recording: str) -> list[Cell]:
    """One cell per statistic of one recording."""
    return [Cell(recording, equation, along, low, high, label) for label, equation, along, low, high in SPECIFICATION]

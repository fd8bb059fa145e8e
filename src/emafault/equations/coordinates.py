"""What the rows of an equation lie along, and the drivers that a coefficient in it multiplies."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from scipy.ndimage import uniform_filter1d

from ..actuator.parameters import ActuatorParameters
from ..diagnosis.sets import REMAINDER_SIZES
from . import commutation, control, electrical, torque
from .point import State
from .signals import SPEED_SPAN, Signals, odd

LEVEL = 4  # of the functions of a remainder: the current's
TEMPERATURE = 14  # the temperature's
#: coefficient that several equations have, of a phase or of all -> its place in the simulators
COEFFICIENTS = {**{f"k_{j}": f"emf_{j}" for j in "abc"}, "k": "back_emf", "R": "resistance"}
SLOW_FUNCTIONS = (0, 2, 5, 14)  # of the remainder: none, speed, time, temperature
EACH = (0, 1, 2, 5, 16, 17)  # of the remainder, in each recording by itself: constant, direction, speed, time
#: functions of a remainder along one coordinate: speed, current, time and temperature, angle
ALONG = ((0, 1, 2, 3, 15), (0, 4), (0, 5, 14, 16, 17), (0, 6, 7, 8, 9, 10, 11, 12, 13))
SMOOTH = 3  # functions of the speed that an own form has
#: functions of an own form along one coordinate: speed, current, time and temperature, angle
OWN_ALONG = ((0, 1, 2, 3, 4), (0, 5), (0, 6, 15), (0, 7, 8, 9, 10, 11, 12, 13, 14))
#: the same of the control equation, whose own forms lack the current, which is what it measures
OWN_OF_CONTROL = ((0, 1, 2, 3, 4), (0, 5, 14), (0, 6, 7, 8, 9, 10, 11, 12, 13))
#: times that rows are averaged over an interval, where not once: a second difference is a mean of means
AVERAGED = {"torque": 2, "position": 0}
SLOW = 8.0  # rad/s, scale of the range of low speeds, where friction changes most
BEATS = 0.1  # of the rate of runs, below which a wave in their means is not one of their own
SHARE = 0.02  # relative change of the torque constant, for a remainder of the size of the noise
SWEPT = 0.02  # of speed times shape (rad/s), for a driver of the size of one


def functions_of(rec: Signals) -> dict[str, Any]:
    """What the samples of a recording lie along, and the functions that remainders are made of; (sample,) each."""
    w = rec.speed / 100.0
    # what goes along a noisy current, times that current, would have a part of the noise's square for a function of it
    level = uniform_filter1d(rec.level, max(3, odd(SPEED_SPAN / rec.interval)), mode="nearest") / 2.0
    t = rec.time / rec.time[-1] - 0.5
    x = rec.actuator.pole_pairs * rec.middle
    direction = np.where(rec.moving, rec.direction, 0.0)  # at rest its sign is the noise's
    base = {
        "direction": direction, "rotor_speed": rec.speed, "current": 2.0 * level, "time": rec.time,
        "rotor_angle": np.mod(rec.middle, 2 * np.pi), "angle": rec.middle, "output_angle": rec.shaft,
        "temperature": np.full(rec.size, rec.ambient), "half_sweep": rec.half_sweep,
    }  # fmt: skip
    phi = [
        np.ones(rec.size), direction, np.abs(w), w * w, level - 0.3, t,
        np.cos(x), np.sin(x), np.cos(2 * x), np.sin(2 * x),
        np.cos(3 * x), np.sin(3 * x), np.cos(rec.middle), np.sin(rec.middle),
        np.full(rec.size, rec.dT_measured / 50.0),
        np.exp(-np.abs(rec.speed) / SLOW), np.cos(4 * np.pi * t), np.sin(2 * np.pi * t),
    ]  # fmt: skip
    # a smooth process of unit order (cosine series of a Brownian path) along the logarithm of the speed: a form that
    # differs by a power of it does so by as much at every speed
    top = rec.actuator.bus_voltage / (2.0 * rec.actuator.back_emf)
    far = np.log1p(np.abs(rec.speed) / SLOW) / np.log1p(top / SLOW)
    smooth = [np.sqrt(2.0) / k * np.cos(np.pi * k * far) for k in range(1, SMOOTH + 1)]
    stacked = np.array(phi)
    return {**base, "phi": stacked, "own": _own(stacked, smooth)}


def _own(phi: np.ndarray, smooth: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Functions of an own form, (row,) each: views of those of a remainder, and smooth ones of the speed."""
    return [*phi[:2], *smooth, *phi[LEVEL : TEMPERATURE + 1]]


def coordinates_of(state: State, equation: str, functions: Mapping[str, Any]) -> dict[str, Any]:
    """What is an equation's own: the drivers that a coefficient would multiply, and where its rows are not the
    samples, what they lie along; (row,) each. ``functions`` as ``functions_of`` has them."""
    rec = state.rec
    base = dict(functions)
    phi, own = list(base.pop("phi")), base.pop("own")
    kinds: dict[str, Any] = {
        "slow": SLOW_FUNCTIONS,
        "each": [f - (equation == "control" and f > LEVEL) for f in EACH],
        "drivers": np.array(drivers_of(state, equation, functions)),
    }
    of = rows_of(state, equation)
    kinds |= {"averaged": AVERAGED.get(equation, 1)} if AVERAGED.get(equation, 1) else at_ends(rec, rec.angle)
    if equation == "torque":
        # the measured acceleration keeps its coefficient: another inertia is another share of the net torque
        kinds["sizes"] = {2: SHARE * typical_torque(rec.actuator), 3: 0.0, 4: 0.0, 5: 0.0}
        kinds["by_speed"] = (4, 5)  # drivers, a function of the speed times which is one by itself
    if equation == "commutation":
        kinds["sizes"] = dict.fromkeys(range(1, 4), commutation.REACH / max(REMAINDER_SIZES))
    if equation == "control":
        phi = [f for k, f in enumerate(phi) if k != LEVEL]  # the measured quantity itself
    elif equation.startswith("electrical") and of is not None:
        # what means over runs leave of ripple and commutations beats with both
        kinds |= {"highest_order": 0.5 * rec.actuator.pole_pairs, "highest_frequency": BEATS / electrical.RUN}
    if of is None:
        return kinds
    along = {k: of(v) for k, v in base.items()}
    stacked = np.array([of(f) for f in phi])
    return {
        **along, "rotor_angle": np.mod(along["angle"], 2.0 * np.pi), "phi": stacked,
        "own": _own(stacked, [of(f) for f in own[2 : 2 + SMOOTH]]), **kinds,
    }  # fmt: skip


def drivers_of(state: State, equation: str, functions: Mapping[str, Any]) -> list[np.ndarray]:
    """(row,) each of the quantities that a coefficient of an equation multiplies, the first of them 1."""
    rec = state.rec
    out = [np.ones(rec.size)]
    if equation.startswith("electrical"):
        j = "abc".index(equation[-1])
        out += [rec.current[:, j], np.asarray(state.regressor[j].value) * SWEPT]
    elif equation == "torque":  # friction, torque constant, inertia, and what goes with the speed and its square
        typical, w = typical_torque(rec.actuator), rec.speed / 100.0
        out += [rec.direction, state.drive / typical, state.net / typical, w, w * w]
    elif equation == "sensor_speed":  # at rest the angle's rate is its noise, which the residual has too
        out += [np.where(rec.moving, rec.speed / 100.0, 0.0)]
    elif equation == "sensor_current":
        balanced = rec.current - rec.current.mean(axis=1, keepdims=True)
        out += [balanced[:, j] for j in range(2)]
    elif equation == "bus":
        out += [state.bus_current]
    elif equation == "position":
        out += [functions["direction"], rec.acceleration / 1e3]
    of = rows_of(state, equation)
    if of is not None:
        out = [of(d) for d in out]
    if equation == "commutation":  # the angle at which each phase is switched on
        out += list(commutation.by_angle_of_phase(state))
    return [*out, control.late(state)] if equation == "control" else out


def at_ends(rec: Signals, angle: np.ndarray) -> dict[str, Any]:
    """What samples lie along that are taken at an interval's end, where the others are means over it; ``angle`` : of
    the rotor there (rad)."""
    time = rec.time + 0.5 * rec.interval
    return {"time": time, "angle": angle, "rotor_angle": np.mod(angle, 2.0 * np.pi), "averaged": 0}


def rows_of(state: State, equation: str) -> Callable[[np.ndarray], np.ndarray] | None:
    """What an equation's rows have of a signal (sample,); None where they are the samples."""
    rec = state.rec
    if equation == "control":
        width = control.block_length(rec)
        return rows_at((np.arange(rec.size // width - 1) + 1) * width)
    if equation == "torque":
        return torque.two_intervals
    if equation == "commutation":
        return rows_at(np.concatenate([commutation.rows_of(state, j) for j in range(3)]))
    if equation.startswith("electrical") and rec.current_end is None:
        return electrical.averaging(state, "abc".index(equation[-1]))
    return None


def rows_at(rows: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """Picks rows of a signal."""
    return lambda x: x[rows]


def typical_torque(actuator: ActuatorParameters) -> float:
    """Torque of two phases at a tenth of the current limit (N m)."""
    return 0.2 * actuator.back_emf * actuator.current_limit

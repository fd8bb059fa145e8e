"""Quantities of one recording at a point that several equations need: true currents, coefficients, the shape."""

import numpy as np

from ..actuator.shape import trapezoid_at, trapezoid_swept
from . import rounding, waveform, windings
from .acquisition import currents
from .dual import Dual, Number, value_of
from .point import SEEDED, State, effect_name
from .signals import passing_time
from .terms import with_hook

PLATEAU = np.pi / 6.0  # electrical rad, where the commutation switches a phase on
NARROW = 1e-5  # electrical rad; a phase that is on for less carries no current


def fill(state: State, rounds: bool = True) -> None:
    """Compute them, in the order in which they depend on one another; see ``State`` for ``rounds``."""
    rec, p = state.rec, state.p
    off = rounding.error(rec, p) if rounds else None
    state.dT = p.own("dT") + p(f"ambient.start@{rec.name}") + rec.dT_measured
    # the terms of the effects see the recording
    rec.dT = state.dT
    scale = _product(state, "inertia")
    rec.inertia_scale = scale if isinstance(scale, Dual) else Dual(scale)
    rec.play = _sum(state, "play")
    rec.ahead = _sum(state, "angle") + p.own("zero")
    state.own_load = p.own("load.each")
    rec.load = _sum(state, "load") + state.own_load * rec.actuator.gear_ratio
    rec.spring = _sum(state, "spring")
    rec.flexible = flexible(state)
    state.current, state.current_end, state.shown, state.lag = currents(rec, p, off)
    _angles(state)
    _coefficients(state)
    _resistances(state)


def flexible(state: State) -> bool:
    """Whether the user shaft is driven through a flexibility."""
    return any(m.is_flexible(state.p.of(effect_name(m)), state.rec) for m in with_hook("is_flexible"))


def _product(state: State, hook: str, *args):
    total: Dual | float = 1.0
    for m in with_hook(hook):
        total = total * getattr(m, hook)(state.p.of(effect_name(m)), *args)
    return total


def _sum(state: State, hook: str, *args):
    total: Dual | float = 0.0
    for m in with_hook(hook):
        total = total + getattr(m, hook)(state.p.of(effect_name(m)), *args)
    return total


def _angles(state: State) -> None:
    """Mean of f over each interval, swept and over its conducting part; both with derivatives by offset and ramp."""
    rec = state.rec
    shift, ramp = rec.ahead, _sum(state, "ramp")
    poles = rec.actuator.pole_pairs
    state.swept, state.regressor, state.conducting = [], [], []
    per = 1.0 / (poles * rec.interval)
    for j in range(3):
        low, high = poles * rec.before - rec.axis[j], poles * rec.angle - rec.axis[j]
        state.swept.append(_mean_shape(state, low, high, shift, ramp, True) * per)
        # what effects make of it is taken of a smoothed angle, whose noise is not that of the residual
        calm_low, calm_high = poles * rec.calm_before - rec.axis[j], poles * rec.calm - rec.axis[j]
        state.regressor.append(_mean_shape(state, calm_low, calm_high, shift, ramp, True) * per)
        state.conducting.append(_conducting_shape(state, j, np.minimum(low, high), np.maximum(low, high), shift, ramp))


def _mean_shape(state: State, low, high, shift, ramp, joined: bool = False) -> Dual:
    """Integral of f from low to high (electrical rad), measured angles.

    ``joined``: the first interval ends where it begins, and each of the others begins where the one before ends.
    """
    off, r = float(value_of(shift)), float(value_of(ramp))
    F2, dr2 = trapezoid_swept(high - off, r)
    F1, dr1 = (_before(F2), _before(dr2)) if joined else trapezoid_swept(low - off, r)
    f1: Number = 0.0
    f2: Number = 0.0
    if isinstance(shift, Dual) and shift.slopes:
        at_end = trapezoid_at(high - off, r)[0]
        f1, f2 = _before(at_end) if joined else trapezoid_at(low - off, r)[0], at_end
    total = shift.through(F2 - F1, f1 - f2) + ramp.through(0.0, dr2 - dr1)
    for m in with_hook("harmonics"):
        total = total + m.harmonics(state.p.of(effect_name(m)), low - off, high - off)
    return total + waveform.swept(state.p, low - off, high - off, r)


def _before(x: np.ndarray) -> np.ndarray:
    return np.concatenate([x[:1], x[:-1]])


def _conducting_shape(state: State, j: int, low, high, shift, ramp) -> Dual:
    """Mean of f over each interval, weighted as the current of phase j is.

    The mean of f i is the mean current times this, even where the current sets in within the interval. Switched on, the
    current rises evenly, and switched off, by the edge of the phase that replaces it, it falls evenly, over the angle
    turned while it passes from phase to phase.
    """
    rec, motor = state.rec, state.rec.actuator
    passed = motor.pole_pairs * rec.speed * passing_time(motor, rec.level)
    turned = np.clip(passed, -PLATEAU, PLATEAU)
    half_turn = np.pi * np.floor(0.5 * (low + high) / np.pi)
    first = half_turn + PLATEAU - _early(state, j)
    last = half_turn + np.pi - PLATEAU - _early(state, (j + 1) % 3)
    on, off = np.where(turned < 0.0, last, first), np.where(turned < 0.0, first, last)
    rises, stays, falls = (
        _within(low, high, *ends) for ends in ((on, on + turned), (on + turned, off), (off, off + turned))
    )
    per = 1.0 / np.where(turned == 0.0, 1.0, turned)
    risen, left = (0.5 * (rises[0] + rises[1]) - on) * per, 1.0 - (0.5 * (falls[0] + falls[1]) - off) * per
    length = risen * (rises[1] - rises[0]) + (stays[1] - stays[0]) + left * (falls[1] - falls[0])
    narrow = length < NARROW
    # where no current flows the shape counts for nothing, and is that beside the edge
    stays = stays[0], np.where(narrow, stays[0] + NARROW, stays[1])
    per, risen, left = (np.where(narrow, 0.0, x) for x in (per, risen, left))
    total = _mean_shape(state, *stays, shift, ramp)
    for (begin, end), share, change in ((rises, risen, per), (falls, left, -per)):
        # the mean of the product of what changes evenly is not that of the means
        bend = change * (end - begin) ** 2 / 12.0
        total = total + _mean_shape(state, begin, end, shift, ramp) * share + bend * _change(begin, end, shift, ramp)
    return total * (1.0 / np.maximum(length, NARROW))


def _within(low: np.ndarray, high: np.ndarray, one: np.ndarray, other: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The part of each interval that lies between two ends."""
    ends = np.minimum(one, other), np.maximum(one, other)
    return np.clip(low, *ends), np.clip(high, *ends)


def _change(begin: np.ndarray, end: np.ndarray, shift, ramp) -> np.ndarray:
    """By how much f changes from one angle to another."""
    off, r = float(value_of(shift)), float(value_of(ramp))
    return trapezoid_at(end - off, r)[0] - trapezoid_at(begin - off, r)[0]


def _early(state: State, j: int) -> float:
    """Electrical rad by which the commutations that switch phase j on come early."""
    return float(value_of(_sum(state, "commutation", j) - state.p.own("zero")))


def _coefficients(state: State) -> None:
    rec, a = state.rec, state.rec.actuator
    x, y = _eccentricity(state, "xi_x"), _eccentricity(state, "xi_y")
    state.k, state.turns = [], []
    for j in range(3):
        turns = _turns(state, "N" + "abc"[j])
        g = 1.0 + x * np.cos(rec.axis[j]) + y * np.sin(rec.axis[j])
        state.turns.append(turns)
        own = windings.factor(state.p, "back_emf", j)
        state.k.append(_product(state, "coefficient", rec, j) * own * turns * g * a.back_emf)


def _turns(state: State, fault: str) -> Dual:
    """Share of a phase's turns that is left, of a seeded recording by itself times what all of them have."""
    return (1.0 - state.p.own(fault)) * (1.0 - _shared(state, fault))


def _eccentricity(state: State, fault: str) -> Dual:
    """Static eccentricity along one axis (1), of a seeded recording by itself and what all of them have."""
    return state.p.own(fault) + _shared(state, fault)


def _shared(state: State, fault: str) -> Dual:
    return state.p(SEEDED + fault) if state.rec.health == "seeded" else Dual(0.0)


def _resistances(state: State) -> None:
    rec, p, a = state.rec, state.p, state.rec.actuator
    base = [_product(state, "winding", rec, j) * state.turns[j] * a.resistance for j in range(3)]
    alpha = a.copper_coefficient
    ripple = a.hysteresis**2 / 3.0
    loss = np.zeros(rec.size)
    warm = 1.0 + alpha * rec.dT_measured
    for j in range(3):
        i = np.abs(np.asarray(value_of(state.current[j])))
        on = i > 0.5 * a.hysteresis
        # a phase that is on for a part of an interval carries the pair's current there
        loss = loss + float(value_of(base[j])) * warm * (i * np.maximum(i, rec.level) + on * ripple)
    heat = 0.0
    for m in with_hook("heating"):
        heat = heat + m.heating(p.of(effect_name(m)), rec, loss)
    state.resistance = [
        base[j] * (1.0 + alpha * (state.dT + heat)) + _sum(state, "resistance", rec, j) for j in range(3)
    ]
    state.loss = loss
    drive = sum(
        (value_of(state.k[j]) * value_of(state.conducting[j]) * value_of(state.current[j]) for j in range(3)), 0.0
    )
    power = loss + drive * rec.rate + _stored(state)
    state.bus_current = power / (_supply(state, power) if rec.bus is None else rec.bus)


def _supply(state: State, power: np.ndarray) -> np.ndarray:
    """(sample,) voltage of a supply that is not recorded, under this power, at the point (V)."""
    unloaded = float(value_of(_sum(state, "supply")))
    sag = np.asarray(value_of(_sum(state, "sag", state.rec, power / unloaded)))
    return unloaded - sag


def _stored(state: State) -> np.ndarray:
    """(sample,) power that the fields of the windings take up (W)."""
    energy = 0.5 * state.rec.actuator.inductance * sum(np.asarray(value_of(i)) ** 2 for i in state.current_end)
    return np.diff(energy, prepend=0.0) / state.rec.interval

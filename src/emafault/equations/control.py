"""The current that flows against the current that the controller asks for; gains and limits are the controller's own.

Everything that the controller sees is recorded: command, output position, speed. Half the sum of the absolute phase
currents is the pair's current, through commutations too. Rows are means over ``BLOCK`` and differenced, which takes the
random walk out that the integral makes of the sensors' noise.
"""

import numpy as np
from scipy.ndimage import uniform_filter1d

from ..actuator.commands import with_corners
from . import position
from .dual import Dual, clip, value_of
from .point import State, effect_name
from .sensor_speed import seen_speed
from .terms import with_hook

BLOCK = 2e-3  # s
AVERAGED = 1e-2  # s
USUAL_DELAY = 1e-4  # s
NEAR_LIMIT = 0.4  # of the current limit, beyond which a row may be limited


def residual(state: State) -> Dual:
    """Mean pair current less the demand (A), (block,), differenced."""
    rec, a, p = state.rec, state.rec.actuator, state.p
    h = rec.interval
    # a demand is in force for one control period from the instant its inputs are sampled
    lead = 0.5 * a.control_period
    # what the controller saw is recorded with noise that a small gain would take out of the demand: the angle's rate
    # and the angle behind the gear have little of it, and what the recorded ones differ from them is averaged
    model = np.asarray(value_of(position.shaft_angle(state)))
    output = model + uniform_filter1d(rec.output - model, max(1, round(AVERAGED / h)), mode="nearest")
    model = np.asarray(value_of(seen_speed(state, Dual(rec.speed))))
    seen = model + uniform_filter1d(rec.speed_recorded - model, max(1, round(AVERAGED / h)), mode="nearest")
    wanted = p("controller.position_gain") * (a.gear_ratio * (_commanded(rec, lead) - _at_ticks(output, h, lead)))
    error = clip(wanted, p("controller.speed_limit")) - _centred(seen, h, lead)
    state.at_limit = _at_limit(rec)
    # the integral rests while the demand is at its limit
    integral = error.kept(~state.at_limit).linear(lambda x: np.cumsum(x) * h, rec.size)
    demand = p("controller.speed_gain") * error + p("controller.speed_integral_gain") * integral
    demand = clip(demand, p("controller.current_limit"))
    late: Dual | float = p(f"controller.timing@{rec.name}")
    for m in with_hook("delay"):
        late = late + m.delay(p.of(effect_name(m)))
    demand = demand - late * np.gradient(np.asarray(demand.value), h)
    sign = np.sign(sum(np.asarray(state.conducting[j].value) * rec.current[:, j] for j in range(3)))
    pair = 0.5 * np.abs(rec.current).sum(axis=1) * sign
    width = block_length(rec)
    return (pair - demand).linear(lambda x: _blocks(x, width), rec.size)


def _at_limit(rec) -> np.ndarray:
    """(sample,) where the current stands at its highest: the demand is limited there."""
    level = 0.5 * np.abs(rec.current).sum(axis=1)
    return level > NEAR_LIMIT * rec.actuator.current_limit


def block_length(rec) -> int:
    """Intervals in a block."""
    return max(1, round(BLOCK / rec.interval))


def _commanded(rec, lead: float) -> np.ndarray:
    """Command at the middle of each interval, ``lead`` s earlier, with the corners between its samples."""
    ends = rec.interval * np.arange(1, rec.size + 1)
    times, positions = with_corners(ends, rec.command)
    first = rec.command[0] - (rec.command[1] - rec.command[0])
    return np.interp(rec.time - lead, np.concatenate([[0.0], times]), np.concatenate([[first], positions]))


def _at_ticks(x: np.ndarray, h: float, lead: float) -> np.ndarray:
    """Mean over each interval of a signal recorded at the intervals' ends, ``lead`` s earlier."""
    n = np.arange(len(x)) - 0.5 - lead / h
    return np.interp(n, np.arange(-1, len(x)), np.concatenate([[0.0], x]))


def _centred(x: np.ndarray, h: float, lead: float) -> np.ndarray:
    """A signal recorded as means, ``lead`` s earlier."""
    n = np.arange(len(x)) - lead / h
    return np.interp(n, np.arange(-1, len(x)), np.concatenate([[0.0], x]))


def _blocks(x: np.ndarray, width: int) -> np.ndarray:
    count = len(x) // width
    return np.diff(x[: count * width].reshape(count, width).mean(axis=1))


def late(state: State) -> np.ndarray:
    """(block,) what a demand that is ``USUAL_DELAY`` late leaves, in units of the noise; of the current that flows."""
    rec = state.rec
    width = block_length(rec)
    level = 0.5 * np.abs(rec.current).sum(axis=1) * np.sign(state.drive)
    rate = np.gradient(uniform_filter1d(level, max(1, round(BLOCK / rec.interval)), mode="nearest"), rec.interval)
    return USUAL_DELAY * _blocks(rate, width) / np.sqrt(noise_bands(state)[0])


def usable(state: State) -> np.ndarray:
    """(block,) where the rotor turns and no limit may be reached at random."""
    rec = state.rec
    width = block_length(rec)
    count = rec.size // width
    moving = rec.moving[: count * width].reshape(count, width).all(axis=1)
    free = ~_at_limit(rec)[: count * width].reshape(count, width).any(axis=1)
    # through zero the mean of a magnitude is not the magnitude of the mean
    level = 0.5 * np.abs(rec.current).sum(axis=1)[: count * width].reshape(count, width)
    known = moving & free & (level.min(axis=1) > rec.actuator.hysteresis)
    return known[1:] & known[:-1]


def noise_bands(state: State) -> list[np.ndarray]:
    """Diagonals of the noise's covariance (A2)."""
    rec, a, s = state.rec, state.rec.actuator, state.rec.noise
    width = block_length(rec)
    averaged = np.sqrt(max(1, round(AVERAGED / rec.interval)))
    demand = a.speed_gain * np.hypot(s.speed, a.gear_ratio * a.position_gain * s.position) / averaged
    ripple = 0.1 * a.hysteresis
    white = (s.current**2 + ripple**2) / width + demand**2 + (0.005 * a.hysteresis) ** 2
    walk = (a.speed_integral_gain / a.speed_gain * demand) ** 2 * rec.interval * width * rec.interval
    count = rec.size // width - 1
    return [np.full(count, 2.0 * white + walk), np.full(count - 1, -white)]

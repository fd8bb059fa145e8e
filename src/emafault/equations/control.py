"""The current that flows against the current that the controller asks for; gains and limits are the controller's own.

Everything that the controller sees is recorded: command, output position, speed. Its command may pass a filter, and the
command's speed may be fed forward to the demanded speed. Half the sum of the absolute phase
currents is the largest of them, and the pair's current but for what a commutation adds to it. Rows are means over
``BLOCK`` and differenced, which takes the random walk out that the integral makes of the sensors' noise.
"""

import numpy as np
from scipy.ndimage import binary_dilation, uniform_filter1d

from ..actuator.commands import with_corners
from ..delays import filtered
from . import commutation, position
from .acquisition import late_by, recorded_late, through
from .dual import Dual, clip, value_of
from .point import State, effect_name
from .sensor_speed import seen_speed
from .signals import SPEED_SPAN, UNRESOLVED, odd
from .terms import with_hook

BLOCK = 2e-3  # s
AVERAGED = 1e-2  # s
USUAL_DELAY = 1e-4  # s
RIPPLE = 0.0075  # of the hysteresis band, that stays in a block's mean (measured on simulations without noise)
HEADROOM = 0.1  # of the supply's voltage
NEAR_LIMIT = 0.4  # of the current limit, beyond which a row may be limited


def residual(state: State) -> Dual:
    """Mean pair current less the demand (A), (block,), differenced; over the speed gain, times the nominal one."""
    rec, a, p = state.rec, state.rec.actuator, state.p
    h = rec.interval
    # a demand is in force for one control period from the instant its inputs are sampled
    lead = 0.5 * a.control_period
    # what the controller saw is recorded with noise that a small gain would take out of the demand: the angle's rate
    # and the angle behind the gear have little of it, and what the recorded ones differ from them is averaged, over
    # a span that takes out the noise and leaves the sensor's own dynamics
    shaft = position.shaft_angle(state)
    output = shaft + position.scaled(state, shaft, "sensor")
    output = output + position.residual(state).linear(lambda x: _averaged(x, h), rec.size)
    model = seen_speed(state, Dual(rec.speed))
    span = _speed_span(state)
    # a speed that comes late or early on its way to the record was in time where the controller took it
    beyond = (_calmed(rec.speed_recorded, h) - recorded_late(p, "speed", model, rec.size)).linear(
        lambda x: uniform_filter1d(x, span, mode="nearest"), rec.size
    )
    # rounding is the recording's alone, and no more than a step
    more = np.maximum(np.abs(beyond.value) - rec.speed_step, 0.0)
    seen = model + Dual(np.sign(beyond.value) * more, beyond.kept(more > 0.0).slopes)
    commanded = rec.once(("commanded",), lambda: _commanded(rec, lead))
    at_ticks = output.linear(lambda x: _at_ticks(x, h, lead), rec.size)
    constant = p("command.filter") * (1.0 / h)
    seen_command = through(Dual(commanded), filtered, constant, rec.size)
    wanted = p("controller.position_gain") * (a.gear_ratio * (seen_command - at_ticks))
    wanted = wanted + p("command.feedforward") * (a.gear_ratio * rec.once(("command_rate",), lambda: _rate(rec, lead)))
    # the whole law through the average that the angle's rate is taken over, so that no side of it is smoother
    asked = clip(wanted, p("controller.speed_limit")).linear(lambda x: _calmed(x, h), rec.size)
    # an offset of a recorded speed or position may be the recording's alone
    error = asked - seen.linear(lambda x: _centred(x, h, lead), rec.size) + p(f"controller.bias@{rec.name}")
    # rows are changes where no limit is reached: where the integral rests elsewhere does not show in them. It holds the
    # present sample too, which makes up for the time that a demand is in force
    integral = error.linear(lambda x: np.cumsum(x) * h + (lead - 0.5 * h) * x, rec.size)
    gain = p("controller.speed_gain")
    # solved for the speed's error, which the noise lies on: a smaller gain must not make the noise smaller
    asked_for = error + p("controller.speed_integral_gain") / gain * integral
    late: Dual | float = p(f"controller.timing@{rec.name}") + h * late_by(p, "current")
    for m in with_hook("delay"):
        late = late + m.delay(p.of(effect_name(m)))
    sign = np.sign(sum(np.asarray(state.conducting[j].value) * rec.current[:, j] for j in range(3)))
    flowing = (_level(state) - _beyond(state)) * sign + _sensors_show(state)
    flowing = flowing.linear(lambda x: _calmed(x, h), rec.size) / gain
    # the current changes as the demand does, and is known with less noise
    asked_for = asked_for - late * np.gradient(np.asarray(value_of(flowing)), h)
    width = block_length(rec)
    out = a.speed_gain * (flowing - asked_for)
    return out.linear(lambda x: _blocks(x, width), rec.size)


def _calmed(x: np.ndarray, h: float) -> np.ndarray:
    return uniform_filter1d(x, odd(SPEED_SPAN / h), mode="nearest")


def _averaged(x: np.ndarray, h: float) -> np.ndarray:
    return uniform_filter1d(x, odd(AVERAGED / h), mode="nearest")


def _speed_span(state: State) -> int:
    """Samples that the speed is averaged over, of the recording as it is, whatever the point takes off it.

    Of spans up to ``AVERAGED`` it is that with the least unbiased estimate of the squared error (Stein 1981, Annals of
    Statistics 9, 1135).
    """
    rec = state.rec
    return rec.rows_from.once(("control.speed_span",), lambda: _least_risk(rec.rows_from))


def _least_risk(rec) -> int:
    """The span (samples) with the least risk: the mean square of what the average takes away, plus twice the noise's
    covariance with its own average."""
    h, calm, longest = rec.interval, odd(SPEED_SPAN / rec.interval), odd(AVERAGED / rec.interval)
    beyond = _calmed(rec.speed_recorded - rec.rate, h)
    impulse = np.zeros(4 * (longest + calm) + 1)
    impulse[len(impulse) // 2] = 1.0
    speed = rec.noise.speed * np.sqrt(rec.spacing("speed"))
    noise = [speed * impulse, _size(rec.angle_noise) / h * np.diff(impulse, prepend=0.0)]
    noise = [uniform_filter1d(x, calm) for x in noise]
    risk = {}
    for span in sorted({odd(longest / 2**k) for k in range(longest.bit_length())}):
        left = beyond - uniform_filter1d(beyond, span, mode="nearest")
        kept = sum(float(x @ uniform_filter1d(x, span)) for x in noise)
        risk[span] = float(np.mean(left**2)) + 2.0 * kept
    return min(risk, key=lambda span: risk[span])


def _level(state: State) -> Dual:
    """(sample,) half the sum of the absolute phase currents (A), as late as they are recorded: what undoes a lag
    amplifies noise."""
    out = Dual(0.0)
    for current, lag in zip(state.current, state.lag, strict=True):
        i = current + lag
        out = out + i * (0.5 * np.sign(i.value))
    return out


def _sensors_show(state: State) -> Dual:
    """(sample,) what the regulator sees of the pair's current beyond the true one (A): the mean of what the sensors of
    the two phases that are switched on show, each in the direction in which the pair's current is counted."""
    rec = state.rec
    out = Dual(0.0)
    for j, on in enumerate(counted(rec)):
        out = out + (state.shown[j] - state.current[j]) * (0.5 * on)
    return out


def counted(rec) -> list[np.ndarray]:
    """(sample,) sign in which the current of each phase is the pair's, 0 where it is not switched on."""
    return rec.once(("counted",), lambda: [_counted(rec, phase) for phase in range(3)])


def _counted(rec, j: int) -> np.ndarray:
    f = np.sin(rec.actuator.pole_pairs * rec.middle - rec.axis[j])
    return np.where(np.abs(f) > np.sin(commutation.EDGE), np.sign(f), 0.0).astype(np.int8)


def _beyond(state: State) -> np.ndarray:
    """(sample,) what the largest phase current is above the reference while a current passes from phase to phase (A).

    The diode of the phase that goes off and the star point take a third of the supply's voltage V from it, two thirds
    of the back-EMF with it: a current i is gone after 3 L i / V. The comparator sees the mean of the new pair, which
    starts at half of i, is driven to i in L i / V, and is held there while the third phase fades: the phase that
    stays on carries i^2 L / (6 V) more up to then, i^2 L / (3 V) after, each integrated over time.
    """
    rec, a = state.rec, state.rec.actuator
    charge = 0.5 * a.inductance * rec.level**2 / _supply(rec, np.sign(state.drive))
    return edges(rec) * charge / rec.interval


def edges(rec) -> np.ndarray:
    """(sample,) number of commutations in each interval."""
    return rec.once(("edges",), lambda: _edges(rec))


def _edges(rec) -> np.ndarray:
    edges = np.zeros(rec.size, np.int8)
    for j in range(3):
        low, high, _ = commutation.sweep(rec, j)
        edges += (low < 0.0) & (high >= 0.0) & rec.moving
    return edges


def _lacking(rec, sign: np.ndarray) -> np.ndarray:
    """(sample,) what the pair's current lacks on average while a phase that has been switched on takes over (A).

    Half the current is to be made up, by what the back-EMF leaves of the supply.
    """
    a = rec.actuator
    charge = 0.25 * a.inductance * rec.level**2 / _supply(rec, -sign)
    return charge * 6.0 * a.pole_pairs * np.abs(rec.speed) / (2.0 * np.pi)


def _supply(rec, sign: np.ndarray) -> np.ndarray:
    """(sample,) voltage of the supply, the back-EMF of two phases added where it goes with ``sign`` (V)."""
    a = rec.actuator
    back_emf = 2.0 * a.back_emf * np.abs(rec.speed) * sign * np.sign(rec.speed)
    return np.maximum(_bus(rec) + back_emf, HEADROOM * a.bus_voltage)


def _bus(rec) -> np.ndarray | float:
    """Voltage of the supply, the nominal one where none is recorded (V)."""
    return rec.actuator.bus_voltage if rec.bus is None else rec.bus


def _at_limit(rec) -> np.ndarray:
    """(sample,) where the current stands at its highest: the demand is limited there."""
    return rec.level > NEAR_LIMIT * rec.actuator.current_limit


def without_headroom(rec) -> np.ndarray:
    """(sample,) where back-EMF and resistance leave the supply too little to drive the current that is asked for."""
    a = rec.actuator
    needed = 2.0 * a.back_emf * np.abs(rec.speed) + a.resistance * (2.0 * rec.level)
    return needed > (1.0 - HEADROOM) * _bus(rec)


def block_length(rec) -> int:
    """Intervals in a block."""
    return max(1, round(BLOCK / rec.interval))


def _commanded(rec, lead: float) -> np.ndarray:
    """Command at the middle of each interval, ``lead`` s earlier, with the corners between its samples."""
    ends = rec.interval * np.arange(1, rec.size + 1)
    times, positions = with_corners(ends, rec.command)
    first = rec.command[0] - (rec.command[1] - rec.command[0])
    return np.interp(rec.time - lead, np.concatenate([[0.0], times]), np.concatenate([[first], positions]))


def _rate(rec, lead: float) -> np.ndarray:
    """(sample,) speed of the command (rad/s)."""
    return np.gradient(rec.once(("commanded",), lambda: _commanded(rec, lead)), rec.interval)


def _at_ticks(x: np.ndarray, h: float, lead: float) -> np.ndarray:
    """Mean over each interval of a signal recorded at the intervals' ends, ``lead`` s earlier."""
    n = np.arange(len(x)) - 0.5 - lead / h
    return np.interp(n, np.arange(-1, len(x)), np.concatenate([[0.0], x]))


def _centred(x: np.ndarray, h: float, lead: float) -> np.ndarray:
    """A signal recorded as means, ``lead`` s earlier."""
    n = np.arange(len(x)) - lead / h
    return np.interp(n, np.arange(-1, len(x)), np.concatenate([[0.0], x]))


def _size(x: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(x))))


def _means(x: np.ndarray, width: int) -> np.ndarray:
    count = len(x) // width
    return x[: count * width].reshape(count, width).mean(axis=1)


def _blocks(x: np.ndarray, width: int) -> np.ndarray:
    return np.diff(_means(x, width))


def late(state: State) -> np.ndarray:
    """(block,) what a demand that is ``USUAL_DELAY`` late leaves, in units of the noise; of the current that flows."""
    rec = state.rec
    width = block_length(rec)
    level = rec.level * np.sign(state.drive)
    rate = np.gradient(uniform_filter1d(level, odd(BLOCK / rec.interval), mode="nearest"), rec.interval)
    return USUAL_DELAY * _blocks(rate, width) / np.sqrt(noise_bands(state)[0])


def usable(state: State) -> np.ndarray:
    """(block,) where the rotor turns and the mean currents tell the pair's, no limit may be reached at random, nothing
    is cut off and no average looks beyond the record."""
    rec = state.rec
    return rec.once(("control.usable",), lambda: _usable(rec, np.sign(state.drive)))


def _usable(rec, sign: np.ndarray) -> np.ndarray:
    width = block_length(rec)
    count = rec.size // width
    moving = rec.moving[: count * width].reshape(count, width).all(axis=1)
    limited = _at_limit(rec) | without_headroom(rec) | rec.lost | ~rec.resolved
    limited = binary_dilation(limited, iterations=odd(SPEED_SPAN / rec.interval))
    free = ~limited[: count * width].reshape(count, width).any(axis=1)
    # through zero the mean of a magnitude is not the magnitude of the mean
    level = rec.level[: count * width].reshape(count, width)
    known = moving & free & (level.min(axis=1) > rec.actuator.hysteresis)
    sign = sign[: count * width].reshape(count, width)
    known &= sign.min(axis=1) == sign.max(axis=1)
    reach = (odd(AVERAGED / rec.interval) + odd(SPEED_SPAN / rec.interval)) // 2
    known[: -(-reach // width)] = known[count - -(-reach // width) :] = False
    return known[1:] & known[:-1] & (sign[1:, 0] == sign[:-1, -1])


def noise_bands(state: State) -> list[np.ndarray]:
    """Diagonals of the noise's covariance (A2): of the current, and of what the controller saw, through its law."""
    rec = state.rec
    return rec.once(("control.noise_bands",), lambda: _noise_bands(state))


def _noise_bands(state: State) -> list[np.ndarray]:
    rec = state.rec
    a, s = rec.actuator, rec.noise
    h, width = rec.interval, block_length(rec)
    count = rec.size // width - 1
    level = _means(rec.level, width)
    change = np.abs(np.diff(level, append=level[-1:])) / width
    change = np.maximum(change, np.concatenate([change[:1], change[:-1]]))
    white = (s.current**2 + (UNRESOLVED * change) ** 2) / width + (RIPPLE * a.hysteresis) ** 2
    white = white + _means(_lacking(rec, np.sign(state.drive)), width) ** 2
    bands: list[np.ndarray | float] = [white[1:] + white[:-1], -white[1:-1]]
    averaged, calm, span = odd(AVERAGED / h), odd(SPEED_SPAN / h), _speed_span(state)
    size = 2 * (averaged + calm) + 8 * width
    impulse = np.zeros(size)
    impulse[(averaged + calm) // 2 + width] = 1.0
    position = a.gear_ratio * a.position_gain
    rate = uniform_filter1d(np.diff(impulse, prepend=0.0) / h, calm)
    slow = uniform_filter1d(impulse, averaged)
    for source, sigma in (
        (position * slow, s.position * np.sqrt(rec.spacing("output"))),
        (uniform_filter1d(uniform_filter1d(impulse, calm), span), s.speed * np.sqrt(rec.spacing("speed"))),
        (a.position_gain * (impulse - slow) + rate - uniform_filter1d(rate, span), _size(rec.angle_noise)),
    ):
        demand = a.speed_gain * source + a.speed_integral_gain * h * np.cumsum(source)
        blocked = uniform_filter1d(demand, width, mode="nearest")
        seen = blocked[width:] - blocked[:-width]
        for k in range(-(-(averaged + calm) // width) + 3):
            if k == len(bands):
                bands.append(0.0)
            bands[k] = bands[k] + sigma**2 * float(seen[k * width :] @ seen[: len(seen) - k * width])
    return [np.broadcast_to(band, max(count - k, 0)) for k, band in enumerate(bands)]

"""One recording as the equations take it: angles at both ends of each interval, speed, direction, what is masked."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import comb
from typing import Any

import numpy as np
from scipy.ndimage import binary_dilation, uniform_filter1d

from ..actuator.motor import AXIS
from ..actuator.parameters import ActuatorParameters
from ..actuator.sensors import CHANNEL, SensorNoise
from ..diagnosis.scanning import PRIOR
from ..io.currents_noise import adds_up, derived_phase, resting_noise, shares_of_noise
from ..io.lattice import lattice_step, spacing
from ..io.motion import calm_motion
from ..io.recording import Recording
from ..io.rows import stalled
from ..io.sensors import bridged, cut_off, held, without_spikes
from ..io.updates import across, updates
from .dual import Dual

SPEED_SPAN = 1.5e-3  # s, over which the angle's rate is averaged where only its sign and size matter
UNRESOLVED = 0.2  # of the change from interval to interval: where within one a signal changes is not recorded
SLOW = 2.0  # rad/s, below which dry friction has no known sign
STANDS = 3e-3  # s, to either side, over which the angle of a rotor that stands still does not change
AVERAGED_AT_REST = 2e-2  # s
STRETCH = 12  # samples, that an error of rounding changes evenly over, from which it is none of the noise's
STRETCHES = 30  # in a recording
AROUND = 9  # samples, that a noisy speed is averaged over
QUIETEST = 0.2  # of the noise of the nominal sensors, that recordings may have
#: channels that may be slower than the recording -> variable
MAY_BE_SLOWER = {"speed": "rotor_speed", "output": "output_position", "bus": "bus_voltage"}
REST = 2e-3  # rad of the rotor, within which it has not moved yet


@dataclass
class Signals:
    """Arrays over the intervals (sample,) of one recording; phases trail."""

    name: str
    actuator: ActuatorParameters
    interval: float
    voltage: np.ndarray  # (sample, phase)
    current: np.ndarray  # (sample, phase)
    current_end: np.ndarray | None
    speed_recorded: np.ndarray
    angle: np.ndarray
    output: np.ndarray
    command: np.ndarray
    bus: np.ndarray | None
    ambient: float
    health: str
    noise: SensorNoise
    lost: (
        np.ndarray
    )  # (sample,) bool: a current or voltage is held, cut off or a spike, here or beside it, or all stood
    stalled: np.ndarray  # (sample,) bool: nothing was recorded, or not long before or after
    zero_error: float = 0.0  # electrical rad, standard error of the angle's zero, where it was fitted to the voltages
    speed_step: float = 0.0  # rad/s, of a channel whose values lie on a lattice, as the next two
    current_step: float = 0.0  # A
    output_step: float = 0.0  # rad, where it is more than the noise, as the next
    angle_step: float = 0.0  # rad
    adds_up: bool = False  # whether the recorded currents add up to nothing by construction
    derived: int | None = None  # phase whose current is less the sum of the others, where it has no sensor
    #: (phase,) variance of each sensor's noise over the mean of all, of the currents and of those at intervals' ends
    shares: tuple[np.ndarray, np.ndarray] = (np.ones(3), np.ones(3))
    #: of ``MAY_BE_SLOWER``, the channels that are slower than the recording -> (sample,) bool, their new samples
    new: dict[str, np.ndarray] = field(default_factory=dict)

    @classmethod
    def of(cls, name: str, recording: Recording, actuator: ActuatorParameters, noise: SensorNoise) -> "Signals":
        new = _new(recording)
        r = calm_motion(recording)
        if r.bus_voltage is not None and "bus" in new:
            r = replace(r, bus_voltage=across(r.bus_voltage, new["bus"]))
        stood = stalled(r)
        if stood.any():
            r = bridged(r, stood)
            stood = binary_dilation(stood, iterations=1 + odd(SPEED_SPAN / r.interval) // 2)
        lost = stood | held(r)
        for cut in cut_off(r).values():
            lost |= binary_dilation(cut.any(axis=1))
        current, rows = without_spikes(r.phase_current)
        if len(rows):
            spiked = np.zeros(len(r.time), bool)
            spiked[rows] = True
            lost |= binary_dilation(spiked)
        counts, of_rotor = spacing(_of_new(r, "output", new)), spacing(r.rotor_angle)
        whole, step = adds_up(r), max(lattice_step(x) for x in r.phase_current.T)
        return cls(
            name, actuator, r.interval, r.phase_voltage, current, r.phase_current_end, r.rotor_speed,
            r.rotor_angle, r.output_position, r.commanded_position, r.bus_voltage, r.ambient_temperature, r.health,
            noise, lost, stood, float(r.known.get("rotor_angle", {}).get("zero_error", 0.0)),
            lattice_step(_of_new(r, "speed", new)),
            step, counts if counts > noise.position else 0.0, of_rotor if of_rotor > noise.angle else 0.0,
            whole, derived_phase([r]) if whole else None,
            (shares_of_noise([r]), shares_of_noise([r], end=True)) if step == 0.0 else (np.ones(3), np.ones(3)), new,
        )  # fmt: skip

    def __post_init__(self) -> None:
        theta, h = self.angle, self.interval
        self.size = len(theta)
        self.axis = AXIS
        self.time = (np.arange(self.size) + 0.5) * h
        self.before = np.concatenate([theta[:1], theta[:-1]])
        self.middle = 0.5 * (theta + self.before)
        self.half_sweep = 0.5 * (theta - self.before)
        self.rate = (theta - self.before) / h
        span = odd(SPEED_SPAN / h)
        self.speed = uniform_filter1d(self.rate, span, mode="nearest")
        self.calm = uniform_filter1d(theta, span, mode="nearest")
        self.calm_before = np.concatenate([self.calm[:1], self.calm[:-1]])
        # standard deviation of the angle's noise (rad), (sample,)
        self.angle_noise = np.hypot(self.noise.angle, self.noise.angle_timing * self.speed)
        self.direction = np.sign(self.speed)
        moving = np.abs(self.speed) > SLOW
        # dry friction is known where the rotor moves throughout, one way: a quick reversal has no slow sample
        self.moving = moving.copy()
        for beside in (1, -1):
            self.moving &= np.roll(moving, beside) & (np.roll(self.direction, beside) == self.direction)
        self.moving[0] = False
        # between its two directions a phase rests for a sixth of an electrical turn; its mean current over an interval
        # that may hold more is no measure of torque or power
        self.resolved = np.abs(self.half_sweep) * self.actuator.pole_pairs < np.pi / 6.0
        self.start = self._start_angle()
        self.turned = theta - self.start
        self.shaft = 0.5 * (theta + self.before - 2.0 * self.start) / self.actuator.gear_ratio
        slow = uniform_filter1d(self.rate, odd(3e-3 / h), mode="nearest")
        self.acceleration = np.gradient(slow, h)
        self.rows_from = self
        self.drawn_from = self
        # (phase, phase) of the currents' noise, in units of a sensor's variance
        self.current_covariance = _covariance(self.derived, self.shares[0])
        self.level = 0.5 * np.abs(self.current).sum(axis=1)
        step = np.abs(np.diff(self.level, append=self.level[-1:]))
        self.current_change = np.maximum(step, np.concatenate([step[:1], step[:-1]]))
        self.dT_measured = self.ambient - self.actuator.reference_temperature
        self.solved: dict[tuple, Any] = {}
        self._once: dict[tuple, Any] = {}
        # with their derivatives once a point is known
        self.dT: Any = self.dT_measured
        self.inertia_scale: Any = Dual(1.0)
        self.play: Any = Dual(self.actuator.backlash)
        self.load: Any = Dual(0.0)
        self.spring: Any = Dual(0.0)
        self.flexible = False  # whether these act on the motor through the shaft's torque alone
        self.ahead: Any = Dual(0.0)  # electrical rad, by which the recorded angle is

    def _start_angle(self) -> float:
        moved = np.flatnonzero(np.abs(self.angle - self.angle[0]) > REST)
        still = int(moved[0]) if len(moved) else self.size
        return float(np.mean(self.angle[: max(1, still - 1)]))

    def quiet(self) -> np.ndarray:
        """Angle turned from the start (rad), (sample,), averaged where the rotor stands still for long.

        What a play passes on of noise about a standstill would push a shaft behind it.
        """
        h = self.interval
        n = max(1, round(STANDS / h))
        there = np.pad(self.calm, n, mode="edge")
        known = 4.0 * self.noise.angle * np.sqrt(2.0 / odd(SPEED_SPAN / h))
        still = np.abs(there[2 * n :] - there[: -2 * n]) < known
        long = odd(AVERAGED_AT_REST / h)
        return np.where(
            uniform_filter1d(still.astype(float), long) > 1.0 - 0.5 / long,
            uniform_filter1d(self.turned, long, mode="nearest"), self.turned,
        )  # fmt: skip

    def spacing(self, channel: str) -> float:
        """Samples (mean) from one that is new on a channel to the next."""
        return 1.0 / float(np.mean(self.new[channel])) if channel in self.new else 1.0

    def once(self, key: tuple, compute: Callable[[], Any]) -> Any:
        """What does not depend on the point, computed at the first call with this key."""
        if key not in self._once:
            self._once[key] = compute()
        return self._once[key]

    def stretches(self) -> list[slice]:
        """The longest stretches in which a current in coarse steps is nowhere more than half a step from where it is
        elsewhere, as where one of two phases is a step on: over each the error of rounding changes evenly."""
        if self.current_step == 0.0:
            return []
        found, first, low, high = [], 0, np.inf, -np.inf
        for k, x in enumerate([*self.level.tolist(), np.inf]):
            if max(high, x) - min(low, x) > 0.51 * self.current_step:
                found.append(slice(first, k))
                first, low, high = k, x, x
            else:
                low, high = min(low, x), max(high, x)
        long = [s for s in found if s.stop - s.start >= STRETCH]
        return sorted(sorted(long, key=lambda s: s.start - s.stop)[:STRETCHES], key=lambda s: s.start)

    def disturbed(self, seed: int) -> "Signals":
        """A copy with a draw of the sensors' noise added once more; what is masked and along what rows lie stays."""
        rng = np.random.default_rng(seed)

        def more(x: np.ndarray, sigma: float | np.ndarray) -> np.ndarray:
            return x + sigma * rng.standard_normal(x.shape)

        def of_currents(x: np.ndarray, sigma: float, shares: np.ndarray) -> np.ndarray:
            drawn = more(np.zeros_like(x), sigma) * np.sqrt(shares)
            if self.derived is not None:
                drawn[:, self.derived] -= drawn.sum(axis=1)
            return x + (drawn - drawn.mean(axis=1, keepdims=True) if self.adds_up else drawn)

        def of_channel(name: str, x: np.ndarray, sigma: float) -> np.ndarray:
            drawn = more(np.zeros_like(x), sigma)
            return x + (across(drawn, self.new[name]) if name in self.new else drawn)

        s = self.noise
        out = self._changed(
            voltage=more(self.voltage, s.voltage), current=of_currents(self.current, s.current, self.shares[0]),
            current_end=None if self.current_end is None
            else of_currents(self.current_end, s.current_end, self.shares[1]),
            speed_recorded=of_channel("speed", self.speed_recorded, s.speed), angle=more(self.angle, self.angle_noise),
            output=of_channel("output", self.output, s.position),
            bus=None if self.bus is None else of_channel("bus", self.bus, s.bus_voltage),
        )  # fmt: skip
        out.drawn_from = self
        return out

    def less(self, channel: str, x: np.ndarray) -> "Signals":
        """A copy with (sample,) x taken off a channel: ``angle``, ``output``, all of ``voltage``, or a current."""
        if channel == "angle":
            out = self._changed(angle=self.angle - x)
            if self.drawn_from is not self:
                out.drawn_from = self.drawn_from.less(channel, x)
            return out
        if channel == "output":
            return self._changed(output=self.output - x)
        if channel == "voltage":
            return self._changed(voltage=self.voltage - np.asarray(x)[:, None])
        unit = np.eye(3)["abc".index(channel[-1])]
        end = None
        if self.current_end is not None:
            end = self.current_end - np.outer(0.5 * (x + np.append(x[1:], x[-1])), unit)
        return self._changed(current=self.current - np.outer(x, unit), current_end=end)

    def _changed(self, **signals: Any) -> "Signals":
        """A copy with other signals; what is masked and along what rows lie stays."""
        out = replace(self, **signals)
        out.moving, out.direction, out.start, out.rows_from = self.moving, self.direction, self.start, self.rows_from
        return out


def _new(recording: Recording) -> dict[str, np.ndarray]:
    """New samples by channel, of those that are slower than the recording."""
    values = {channel: getattr(recording, variable) for channel, variable in MAY_BE_SLOWER.items()}
    found = {channel: updates(x) for channel, x in values.items() if x is not None}
    return {channel: rows for channel, rows in found.items() if not rows.all()}


def _of_new(recording: Recording, channel: str, new: Mapping[str, np.ndarray]) -> np.ndarray:
    """The new samples of a channel."""
    values = getattr(recording, MAY_BE_SLOWER[channel])
    return values[new[channel]] if channel in new else values


def _covariance(derived: int | None, shares: np.ndarray) -> np.ndarray:
    """(phase, phase) covariance of the noise of currents that add up to nothing, in units of a sensor's variance; of
    sensors with ``shares`` (phase,) of it."""
    if derived is None:
        less_mean = np.eye(3) - 1.0 / 3.0
        return (less_mean * shares) @ less_mean
    made = np.delete(np.eye(3), derived, axis=1)
    made[derived] = -1.0
    return made @ made.T


def passing_time(actuator: ActuatorParameters, current: np.ndarray) -> np.ndarray:
    """Time (s), about, in which a current (A) passes from phase to phase: the bus voltage over both inductances."""
    return 2.0 * actuator.inductance * current / actuator.bus_voltage


def odd(samples: float) -> int:
    """Length of a centred average: an even one would be half a sample late."""
    return 2 * int(0.5 * samples) + 1


def estimated_noise(recordings: Sequence[Recording], nominal: SensorNoise) -> SensorNoise:
    """Noise of the channels that regressors are made of, from differences in which the motion hardly shows; what every
    recording states is taken as it says.

    The angle's is taken of the most finely sampled recordings, the currents' of the sum of the phases, whatever offset
    each of them has, or of phases that are off, where that is less or the sum is nothing by construction; a channel
    that reads the same throughout while its phase is off takes small currents for none, and tells nothing. Where a
    channel comes in coarse steps most differences of what changes slowly, or evenly, are none, and its noise is that of
    rounding at least (Widrow and Kollar 2008, Quantization Noise, chapter 1).
    """

    def robust(parts: list[np.ndarray], step: float = 0.0) -> float:
        x = np.concatenate(parts) if parts else np.zeros(0)
        if len(x) < 50:
            return np.inf
        x = x - np.median(x)
        scale = float(np.median(np.abs(x)) / 0.6745)
        if step > 0.0:  # most of what lies on a lattice may be one value
            return float(np.sqrt(np.mean(x[np.abs(x) < 4.0 * max(scale, step)] ** 2)))
        return scale

    finest = min(r.interval for r in recordings)
    fine = [r for r in recordings if r.interval < 1.5 * finest]
    timing, beside = angle_timing(fine)
    angle = min(robust([np.diff(r.rotor_angle, n) for r in fine]) / np.sqrt(comb(2 * n, n)) for n in (3, 4))
    angle = beside if timing > 0.0 else angle
    step = max(lattice_step(x) for r in recordings for x in r.phase_current.T)
    news = [_new(r) for r in recordings]
    outputs = [_of_new(r, "output", new) for r, new in zip(recordings, news, strict=True)]
    quick = [(r, new) for r, new in zip(recordings, news, strict=True) if r.interval < 1.5 * finest]
    rounding = {
        "current": step / np.sqrt(12.0), "angle": min(spacing(r.rotor_angle) for r in recordings) / np.sqrt(12.0),
        "position": min(spacing(x) for x in outputs) / np.sqrt(12.0),
    }  # fmt: skip
    summed = [r for r in recordings if not adds_up(r)]
    currents = [np.diff(r.phase_current.sum(axis=1), 2) for r in summed]
    ends = [np.diff(r.phase_current_end.sum(axis=1), 2) for r in summed if r.phase_current_end is not None]
    current, current_end = robust(currents) / np.sqrt(18.0), robust(ends, step) / np.sqrt(18.0)
    if step == 0.0 or not summed:
        # where one channel lags behind the others their sum has of the ripple; where a phase is off there is none
        at_rest = summed or recordings
        current, current_end = (
            min(of_sum, rest) if rest > 0.0 or not summed else of_sum
            for of_sum, rest in ((current, resting_noise(at_rest)), (current_end, resting_noise(at_rest, end=True)))
        )
    output, speed = (
        robust([np.diff(_of_new(r, channel, new), 3) for r, new in quick]) / np.sqrt(20.0)
        for channel in ("output", "speed")
    )
    limits = {
        "angle": angle, "current": current, "current_end": current_end, "position": output,
    }  # fmt: skip
    if lattice_step(_of_new(fine[0], "speed", quick[0][1])) == 0.0:
        limits["speed"] = speed
    return replace(
        nominal,
        **{
            k: float(max(v, QUIETEST * getattr(nominal, k), rounding.get(k, 0.0)))
            for k, v in limits.items()
            if np.isfinite(v)
        }
        | _stated(recordings),
        angle_timing=timing,
    )


def angle_timing(recordings: Sequence[Recording]) -> tuple[float, float]:
    """Standard deviations of the instants at which the angle is sampled (s), 0 where it shows none, and of the angle's
    noise beside it (rad).

    An error of the angle is in its rate in one interval and, with the other sign, in the next, where no error of the
    recorded speed is: by the product of both, less the speed, in proportion to the square of the speed. By weighted
    least squares; there is none where Schwarz's criterion says so, by the odds of a described form before the data.
    """
    of, squares = [], []
    for r in (calm_motion(r) for r in recordings):
        rate = np.diff(r.rotor_angle) / r.interval
        beyond = rate - r.rotor_speed[1:]
        beyond = r.interval * (beyond - uniform_filter1d(beyond, AROUND, mode="nearest"))
        of.append(-beyond[1:] * beyond[:-1])
        squares.append(uniform_filter1d(rate, AROUND, mode="nearest")[1:] ** 2)
    y, x = np.concatenate(of), np.concatenate(squares)
    columns, size = np.column_stack([np.ones(len(x)), x]), np.ones(len(x))
    if np.ptp(x) == 0.0 or not y.any():
        return 0.0, 0.0
    for _ in range(4):
        white = columns / size[:, None]
        inverse = np.linalg.inv(white.T @ white)
        found = inverse @ (white.T @ (y / size))
        size = np.maximum(columns @ np.maximum(found, 0.0), 1e-3 * float(np.mean(np.abs(y))))
    spread = float(np.sqrt(np.mean(((y - columns @ found) / size) ** 2) * inverse[1, 1]))
    if found[1] <= 0.0 or 0.5 * (found[1] / spread) ** 2 + PRIOR < 0.5 * np.log(len(y)):
        return 0.0, 0.0
    return float(np.sqrt(found[1])), float(np.sqrt(max(found[0], 0.0)))


def _stated(recordings: Sequence[Recording]) -> dict[str, float]:
    """Noise by field of ``SensorNoise`` that every recording states: the root of the mean square."""
    out = {}
    for variable, channel in CHANNEL.items():
        said = [r.known.get(variable, {}).get("noise") for r in recordings]
        if None not in said:
            out[channel] = float(np.sqrt(np.mean(np.square(np.array(said, float)))))
    return out

"""Faults of the measuring chain, as terms on the recorded signals: lag between channels, drift, crosstalk, curves.

A channel that lags records (1 - lag) x[n] + lag x[n - 1] of a true signal x. One that smooths by a memory m, as a
logger may, records y with y[n] + m (y[n] - y[n - 1]) = x[n]. One behind an analogue first-order filter of time constant
T has y + T dy/dt = x, of which the mean over an interval is exact where the filtered signal at its ends is recorded.
One behind a filter of the second order, or that averages samples, loses what cannot be had back: such a signal is
predicted, not undone.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter1d

from ..actuator.grammar import LOGGERS
from ..actuator.parameters import ActuatorParameters
from ..delays import LEAST, ahead, averaged, averaging, butterworth, filtered, response, smoothed
from ..switches import direction, turning
from .dual import Dual
from .point import Point, effect_name
from .signals import AROUND, Signals
from .terms import with_hook

#: logger -> channels that it may have of its own, with a clock that is not that of the rest
CLOCKS = {channel: (channel,) for channel in ("angle", "output", "speed")} | LOGGERS
OF_ONE_PHASE = ("late", "early")  # ways in which one phase's channel of voltage or current may lag by itself
#: way of coming late that is told by its delay -> what it makes of a signal
OPERATES = {"smoothed": smoothed, "filtered": filtered, "butterworth": butterworth, "averaged": averaged}
STEP = 1e-4  # interval, of a difference by them
#: beginnings of the names of a channel's gain, less one, and of what it grows by along a recording
GAIN_NAMES = ("gain", "gain_drift")
#: quantities that have offsets
DRIFTS = {"current": "A", "voltage": "V", "speed": "rad/s", "angle": "rad", "output": "rad", "bus_voltage": "V"}
RATE = "rate"  # of a channel's offset, that grows with time in all recordings alike


def delayed(x: np.ndarray) -> np.ndarray:
    """Change of a signal that is one interval late: the interval before less this one."""
    out = np.empty_like(x)
    out[1:] = x[:-1] - x[1:]
    out[0] = 0.0
    return out


def advanced(x: np.ndarray) -> np.ndarray:
    """Change of a signal that is one interval early."""
    out = np.empty_like(x)
    out[:-1] = x[1:] - x[:-1]
    out[-1] = 0.0
    return out


class Late(NamedTuple):
    """Intervals by which a channel comes late and early, is smoothed, filtered, filtered by the second order and
    averaged."""

    late: Dual
    early: Dual
    smooth: Dual
    constant: Dual
    second: Dual
    average: Dual


def _late(p: Point, channel: str, phase: str) -> Late:
    """With what a phase has of its own."""

    def of(way: str) -> Dual:
        all_alike = p(f"lag.{channel}_{way}")
        own = p(f"lag.{channel}_{phase}_{way}") if phase and way in OF_ONE_PHASE else Dual(0.0)
        return all_alike + own if own.slopes or own.value else all_alike

    return Late(of("late"), of("early"), *map(of, OPERATES))


def recorded_late(p: Point, channel: str, x: Dual, size: int, phase: str = "") -> Dual:
    """What is recorded of a true signal on a channel that lags (in intervals, either sign), smooths, filters or
    averages."""
    late, early, *others = _late(p, channel, phase)
    out = x
    if late.slopes or late.value:
        out = out + late * _changed(x, delayed, late, size)
    if early.slopes or early.value:
        out = out + early * _changed(x, advanced, early, size)
    for amount, operate in zip(others, OPERATES.values(), strict=True):
        if amount.slopes or amount.value > LEAST:
            out = through(out, operate, amount, size)
    skew = p(f"skew.{channel}@{p.recording}")
    if skew.slopes or skew.value:
        out = out + skew * (0.5 * (delayed(np.asarray(x.value)) - advanced(np.asarray(x.value))))
    late = behind(p, channel, size)
    if late.slopes or np.any(late.value):
        out = out + as_before(np.asarray(x.value), late, channel)
    return out


def clock_names(of: str, recording: str) -> tuple[str, str]:
    """Parameters of a logger of ``CLOCKS``: by how many intervals it is late at a recording's start, and by which share
    its clock is slow."""
    return f"clock.{of}@{recording}", f"clock_rate.{of}"


def behind(p: Point, channel: str, size: int) -> Dual:
    """(sample,) intervals by which a channel's logger is late."""
    out = Dual(0.0)
    for of in (of for of, channels in CLOCKS.items() if channel in channels):
        start, rate = (p(n) for n in clock_names(of, p.recording))
        if start.slopes or start.value:
            out = out + start * np.ones(size)
        if rate.slopes or rate.value:
            out = out + rate * np.arange(1.0, size + 1.0)
    return out


def as_before(x: np.ndarray, late: Dual, channel: str) -> Dual:
    """What a signal changes by where it is as it was some intervals before, to the second order; a speed, which is
    noisy, to the first."""
    if channel == "speed":
        calm = uniform_filter1d(x, AROUND, mode="nearest")
        return late * (0.5 * (delayed(calm) - advanced(calm)))
    back, ahead_of = delayed(x), advanced(x)
    return late * (0.5 * (back - ahead_of)) + late * late * (0.5 * (back + ahead_of))


def response_of(p: Point, channel: str) -> np.ndarray:
    """(interval,) what a channel that lags, filters or averages records of one interval of one."""
    late, early, _, constant, second, average = (float(x.value) for x in _late(p, channel, ""))
    out = np.convolve(np.convolve([1.0 - late, late], [early, 1.0 - early]), averaging(average))
    for through_it, delay in ((filtered, constant), (butterworth, second)):
        if delay > LEAST:
            out = np.convolve(out, response(through_it, delay))
    return out


def through(x: Dual, operate: Callable[[np.ndarray, float], np.ndarray], amount: Dual, size: int) -> Dual:
    """A signal through a filter, with its derivative by the filter's constant (in intervals)."""
    at = float(amount.value)
    if at <= LEAST:
        return x + amount.through(0.0, delayed(np.asarray(x.value)))
    plain = np.asarray(x.value)
    out = x.linear(lambda z: operate(z, at), size)
    if amount.slopes:
        by_constant = (operate(plain, at + STEP) - np.asarray(out.value)) / STEP
        out = out + amount.through(0.0, by_constant)
    return out


def _changed(x: Dual, operate: Callable[[np.ndarray], np.ndarray], lag: Dual, size: int) -> Dual:
    """``x.linear``, without the derivatives where these are to be multiplied by a lag of zero."""
    return x.linear(operate, size) if lag.value else Dual(x.value).linear(operate, size)


def late_by(p: Point, channel: str) -> Dual:
    """By how many intervals what changes slowly is recorded late on a channel that lags, smooths, filters or
    averages."""
    late, early, *others = _late(p, channel, "")
    return late - early + sum(others, Dual(0.0))


def undone(p: Point, channel: str, x: np.ndarray, rate: np.ndarray, phase: str = "") -> Dual:
    """The true signal from one recorded on a channel that lags, smooths or filters; from one that averages or
    has a filter of the second order, on time.

    ``rate``: change of the recorded signal over an interval, of what is a mean over it from its start to its end.
    """
    late, early, smooth, *others = _late(p, channel, phase)
    out = Dual(x)
    if late.slopes or late.value > LEAST:
        out = out + _ahead(x, late)
    if early.slopes or early.value > LEAST:
        out = out + _ahead(x[::-1], early).linear(lambda y: y[::-1], len(x))
    if smooth.slopes or smooth.value:
        out = out - smooth * delayed(x)
    for delay in others:
        if delay.slopes or delay.value:
            out = out + delay * rate
    skew = p(f"skew.{channel}@{p.recording}")
    if skew.slopes or skew.value:
        out = out + skew * (0.5 * (advanced(x) - delayed(x)))
    return out


def _ahead(x: np.ndarray, lag: Dual) -> Dual:
    """What a signal changes by that is taken from a channel which lags.

    At none the derivative is the change at a lag of one, which is exact: from there on a small one is found as well.
    """
    at = float(lag.value)
    if at <= LEAST:
        return lag.through(0.0, advanced(x))
    there = ahead(x, at)
    return lag.through(there - x, (ahead(x, at + STEP) - there) / STEP if lag.slopes else 0.0)


def rates(mean: np.ndarray, at_end: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Change of a signal over an interval, (sample,): from its start to its end, and at the rate it has at the end, of
    the parabolas that have the means and ends recorded on both sides of it; of the means alone where there are no
    ends."""
    if at_end is None:
        return 0.5 * (advanced(mean) - delayed(mean)), advanced(mean)
    there = 3.0 * advanced(mean)
    there[1:-1] -= at_end[2:] - at_end[:-2]
    return -delayed(at_end), there


def full_range(actuator: ActuatorParameters, channel: str) -> float:
    """Voltage (V) or current (A) at which the bend of a channel's curve is told."""
    return 0.5 * actuator.bus_voltage if channel == "voltage" else actuator.current_limit


#: parameter of a channel's curve, by the beginning of its name in the equations
CURVES = {"curve": "bend", "halves": "halves", "dead": "dead"}


def bent(p: Point, channel: str, phase: str, x: Dual | np.ndarray, actuator: ActuatorParameters) -> Dual:
    """What a signal loses on a channel whose curve is bent: a share of it at full range, which goes with the cube; by
    another gain in one direction a share of its size; by a dead band a current in its direction.

    All phases have it alike, or one its own.
    """
    plain = np.asarray(x.value if isinstance(x, Dual) else x)
    out = Dual(0.0)
    for kind in CURVES:
        amounts = [a for c in (channel, f"{channel}_{phase}") if (a := p(f"{kind}.{c}")).slopes or a.value]
        if amounts:
            turn = p("dead.turn")
            lost: Dual | np.ndarray = lost_by(kind, plain, full_range(actuator, channel), float(turn.value))
            if kind == "dead":
                lost = turn.through(np.asarray(lost), turning(plain, float(turn.value)))
            for amount in amounts:
                out = out + amount * lost
    return out


def lost_by(kind: str, x: np.ndarray, full: float, turn: float) -> np.ndarray:
    """What a signal loses by one of ``CURVES`` of amount one, from its size, its range and where it turns about."""
    if kind == "curve":
        return x * np.square(x / full)
    return -np.abs(x) if kind == "halves" else direction(x, turn)


def picked_up(p: Point, phase: str, voltage: np.ndarray | float) -> Dual:
    """What a current's channel picks up (A) of its phase's voltage (V), as an amplifier does that rejects little of
    what both its inputs have in common: all phases alike, or one its own."""
    out = Dual(0.0)
    for of in ("current", f"current_{phase}"):
        share = p(f"pickup.{of}")
        if share.slopes or share.value:
            out = out + share * voltage
    return out


def dropped(p: Point, phase: str, current: np.ndarray) -> Dual:
    """What a voltage (V) of duty cycles has too much: it knows nothing of the drop of the switches and of their dead
    time, which goes with the current's direction.

    All phases have it alike, or one its own.
    """
    out, turn = Dual(0.0), p("drop.turn")
    at = float(turn.value)
    for name in ("drop.voltage", f"drop.voltage_{phase}"):
        drop = p(name)
        if drop.slopes or drop.value:
            out = out + drop * turn.through(direction(current, at), turning(current, at))
    return out


def gain(p: Point, j: int) -> Dual:
    """True over recorded change of the current of phase j."""
    out = Dual(1.0)
    for m in with_hook("current"):
        of = p.of(effect_name(m))
        out = out * (m.current(of, j, Dual(1.0)) - m.current(of, j, Dual(0.0)))
    return out


def drifted(p: Point, quantity: str, phase: str, rec: Signals) -> Dual | float:
    """(sample,) what a channel has too much: an offset, of all or of the recording's own, what grows along it, and what
    grows with time in all of them alike."""
    out: Dual | float = 0.0
    rate = p(f"{RATE}_{quantity}.{phase}")
    if rate.slopes or rate.value:
        out = rate * rec.time
    always, offset, drift = (p(f"{n}_{quantity}.{phase}{at}") for n, at in drifting(rec.name))
    if drift.slopes or drift.value:
        out = out + drift * (rec.time / rec.time[-1])
    for level in (always, offset):
        if level.slopes or level.value:
            out = out + level * np.ones(rec.size)
    return out


def drifting(recording: str) -> tuple[tuple[str, str], ...]:
    """Before and after the names of an offset of all recordings, of one recording's own, and of what grows along it."""
    return ("offset", ""), ("offset", f"@{recording}"), ("drift", f"@{recording}")


def gain_of_its_own(p: Point, quantity: str, phase: str, rec: Signals) -> Dual | float:
    """Factor between a channel's recorded and true signal, of the recording's own, that may grow along it."""
    out: Dual | float = 1.0
    for of in ("all", phase):
        gain, growth = (p(f"{n}_{quantity}.{of}@{rec.name}") for n in GAIN_NAMES)
        if gain.slopes or gain.value:
            out = out + gain
        if growth.slopes or growth.value:
            out = out + growth * (rec.time / rec.time[-1])
    return out


class Currents(NamedTuple):
    """Currents (A) by phase, (sample,) each: true means and those at the intervals' ends, means that the sensors show,
    as the regulator sees them, and what the recorded means are beyond those on time where all are late alike."""

    mean: list[Dual]
    end: list[Dual]
    shown: list[Dual]
    lag: list[Dual]


def currents(rec: Signals, p: Point, rounding: Dual | None) -> Currents:
    """The currents from the recorded ones: less lag, curve, crosstalk, pickup and drift of the recorder, then less
    offset and gain of the sensors; ``rounding``: what the size of the means has too much (A), (sample,)."""
    means: list[Dual] = []
    ends: list[Dual] = []
    shown: list[Dual] = []
    lag: list[Dual] = []
    at_end = rec.current_end
    if at_end is None:
        following = np.vstack([rec.current[1:], rec.current[-1:]])
        at_end = 0.5 * (rec.current + following)
    rate = [rates(rec.current[:, j], None if rec.current_end is None else rec.current_end[:, j]) for j in range(3)]
    for n, (source, out) in enumerate(((rec.current, means), (at_end, ends))):
        for j in range(3):
            on_time = undone(p, "current", source[:, j], rate[j][n], "abc"[j])
            i = on_time + bent(p, "current", "abc"[j], source[:, j], rec.actuator)
            i = i - drifted(p, "current", "abc"[j], rec) - picked_up(p, "abc"[j], rec.voltage[:, j])
            if out is means and rounding is not None:
                i = i - rounding * np.sign(rec.rows_from.current[:, j])
            for q in range(3):
                if q != j:
                    i = i - p(f"crosstalk_current.{'abc'[j]}{'abc'[q]}") * source[:, q]
            i = i / gain_of_its_own(p, "current", "abc"[j], rec)
            if out is means:
                shown.append(i)
                lag.append(source[:, j] - undone(p, "current", source[:, j], rate[j][n]))
            for m in with_hook("current"):
                i = m.current(p.of(effect_name(m)), j, i)
            out.append(i)
        if rec.derived is not None:
            for of in (out, shown) if out is means else (out,):
                of[rec.derived] = -sum((of[j] for j in range(3) if j != rec.derived), Dual(0.0))
        # the true ones add up to nothing: what the three say together is less noisy than each alone
        mean = (out[0] + out[1] + out[2]) * (1.0 / 3.0)
        for j in range(3):
            out[j] = out[j] - mean
    return Currents(means, ends, shown, lag)

"""The recorded speed against the rate of the recorded angle."""

import numpy as np
from scipy.ndimage import uniform_filter1d

from .acquisition import drifted, recorded_late, response_of
from .dual import Dual
from .point import State, effect_name
from .signals import Signals, odd
from .terms import with_hook

BESIDE = 1e-2  # s, before and after a sample, between which the speed must sweep over what noise reaches
REACHES = 3.0  # standard deviations, that the noise of a speed reaches to either side
SENSOR = "speed_sensor"  # channel of what comes late before the controller takes it
LITTLE = 0.01  # of the variance: covariances below it do not count
SPECTRUM = 1024  # points of its spectrum


def residual(state: State) -> Dual:
    """Recorded less predicted speed (rad/s).

    Its derivatives are taken of the smoothed speed, whose noise is nearly independent of the residual's.
    """
    rec = state.rec
    exact = recorded_late(state.p, "speed", seen_speed(state, Dual(rec.rate)), rec.size)
    seen = Dual(exact.value, predicted(state).slopes) + drifted(state.p, "speed", "all", rec)
    return rec.speed_recorded - seen


def predicted(state: State) -> Dual:
    """Recorded speed as the smoothed speed predicts it (rad/s)."""
    return recorded_late(state.p, "speed", seen_speed(state, Dual(state.rec.speed)), state.rec.size)


def seen_speed(state: State, w: Dual) -> Dual:
    """What the sensor makes of a true speed (rad/s)."""
    for m in with_hook("speed"):
        w = m.speed(state.p.of(effect_name(m)), state.rec, w)
    return recorded_late(state.p, SENSOR, w, state.rec.size)


def seen_rate(state: State, x: np.ndarray) -> np.ndarray:
    """(sample,) what the sensor, which is linear, makes (rad/s) of the rate of a part x (rad) of the angle."""
    rate = np.diff(x, prepend=x[:1]) / state.rec.interval
    return np.asarray(recorded_late(state.p, "speed", seen_speed(state, Dual(rate)), state.rec.size).value)


def noise_bands(state: State) -> list[np.ndarray]:
    """Diagonals of the noise's covariance ((rad/s)2): what the sensor makes of the angle's noise, too."""
    rec = state.rec
    of_angle = np.array([1.0, -1.0])
    for m in with_hook("response"):
        of_angle = np.convolve(of_angle, m.response(state.p.of(effect_name(m)), rec))
    for channel in ("speed", SENSOR):
        of_angle = np.convolve(of_angle, response_of(state.p, channel))
    shares = np.correlate(of_angle, of_angle, "full")[len(of_angle) - 1 :]
    angle = (rec.angle_noise / rec.interval) ** 2
    longer = np.pad(angle, (len(of_angle) - 1, 0), mode="edge")
    rounded = (0.5 * rec.speed_step) ** 2  # next to a change
    white = rec.noise.speed**2 + rounded
    largest = float(angle.max())
    together = np.flatnonzero(largest * np.abs(shares) > LITTLE * (white + largest * shares[0]))
    last = int(together[-1]) if len(together) else 0
    bands = [
        np.convolve(longer, of_angle[: len(of_angle) - m] * of_angle[m:], "full")[len(of_angle) - 1 :][: rec.size - m]
        for m in range(last + 1)
    ]
    # without those left out the spectrum may be below zero somewhere, and the rest no covariance: of a speed that is a
    # filtered rate of the angle and has hardly any noise of its own
    spectrum = 2.0 * np.fft.rfft(shares[: last + 1], SPECTRUM).real - shares[0]
    white += max(0.0, -float(spectrum.min())) * largest
    return [white + bands[0], *bands[1:]]


def usable(state: State) -> np.ndarray:
    """(sample,) all but the first and last, where the speed lies on a lattice those next to a change: in between, what
    rounding leaves is the same again and again, and on both sides of a change together it is nothing, where the speed
    sweeps over it. Where it rests beside it, what noise rounds across comes from one side alone."""
    rec = state.rec
    out = np.ones(rec.size, bool)
    if rec.speed_step > 0.0:
        new = np.flatnonzero(rec.new.get("speed", out))
        changes = np.diff(rec.speed_recorded[new]) != 0.0
        out[:] = False
        out[new[1:-1]] = changes[1:] | changes[:-1]
        out &= rec.once(("sensor_speed", "sweeps"), lambda: _sweeps(rec))
    out[0] = out[-1] = False
    return out


def _sweeps(rec: Signals) -> np.ndarray:
    """(sample,) whether the speed sweeps over what its noise reaches from ``BESIDE`` before to as long after."""
    reach = odd(BESIDE / rec.interval)
    calm = np.pad(uniform_filter1d(rec.rate, reach, mode="nearest"), reach, mode="edge")
    return np.abs(calm[2 * reach :] - calm[: -2 * reach]) > 2.0 * REACHES * rec.noise.speed

"""Disturbances of the measuring chain: they change what is recorded and nothing else.

As with the catalogue's own effects of sensing, the electrical equation of the phase, which the channel stands in, is as
right a place as the channel.
"""

import numpy as np

from .disturbance import Acting, Register, Signals, letter

MEASURING = Register()
TWO_PI = 2.0 * np.pi


def _both(signals: Signals) -> list[str]:
    """The current's mean and, where it is recorded, its value at the end: one channel has both."""
    return [name for name in ("phase_current", "phase_current_end") if name in signals]


@MEASURING.inside("lag", "time")
def lag_voltage(size: float, rng: np.random.Generator) -> Acting:
    """The voltages are recorded up to one sample late."""

    def change(signals: Signals, _) -> None:
        v = signals["phase_voltage"]
        signals["phase_voltage"] = (1.0 - size) * v + size * np.concatenate([v[:1], v[:-1]])

    return Acting(("sensor_voltage", "sensor_current", "electrical"), {"lag": (size, "samples")}, change)


@MEASURING.inside("spikes", "time", at_sight=True)
def spikes_current(size: float, rng: np.random.Generator) -> Acting:
    """Single samples of one current are far off."""
    (j, phase), rate, level = letter(rng), 0.01 * size, 2.0

    def change(signals: Signals, own: np.random.Generator) -> None:
        current = signals["phase_current"]
        hit = own.choice(len(current), max(3, round(rate * len(current))), replace=False)
        current[hit, j] += own.normal(0.0, level, len(hit))

    return Acting(("sensor_current", f"electrical_{phase}"), {"share": (rate, "1")}, change)


@MEASURING.inside("held", "time", at_sight=True)
def held_current(size: float, rng: np.random.Generator) -> Acting:
    """Samples of the currents repeat the one before."""
    share = 0.005 + 0.045 * size

    def change(signals: Signals, own: np.random.Generator) -> None:
        current = signals["phase_current"]
        for k in np.sort(own.choice(np.arange(1, len(current)), max(4, round(share * len(current))), replace=False)):
            current[k] = current[k - 1]

    return Acting(("sensor_current", "electrical"), {"share": (share, "1")}, change)


@MEASURING.inside("adc_step", "current", "time", at_sight=True)
def steps_current(size: float, rng: np.random.Generator) -> Acting:
    """The current's converter has coarse steps."""
    step = 0.02 + 0.08 * size

    def change(signals: Signals, _) -> None:
        for name in _both(signals):
            signals[name] = step * np.round(signals[name] / step)

    return Acting(("sensor_current", "electrical"), {"step": (step, "A")}, change)


@MEASURING.inside("clipping", "current", "time", at_sight=True)
def clipping_current(size: float, rng: np.random.Generator) -> Acting:
    """The current's mean is cut off above a level."""
    j, phase = letter(rng)
    share = 1.0 - 0.4 * size  # of the largest current of the recording

    def change(signals: Signals, _) -> None:
        current = signals["phase_current"]
        level = share * np.max(np.abs(current[:, j]))
        current[:, j] = np.clip(current[:, j], -level, level)

    return Acting(("sensor_current", f"electrical_{phase}"), {"share": (share, "1")}, change)


@MEASURING.inside("drift", "time")
def drift_current(size: float, rng: np.random.Generator) -> Acting:
    """The offset of one current drifts with time."""
    (j, phase), slope = letter(rng), 0.2 * size

    def change(signals: Signals, _) -> None:
        for name in _both(signals):
            signals[name][:, j] += slope * signals["time"]

    return Acting(("sensor_current", f"electrical_{phase}"), {"slope": (slope, "A/s")}, change)


@MEASURING.inside("drift", "time")
def warm_up_voltage(size: float, rng: np.random.Generator) -> Acting:
    """The offset of one voltage goes to another value as its amplifier warms up."""
    (j, phase), jump, constant = letter(rng), 0.3 * size, float(rng.uniform(0.05, 0.3))

    def change(signals: Signals, _) -> None:
        signals["phase_voltage"][:, j] += jump * (1.0 - np.exp(-signals["time"] / constant))

    return Acting(
        ("sensor_voltage", f"electrical_{phase}"), {"jump": (jump, "V"), "time_constant": (constant, "s")}, change
    )


@MEASURING.inside("crosstalk", "current", "time")
def crosstalk_current(size: float, rng: np.random.Generator) -> Acting:
    """One current shows in another's channel."""
    to, source = (int(x) for x in rng.choice(3, 2, replace=False))
    gain = 0.05 * size

    def change(signals: Signals, _) -> None:
        for name in _both(signals):
            signals[name][:, to] += gain * signals[name][:, source]

    return Acting(("sensor_current", f"electrical_{'abc'[to]}"), {"gain": (gain, "1")}, change)


@MEASURING.inside("frequency", "time")
def mains_current(size: float, rng: np.random.Generator) -> Acting:
    """The currents pick the mains up together."""
    amplitude, frequency = 0.1 * size, float(rng.choice((50.0, 60.0)))

    def change(signals: Signals, own: np.random.Generator) -> None:
        wave = amplitude * np.sin(TWO_PI * (frequency * signals["time"] + own.random()))
        for name in _both(signals):
            signals[name] += wave[:, None]

    return Acting(
        ("sensor_current", "electrical"), {"frequency": (frequency, "Hz"), "amplitude": (amplitude, "A")}, change
    )


@MEASURING.inside("frequency", "time")
def pickup_voltage(size: float, rng: np.random.Generator) -> Acting:
    """One voltage picks up a fixed frequency."""
    (j, phase), amplitude, frequency = letter(rng), 0.3 * size, float(rng.uniform(40.0, 400.0))

    def change(signals: Signals, own: np.random.Generator) -> None:
        wave = amplitude * np.sin(TWO_PI * (frequency * signals["time"] + own.random()))
        signals["phase_voltage"][:, j] += wave

    found = {"frequency": (frequency, "Hz"), "amplitude": (amplitude, "V")}
    return Acting(("sensor_voltage", f"electrical_{phase}"), found, change)


@MEASURING.inside("sensor_curve", "current", "time")
def bent_voltage(size: float, rng: np.random.Generator) -> Acting:
    """The voltage channels are bent: a cubic part of their range."""
    bend = 0.01 * size

    def change(signals: Signals, _) -> None:
        v = signals["phase_voltage"]
        signals["phase_voltage"] = v * (1.0 - bend * (v / 24.0) ** 2)

    return Acting(("sensor_voltage", "electrical"), {"bend": (bend, "1")}, change)


@MEASURING.inside("order", "order", "rotor_angle")
def order_angle(size: float, rng: np.random.Generator) -> Acting:
    """The recorded rotor angle is off by a wave once per turn, as with a disc out of centre."""
    amplitude, phase = 0.01 * size, float(rng.uniform(0.0, TWO_PI))

    def change(signals: Signals, _) -> None:
        angle = signals["rotor_angle"]
        signals["rotor_angle"] = angle + amplitude * np.cos(angle + phase)

    return Acting(("sensor_angle",), {"order": (1.0, "1"), "amplitude": (amplitude, "rad")}, change)


@MEASURING.outside("time")
def wander_current(size: float, rng: np.random.Generator) -> Acting:
    """The offset of one current walks at random."""
    (j, phase), level = letter(rng), 0.1 * size

    def change(signals: Signals, own: np.random.Generator) -> None:
        walk = np.cumsum(own.standard_normal(len(signals["time"])))
        for name in _both(signals):
            signals[name][:, j] += level * walk / np.sqrt(len(walk))

    return Acting(("sensor_current", f"electrical_{phase}"), {"level": (level, "A")}, change)


@MEASURING.outside("time", "current")
def hum_voltage(size: float, rng: np.random.Generator) -> Acting:
    """A hum whose strength follows the current lies on one voltage."""
    (j, phase), gain, frequency = letter(rng), 0.1 * size, float(rng.uniform(80.0, 400.0))

    def change(signals: Signals, own: np.random.Generator) -> None:
        wave = np.sin(TWO_PI * (frequency * signals["time"] + own.random()))
        signals["phase_voltage"][:, j] += gain * np.abs(signals["phase_current"][:, j]) * wave

    return Acting(("sensor_voltage", f"electrical_{phase}"), {"gain": (gain, "ohm")}, change)


@MEASURING.outside("time", "current")
def flicker_current(size: float, rng: np.random.Generator) -> Acting:
    """The gain of one current drops now and then, as with a loose contact in its channel."""
    (j, phase), drop = letter(rng), 0.1 * size

    def change(signals: Signals, own: np.random.Generator) -> None:
        loose = np.zeros(len(signals["time"]))
        for start in own.uniform(0.0, signals["time"][-1], 6):
            loose[(signals["time"] > start) & (signals["time"] < start + own.exponential(0.02))] = 1.0
        for name in _both(signals):
            signals[name][:, j] *= 1.0 - drop * loose

    return Acting(("sensor_current", f"electrical_{phase}"), {"drop": (drop, "1")}, change)

"""Disturbances that act in the physics: torques, a resistance, a back-EMF. The loops react to them."""

from collections.abc import Sequence

import numpy as np

from ..actuator.unlisted import SOURCES, TABLE_STEP, term
from .disturbance import Acting, Register, letter

ACTING = Register()
TWO_PI = 2.0 * np.pi
SPARE = 0.05  # s that a table is longer than its recording


def _torque(shape: str, place: str = "torque", **parameters: float):
    """What gives one and the same torque, or one against the motion, in every recording."""
    row = term(place, shape, **parameters)

    def terms(_, __) -> tuple[Sequence[np.ndarray], None]:
        return [row], None

    return terms


@ACTING.inside("order", "order", "rotor_angle")
def once_per_turn(size: float, rng: np.random.Generator) -> Acting:
    """A torque once per turn of the rotor, as of a bent shaft."""
    amplitude = 0.02 * size
    terms = _torque("order", amplitude=amplitude, order=1.0, phase=float(rng.uniform(0.0, TWO_PI)))
    return Acting(("torque",), {"order": (1.0, "1"), "amplitude": (amplitude, "N m")}, terms=terms)


@ACTING.inside("order", "order", "rotor_angle")
def bearing_order(size: float, rng: np.random.Generator) -> Acting:
    """A torque at an order of the rotor that is no whole number, as of a damaged bearing."""
    amplitude, order = 0.02 * size, float(np.floor(rng.uniform(2.0, 9.0)) + rng.uniform(0.15, 0.85))
    terms = _torque("order", amplitude=amplitude, order=order, phase=float(rng.uniform(0.0, TWO_PI)))
    return Acting(("torque",), {"order": (order, "1"), "amplitude": (amplitude, "N m")}, terms=terms)


@ACTING.inside("frequency", "time")
def fixed_frequency(size: float, rng: np.random.Generator) -> Acting:
    """A torque of a fixed frequency, as of another machine on the same frame."""
    amplitude, frequency = 0.02 * size, float(rng.uniform(8.0, 60.0))

    def terms(_, own: np.random.Generator):
        phase = float(own.uniform(0.0, TWO_PI))
        return [term("torque", "frequency", amplitude=amplitude, frequency=frequency, phase=phase)], None

    found = {"frequency": (frequency, "Hz"), "amplitude": (amplitude, "N m")}
    return Acting(("torque",), found, terms=terms)


@ACTING.inside("step_change", "time")
def torque_step(size: float, rng: np.random.Generator) -> Acting:
    """A torque sets in at a time, the same in every recording."""
    jump, time = 0.03 * size * float(rng.choice((-1.0, 1.0))), float(rng.uniform(0.12, 0.28))
    found = {"time": (time, "s"), "jump": (jump, "N m")}
    return Acting(("torque",), found, terms=_torque("step_change", jump=jump, time=time))


@ACTING.inside("function", "rotor_speed")
def fan_torque(size: float, rng: np.random.Generator) -> Acting:
    """A drag that goes with the square of the speed, as of a fan."""
    amplitude = 0.03 * size
    terms = _torque("power", "drag", at_100_rad_s=amplitude, exponent=2.0)
    return Acting(("torque",), {"at_100_rad_s": (amplitude, "N m")}, terms=terms)


@ACTING.inside("bump", "rotor_angle")
def tight_spot(size: float, rng: np.random.Generator) -> Acting:
    """A torque at one angle of the turn."""
    depth, centre, width = 0.04 * size, float(rng.uniform(0.0, TWO_PI)), float(rng.uniform(0.1, 0.5))
    found = {"depth": (depth, "N m"), "centre": (centre, "rad"), "width": (width, "rad")}
    return Acting(("torque",), found, terms=_torque("bump", depth=-depth, centre=centre, width=width))


@ACTING.inside("memory", "time", "rotor_speed")
def grease(size: float, rng: np.random.Generator) -> Acting:
    """A drag that builds up while the rotor turns."""
    gain, constant = 0.03 * size, float(rng.uniform(0.05, 0.3))
    found = {"gain": (gain, "N m"), "time_constant": (constant, "s")}
    terms = _torque("memory", "drag", gain=gain, time_constant=constant, source=SOURCES.index("speed"))
    return Acting(("torque",), found, terms=terms)


@ACTING.inside("bump", "rotor_angle")
def weak_magnet(size: float, rng: np.random.Generator) -> Acting:
    """One phase's back-EMF is weaker at one angle of the turn."""
    (_, phase), depth = letter(rng), 0.2 * size
    centre, width = float(rng.uniform(0.0, TWO_PI)), float(rng.uniform(0.2, 0.6))
    row = term(f"emf_{phase}", "bump", depth=-depth, centre=centre, width=width)
    found = {"depth": (depth, "1"), "centre": (centre, "rad"), "width": (width, "rad")}
    return Acting((f"electrical_{phase}",), found, terms=lambda _, __: ([row], None))


@ACTING.inside("step_change", "time")
def loosened_terminal(size: float, rng: np.random.Generator) -> Acting:
    """The resistance of one phase jumps at a time, the same in every recording."""
    (_, phase), jump, time = letter(rng), 0.2 * size, float(rng.uniform(0.12, 0.28))
    row = term(f"resistance_{phase}", "step_change", jump=jump, time=time)
    found = {"time": (time, "s"), "jump": (jump, "ohm")}
    return Acting((f"electrical_{phase}",), found, terms=lambda _, __: ([row], None))


@ACTING.inside("order", "rotor_angle", "order")
def slip_ring(size: float, rng: np.random.Generator) -> Acting:
    """The resistance of one phase goes with the rotor angle."""
    (_, phase), amplitude = letter(rng), 0.1 * size
    shift = float(rng.uniform(0.0, TWO_PI))
    row = term(f"resistance_{phase}", "order", amplitude=amplitude, order=1.0, phase=shift)
    return Acting((f"electrical_{phase}",), {"amplitude": (amplitude, "ohm")}, terms=lambda _, __: ([row], None))


def _wander(place: str, level: float, correlated: float):
    """A term that follows random noise with a correlation time (s), another in each recording."""
    row = term(place, "table", amplitude=level)

    def terms(duration: float, own: np.random.Generator) -> tuple[Sequence[np.ndarray], np.ndarray]:
        entries = int((duration + SPARE) / TABLE_STEP) + 2
        keep = np.exp(-TABLE_STEP / correlated)
        table = np.zeros(entries)
        table[0] = own.standard_normal()
        for k in range(1, entries):
            table[k] = keep * table[k - 1] + np.sqrt(1.0 - keep**2) * own.standard_normal()
        return [row], table

    return terms


@ACTING.outside("time")
def random_torque(size: float, rng: np.random.Generator) -> Acting:
    """A torque that wanders at random."""
    level, correlated = 0.02 * size, float(rng.uniform(0.01, 0.1))
    return Acting(("torque",), {"level": (level, "N m")}, terms=_wander("torque", level, correlated))


@ACTING.outside("time")
def gliding_frequency(size: float, rng: np.random.Generator) -> Acting:
    """A torque whose frequency glides."""
    amplitude, first, rate = 0.02 * size, float(rng.uniform(5.0, 20.0)), float(rng.uniform(20.0, 80.0))

    def terms(_, own: np.random.Generator):
        phase = float(own.uniform(0.0, TWO_PI))
        return [term("torque", "sweep", amplitude=amplitude, frequency=first, rate=rate, phase=phase)], None

    return Acting(("torque",), {"amplitude": (amplitude, "N m")}, terms=terms)


@ACTING.outside("time")
def ringing(size: float, rng: np.random.Generator) -> Acting:
    """A torque that rings and dies away, at another time in each recording."""
    amplitude, decay, frequency = 0.06 * size, float(rng.uniform(0.03, 0.1)), float(rng.uniform(15.0, 50.0))

    def terms(duration: float, own: np.random.Generator):
        time = float(own.uniform(0.1, 0.7 * duration))
        return [term("torque", "burst", amplitude=amplitude, time=time, decay=decay, frequency=frequency)], None

    return Acting(("torque",), {"amplitude": (amplitude, "N m")}, terms=terms)


@ACTING.outside("rotor_angle", "direction")
def seal(size: float, rng: np.random.Generator) -> Acting:
    """A drag that builds up anew over some travel after each reversal, as of a rubber seal."""
    amplitude, length = 0.03 * size, float(rng.uniform(0.5, 5.0))
    terms = _torque("travel", amplitude=amplitude, length=length)
    return Acting(("torque",), {"amplitude": (amplitude, "N m"), "length": (length, "rad")}, terms=terms)


@ACTING.outside("time")
def sparking_terminal(size: float, rng: np.random.Generator) -> Acting:
    """The resistance of one phase wanders at random."""
    (_, phase), level = letter(rng), 0.1 * size
    terms = _wander(f"resistance_{phase}", level, float(rng.uniform(0.005, 0.05)))
    return Acting((f"electrical_{phase}",), {"level": (level, "ohm")}, terms=terms)

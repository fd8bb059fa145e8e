"""Open-circuit back-EMF of a motor turned from outside, one oscilloscope channel per phase.

Theta the electrical angle of the first channel's fundamental, one k for all phases, sine shape:
    v_c = k w sin(theta - c 120 deg s),  s the phase sequence
Rows are, per channel, the logarithm of the fundamental's amplitude, its angle, and the harmonics over the electrical
turn in parts of the channel's own fundamental (order 0 is the offset): a gain moves one of them only.
"""

from collections.abc import Mapping

import numpy as np

from .recorded.back_emf import distortions, read, recordings
from .statement import Arrays, Effect, Experiment, Machine, Parameter, freedom, nuisance, scaled

__all__ = ["build", "distortions", "experiments", "read"]
NAME = "back_emf"
WORDS = {"log_k": "logarithm of the back-EMF constant"}
SHAPE = (2, 3, 5, 7, 11, 13)  # harmonics that the shape of the magnet's field may have
_PHASES = ("electrical_a", "electrical_b", "electrical_c")
EFFECTS = (
    *(Effect(f"channel_gain_{c}", (f"electrical_{c}",)) for c in "abc"),
    Effect("phase_gain", _PHASES[1:]), Effect("phase_angle", _PHASES[1:]),
    Effect("channel_offset", ("sensor_voltage",)),
    *(Effect(f"shape_{n}", _PHASES) for n in SHAPE), Effect("flux_loss", _PHASES),
)  # fmt: skip


def build(case: str, arrays: Arrays) -> Machine:
    """One file: slower recordings explore, the fastest speed confirms; at one speed some repetitions do."""
    rows, scale, explore, confirm, notes = recordings(case, arrays)
    return Machine(
        NAME, case, explore, confirm, rows, _parameters(scale), EFFECTS,
        dict.fromkeys((*_PHASES, "sensor_voltage"), harmonic), notes=notes, experiments=experiments(), words=WORDS,
    )  # fmt: skip


def harmonic(p: Mapping[str, np.ndarray], x: Mapping[str, np.ndarray]) -> np.ndarray:
    """Real or imaginary part of each harmonic of each channel."""
    order, phase, part = x["order"], x["phase"], x["part"]
    amplitude = np.exp(p["log_k"]) * x["w"] * (1 - p["droop"] * x["w"])
    zero = np.zeros_like(amplitude)
    log_gain, k, angle, offset = zero, zero + 1, zero, zero
    for number, c in enumerate("abc"):
        here, shown = (phase == number).astype(float), (x["channel"] == number).astype(float)
        log_gain = log_gain + shown * np.log(10.0) * p[f"decades_{c}"]
        offset = offset + shown * p[f"offset_{c}"]
        if number:
            k = k + here * p[f"k_{c}"]
            angle = angle + here * p[f"angle_{c}"]
    # harmonics sit on the same rotor: each phase shows them turned by order times its own angle
    turned = order * (angle - phase * x["sequence"] * 2 * np.pi / 3)
    shape = zero + 0j
    for n in SHAPE:
        shape = shape + (order == n) * (p[f"cos_{n}"] - 1j * p[f"sin_{n}"])
    shape = shape * np.exp(1j * turned)
    value = np.where(part == 0, shape.real, shape.imag)
    value = np.where(order == 0, offset / (k * amplitude), value)
    first = np.where(part == 0, np.log(k * amplitude) + log_gain, angle)
    return np.where(order == 1, first, value)


def _parameters(scale: float) -> tuple[Parameter, ...]:
    found = [nuisance("log_k", "log(V s/rad)", float(np.log(scale)), 0.5)]
    found += [freedom(f"channel_gain_{c}", f"decades_{c}", "1", 0.7, -2.5, 2.5) for c in "abc"]
    found += [freedom("phase_gain", f"k_{c}", "1", 0.02, -0.3, 0.3) for c in "bc"]
    found += [freedom("phase_angle", f"angle_{c}", "rad", 0.02, -0.5, 0.5) for c in "bc"]
    found += [freedom("channel_offset", f"offset_{c}", "V", 0.2, -5.0, 5.0) for c in "abc"]
    for n in SHAPE:
        found += [freedom(f"shape_{n}", f"{part}_{n}", "1", 0.03, -0.5, 0.5) for part in ("cos", "sin")]
    return (*found, freedom("flux_loss", "droop", "s/rad", 0.001, -0.02, 0.02))


def experiments() -> tuple[Experiment, ...]:
    """Other speeds, and probes moved on by one phase: a gain follows its channel, a k its phase."""
    return (
        Experiment(
            "the same speed with every probe moved on by one phase", lambda x: {"channel": (x["channel"] + 1) % 3}
        ),
        scaled("a tenth of the speed", w=0.1),
        scaled("four times the speed", w=4.0),
        scaled("turned the other way", sequence=-1.0),
    )

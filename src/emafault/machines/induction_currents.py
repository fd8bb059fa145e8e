"""A line-fed induction motor known by its phase currents: which phase has shorted turns, or that it cannot be said.

Positive-sequence current I_1 with an unbalance u_0 of supply and sensors (from the healthy recording):
    I_2 / I_1 = u_0,   I_0 / I_1 = z_0
Shorted turns in phase x load that phase alone with a current d I_1 exp(i gamma) (d its part of I_1, gamma its lead
over the phase's own current; between 0 when it is as inductive as the motor and 90 deg when it is resistive). With no
neutral its return runs through the other two phases in equal parts, so that with a = exp(2 pi i / 3)
    I_2 / I_1 = u_0 + d/2 exp(i gamma) a^n,   n = 0, 1, 2 for the phases in the order of the sequence
"""

from collections.abc import Mapping

import numpy as np

from .recorded.induction_currents import REPEATABILITY, distortions, read, recordings
from .statement import Arrays, Effect, Experiment, Machine, Parameter, freedom, nuisance

__all__ = ["build", "distortions", "experiments", "read"]
NAME = "induction_currents"
WORDS = {
    "u_re": "negative sequence of the healthy currents, real part",
    "u_im": "negative sequence of the healthy currents, imaginary part",
    "z_re": "zero sequence of the healthy currents, real part",
    "z_im": "zero sequence of the healthy currents, imaginary part",
}
Values = Mapping[str, np.ndarray]
EFFECTS = (
    *(
        Effect(
            f"shorted_turns_{c}", ("electrical",),
            tuple({f"d_{c}": d, f"gamma_{c}": gamma} for d, gamma in ((0.1, 0.3), (0.1, 0.9), (0.1, 1.5))),
        )
        for c in "abc"
    ),
    *(Effect(f"current_gain_{c}", ("sensor_current", "electrical")) for c in "abc"),
    Effect("supply_unbalance", ("electrical",)),
)  # fmt: skip


def build(case: str, arrays: Arrays) -> Machine:
    """One condition: the first half of the repetitions explores, the others confirm."""
    found = recordings(arrays)
    return Machine(
        NAME, case, found.explore, found.confirm, found.rows, _parameters(found.unbalance, found.zero, found.spread),
        EFFECTS, {"electrical": negative, "sensor_current": zero}, notes=found.notes, observed=found.observed,
        experiments=experiments(), words=WORDS,
    )  # fmt: skip


def _sequences(p: Values, x: Values) -> tuple[np.ndarray, np.ndarray]:
    """Negative and zero sequence in parts of the positive one, complex (point, 1)."""
    turn = np.exp(2j * np.pi / 3 * x["order"][0])
    one = np.ones_like(p["u_re"], dtype=complex)
    # phase currents over I_1, from the positive sequence of unit size
    base = [one * turn ** (-n) for n in range(3)]
    current = [c.copy() for c in base]
    unbalance = p["u_re"] + p["supply_re"] + 1j * (p["u_im"] + p["supply_im"])
    unbalance = unbalance * turn ** (2 * x["lead"][0])
    for n, c in enumerate("abc"):
        current[n] = current[n] + unbalance * turn**n
        short = p[f"d_{c}"] * np.exp(1j * p[f"gamma_{c}"]) * base[n]
        for m in range(3):
            current[m] = current[m] + (short if m == n else -0.5 * short)
    common = p["z_re"] + 1j * p["z_im"]
    gains = [1 + p[f"gain_{'abc'[(n + x['probe'][0]) % 3]}"] for n in range(3)]
    current = [(i + common) * gain for i, gain in zip(current, gains, strict=True)]
    first = sum(i * turn**n for n, i in enumerate(current)) / 3
    return sum(i * turn ** (-n) for n, i in enumerate(current)) / 3 / first, sum(current) / 3 / first


def negative(p: Values, x: Values) -> np.ndarray:
    """Real and imaginary parts of I_2/I_1 in each window."""
    second, _ = _sequences(p, x)
    return np.where(x["part"] == 0, second.real, second.imag)


def zero(p: Values, x: Values) -> np.ndarray:
    """Real and imaginary parts of I_0/I_1 in each window."""
    _, common = _sequences(p, x)
    return np.where(x["part"] == 0, common.real, common.imag)


def _parameters(unbalance: complex, zero: complex, spread: float) -> tuple[Parameter, ...]:
    sd = max(spread, REPEATABILITY)
    found = [
        nuisance("u_re", "1", unbalance.real, sd, specified="electrical"),
        nuisance("u_im", "1", unbalance.imag, sd, specified="electrical"),
        nuisance("z_re", "1", zero.real, 3 * sd, specified="sensor_current"),
        nuisance("z_im", "1", zero.imag, 3 * sd, specified="sensor_current"),
    ]
    for c in "abc":
        found += [
            freedom(f"shorted_turns_{c}", f"d_{c}", "1", 0.3, 0.0, 3.0),
            # lead of the short's current: 0 as inductive as the motor, 90 deg resistive at no load
            freedom(f"shorted_turns_{c}", f"gamma_{c}", "rad", 0.4, -0.5, 2.0, mean=0.9, off=0.9),
        ]
    found += [freedom(f"current_gain_{c}", f"gain_{c}", "1", 0.2, -0.8, 0.8) for c in "abc"]
    return (*found, *(freedom("supply_unbalance", f"supply_{part}", "1", 0.05, -0.5, 0.5) for part in ("re", "im")))


def experiments() -> tuple[Experiment, ...]:
    """A gain follows its channel, an unbalance the supply, a short the winding."""
    return (
        Experiment("every current probe moved on by one phase", lambda x: {"probe": x["probe"] + 1}),
        Experiment("every supply lead moved on by one phase", lambda x: {"lead": x["lead"] + 1}),
    )

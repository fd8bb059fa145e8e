"""Whether the numbers of a datasheet go together: what contradicts what, and what no machine has."""

from collections.abc import Mapping
from itertools import combinations
from math import log, pi, sqrt

from ..actuator.parameters import ActuatorParameters
from ..errors import InputError
from .sheet import Sheet

LARGEST = 0.25  # by which two statements of one quantity may differ in all; beyond it neither can be taken
#: factors that constants of one motor differ by where one is meant otherwise
FACTORS = {
    2.0: "one of both is a phase's, not line to line", sqrt(3.0): "one of both is a phase's, of sine waves",
    sqrt(2.0): "one of both is an rms value, not the peak", sqrt(1.5): "one of both is of sine-wave drive, in rms",
    60.0 / (2.0 * pi): "one of both counts rad/s for rpm",
}  # fmt: skip
NEAR = 0.04  # of the logarithm of such a factor
#: what machines have: electrical (s) and mechanical time constant (s), friction over stall torque
ELECTRICAL_TIME = (1e-5, 0.2)
MECHANICAL_TIME = (2e-5, 10.0)
MOST_FRICTION = 0.5


def of_constants(found: Mapping[str, float], sheet: Sheet) -> list[str]:
    """Contradictions between torque, speed and back-EMF constant, each as the constant (V s/rad) that it stands for.

    Raises
    ------
    InputError : two that differ by more than a quarter
    """
    out = []
    for one, other in combinations(found, 2):
        words = f"{one} ({sheet.numbers[one].text}) and {other} ({sheet.numbers[other].text})"
        if {sheet.numbers[k].source for k in (one, other)} == {"identified", "datasheet"}:
            continue  # the identified one is taken, and was compared when it was identified
        out += _compared(words, found[one], found[other], sheet.numbers[one].tolerance + sheet.numbers[other].tolerance)
    return out


def notes(sheet: Sheet, actuator: ActuatorParameters) -> list[str]:
    """Contradictions between the composed numbers.

    Raises
    ------
    InputError : numbers that no machine has together, naming them
    """
    _refuse_impossible(actuator)
    out = []
    kt, R = 2.0 * actuator.back_emf, 2.0 * actuator.resistance
    given = {k: n.value for k, n in sheet.numbers.items()}
    volts = given.get("rated_voltage", actuator.bus_voltage)
    if "no_load_speed" in given and "no_load_current" in given:
        expected = (volts - R * given["no_load_current"]) / kt
        words = f"no_load_speed ({sheet.numbers['no_load_speed'].text}) and {volts:.4g} V over the back-EMF constant"
        out += _compared(
            words, given["no_load_speed"], expected, sheet.numbers["no_load_speed"].tolerance, refused=False
        )
    if "rated_torque" in given and "rated_current" in given:
        words = "rated_torque over rated_current and the torque constant"
        tolerance = sheet.numbers["rated_torque"].tolerance + sheet.numbers["rated_current"].tolerance
        out += _compared(words, given["rated_torque"] / given["rated_current"], kt, tolerance, refused=False)
    if {"no_load_current", "coulomb_friction", "viscous_friction"} <= given.keys():
        speed = given.get("no_load_speed", actuator.speed_limit)
        torque = given["coulomb_friction"] + given["viscous_friction"] * speed
        torque = max(torque, 1e-3 * kt * given["no_load_current"])
        out += _compared(
            "no_load_current and both frictions", kt * given["no_load_current"], torque, 0.5, refused=False
        )
    reached = actuator.bus_voltage / kt
    if actuator.speed_limit > reached:
        out.append(f"maximum_speed is {actuator.speed_limit:.4g} rad/s, the supply allows {reached:.4g} rad/s")
    if actuator.current_limit > actuator.bus_voltage / R:
        out.append(
            f"peak_current is {actuator.current_limit:.4g} A, the supply drives {actuator.bus_voltage / R:.4g} A"
        )
    return out


def _compared(words: str, one: float, other: float, tolerance: float, refused: bool = True) -> list[str]:
    """A note where two statements of one quantity differ by more than their tolerances.

    Raises
    ------
    InputError : by more than ``LARGEST``, where ``refused``
    """
    apart = abs(log(one / other))
    if apart <= max(tolerance, 0.02):
        return []
    factor = max(one / other, other / one)
    hint = next((f": {text}" for f, text in FACTORS.items() if refused and abs(log(factor / f)) < NEAR), "")
    text = f"{words} contradict each other by a factor of {factor:.3g}{hint}"
    if refused and apart > LARGEST:
        raise InputError(f"{text}; put one right, or say ? of it")
    return [text]


def _refuse_impossible(a: ActuatorParameters) -> None:
    kt, R = 2.0 * a.back_emf, 2.0 * a.resistance
    electrical, mechanical = a.inductance / a.resistance, a.inertia * R / kt**2
    friction = a.coulomb_friction / (kt * a.bus_voltage / R)
    for words, value, (low, high), unit, keys in (
        ("electrical time constant", electrical, ELECTRICAL_TIME, " s", "inductance and resistance"),
        ("mechanical time constant", mechanical, MECHANICAL_TIME, " s", "inertia, resistance and torque constant"),
        ("friction over the stall torque", friction, (0.0, MOST_FRICTION), "", "friction, voltage and resistance"),
    ):
        if not low <= value <= high:
            raise InputError(
                f"{keys}: their {words} would be {value:.3g}{unit}, machines have {low:g} to {high:g}{unit}; check "
                "the units"
            )

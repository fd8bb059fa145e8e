"""The numbers of a datasheet composed into the parameters of the equations, each with where it comes from.

The motor is in star and driven in six steps: two phases in series carry the current, so that line to line is twice a
phase, and torque constant (N m/A) and line-to-line back-EMF constant (V s/rad) are both 2 k.
"""

from dataclasses import dataclass, fields, replace
from math import exp, log
from pathlib import Path
from typing import Any

from ..actuator.parameters import ActuatorParameters
from ..effects import EFFECTS
from ..errors import InputError
from . import consistency
from .keys import CONSTANTS, KEYS
from .sheet import Number, Sheet, read_sheet

#: of what a datasheet does not say; bandwidths and time constants are the reference actuator's
SPEED_BANDWIDTH = 752.0  # 1/s, speed gain times torque constant over inertia
INTEGRAL_RATE = 80.0  # 1/s, integral gain over speed gain
POSITION_GAIN = 100.0  # 1/s
BAND = 0.02  # of the current limit, half band of the regulator
ELECTRICAL_TIME = 3.4e-4  # s, L/R
MECHANICAL_TIME = 9.4e-3  # s, J times line-to-line resistance over torque constant squared
FRICTION = 0.04  # of the torque at the current limit
VISCOUS_SHARE = 0.3  # of the no-load torque at the no-load speed
BACKLASH = 9e-4  # rad, three minutes of arc
LEAST_BACKLASH = 1e-6  # rad, that stands for none
NO_STOP = 100.0  # rad, as good as none
SWITCH = 0.01  # of a phase's resistance
ASSUMED = 0.9  # half of the 90 % interval of what is assumed, over it
WIDEST = 0.6  # standard deviation over the value that a unit's tolerance may have
Z = 1.645  # standard deviations of half a 90 % interval

#: parameter -> effect and parameter of the catalogue that has its tolerance
TOLERANCE = {
    "resistance": ("unit_calibration", "R_scale"), "back_emf": ("unit_calibration", "k_scale"),
    "inductance": ("inductance_tolerance", "L_scale"), "inertia": ("inertia", "scale"),
    "viscous_friction": ("viscous_friction", "scale"), "coulomb_friction": ("friction_level", "scale"),
    "backlash": ("backlash", "blk"), "bus_voltage": ("bus_voltage", "Vdc"),
}  # fmt: skip


@dataclass(frozen=True)
class Composed:
    """A parameter of the equations (SI): half of its 90 % interval over the value, its source, and what it is of."""

    value: float
    tolerance: float
    source: str
    of: str


@dataclass(frozen=True)
class Machine:
    """An actuator composed: ``parameters`` by the names of ``ActuatorParameters``; ``notes`` name contradictions."""

    name: str
    parameters: dict[str, Composed]
    notes: tuple[str, ...]

    @property
    def actuator(self) -> ActuatorParameters:
        """The nominal actuator."""
        return ActuatorParameters(**self.plain())

    def plain(self) -> dict[str, Any]:
        """Parameters as a configuration holds them."""
        return {n: round(p.value) if n == "pole_pairs" else p.value for n, p in self.parameters.items()}

    def tolerances(self) -> dict[str, dict[str, float]]:
        """Effect -> parameter -> standard deviation of a unit over its nominal value: no less than the catalogue's, for
        a unit changes from day to day."""
        out: dict[str, dict[str, float]] = {}
        for name, (effect, parameter) in TOLERANCE.items():
            least = EFFECTS[effect].parameters[parameter].tolerance
            out.setdefault(effect, {})[parameter] = min(max(self.parameters[name].tolerance / Z, least), WIDEST)
        return out

    def overrides(self) -> list[str]:
        """The same as overrides of a configuration."""
        out = [f"actuator.{name}={value!r}" for name, value in self.plain().items()]
        for effect, own in self.tolerances().items():
            out += [f"++tolerances.{effect}.{name}={value!r}" for name, value in own.items()]
        return out


def compose(sheet: Sheet) -> Machine:
    """Parameters of the equations from a file's numbers; what it does not say is assumed.

    Raises
    ------
    InputError : numbers that contradict each other by more than any tolerance, or that no machine has together
    """
    notes: list[str] = []
    try:
        p = _Composer(sheet, notes).all()
        machine = Machine(sheet.name, p, ())
        notes += consistency.notes(sheet, machine.actuator)
    except InputError as error:
        raise InputError(f"{sheet.path}: {error}") from None
    return Machine(sheet.name, {f.name: p[f.name] for f in fields(ActuatorParameters)}, tuple(notes))


class _Composer:
    """Parameters one after the other, in the order in which they depend on one another."""

    def __init__(self, sheet: Sheet, notes: list[str]):
        self.sheet, self.notes = sheet, notes
        self.p: dict[str, Composed] = {}

    def all(self) -> dict[str, Composed]:
        self._take("bus_voltage", "supply_voltage")
        self._take("resistance", "resistance", 0.5)
        self.p["back_emf"] = self._constant()
        self._take("pole_pairs", "pole_pairs")
        self._take("gear_ratio", "gear_ratio")
        R, k, V = (self.value(n) for n in ("resistance", "back_emf", "bus_voltage"))
        self._take("inductance", "inductance", 0.5, ELECTRICAL_TIME * R, "L/R of 0.34 ms")
        rated = self.sheet.get("rated_current")
        limit = min(3.0 * rated.value if rated else V / (4.0 * R), V / (2.0 * R))
        self._take(
            "current_limit", "peak_current", 1.0, limit, "three times rated_current" if rated else "half of stall"
        )
        free = self.sheet.get("no_load_speed")
        self._take(
            "speed_limit", "maximum_speed", 1.0, free.value if free else 0.8 * V / (2.0 * k),
            "no_load_speed" if free else "four fifths of the supply's",
        )  # fmt: skip
        self._inertia(R, k)
        self._friction(k, free)
        self._take("static_over_coulomb", "static_over_coulomb", 1.0, 1.5, "as is usual")
        self._take("backlash", "backlash", 1.0, BACKLASH, "three minutes of arc")
        if self.value("backlash") < LEAST_BACKLASH:
            self.p["backlash"] = replace(self.p["backlash"], value=LEAST_BACKLASH)
        self._take("end_stop", "travel", 1.0, NO_STOP, "no stop within reach")
        self._controller(k)
        self._take("switch_resistance", "switch_resistance", 1.0, SWITCH * R, "a hundredth of the phase's")
        self._take("diode_voltage", "diode_voltage", 1.0, 0.8, "of silicon")
        self._take("copper_coefficient", "copper_coefficient", 1.0, 0.00404, "of copper")
        self._take("reference_temperature", "reference_temperature", 1.0, 20.0, "as is usual")
        return self.p

    def value(self, name: str) -> float:
        return self.p[name].value

    def _take(self, name: str, key: str, factor: float = 1.0, assumed: float = 0.0, why: str = "") -> None:
        """A parameter of one number, or what is assumed in its place."""
        given = self.sheet.get(key)
        if given is not None:
            of = key if factor == 1.0 else f"{factor:g} {key}"
            self.p[name] = Composed(factor * given.value, given.tolerance, given.source, of)
        else:
            self.p[name] = Composed(assumed, ASSUMED, "assumed", why)

    def _constant(self) -> Composed:
        """k of a phase from the constants that there are: identified ones alone, else their weighted mean."""
        found = {}
        for key in CONSTANTS:
            number = self.sheet.get(key)
            if number is not None:
                k = 0.5 / number.value if key == "speed_constant" else 0.5 * number.value
                found[key] = (k, number)
        self.notes += consistency.of_constants({key: 2.0 * k for key, (k, _) in found.items()}, self.sheet)
        identified = {key: kn for key, kn in found.items() if kn[1].source == "identified"}
        used = identified or found
        weight = {key: 1.0 / max(n.tolerance, 1e-4) ** 2 for key, (_, n) in used.items()}
        whole = sum(weight.values())
        k = exp(sum(w * log(used[key][0]) for key, w in weight.items()) / whole)
        source = "identified" if identified else next(iter(used.values()))[1].source
        return Composed(k, min(n.tolerance for _, n in used.values()), source, " and ".join(used))

    def _inertia(self, R: float, k: float) -> None:
        rotor, load, ratio = self.sheet.get("rotor_inertia"), self.sheet.get("load_inertia"), self.value("gear_ratio")
        if rotor is None:
            J = MECHANICAL_TIME * (2.0 * k) ** 2 / (2.0 * R)
            self.p["inertia"] = Composed(J, ASSUMED, "assumed", "a mechanical time constant of 9.4 ms")
            return
        of, J = "rotor_inertia", rotor.value
        if load is not None and load.value and rotor.source != "identified":
            of, J = "rotor_inertia and load_inertia / gear_ratio^2", J + load.value / ratio**2
        self.p["inertia"] = Composed(J, rotor.tolerance, rotor.source, of)

    def _friction(self, k: float, free: Number | None) -> None:
        """Coulomb and viscous friction at the motor, by the torque at no load where one of both is not said."""
        I0, dry, wet = (self.sheet.get(n) for n in ("no_load_current", "coulomb_friction", "viscous_friction"))
        speed = free.value if free else self.value("speed_limit")
        at_no_load = Number(2.0 * k * I0.value, 0.5, I0.source, "") if I0 else None
        self._take("coulomb_friction", "coulomb_friction", 1.0, FRICTION * 2.0 * k * self.value("current_limit"),
                   "4 % of the torque at peak_current")  # fmt: skip
        if dry is None and at_no_load is not None:
            torque = at_no_load.value
            left = max(torque - wet.value * speed, 0.1 * torque) if wet else (1.0 - VISCOUS_SHARE) * torque
            self.p["coulomb_friction"] = Composed(left, at_no_load.tolerance, at_no_load.source, "no_load_current")
        shared = VISCOUS_SHARE / (1.0 - VISCOUS_SHARE) * self.value("coulomb_friction")
        self._take("viscous_friction", "viscous_friction", 1.0, shared / speed, "three tenths of the torque at no load")
        if wet is None and dry is not None and at_no_load is not None:
            left = max(at_no_load.value - dry.value, 0.1 * at_no_load.value) / speed
            of = "no_load_current less coulomb_friction"
            self.p["viscous_friction"] = Composed(left, ASSUMED, at_no_load.source, of)

    def _controller(self, k: float) -> None:
        J, limit = self.value("inertia"), self.value("current_limit")
        self._take("position_gain", "position_gain", 1.0, POSITION_GAIN, "as the reference actuator's")
        gain = SPEED_BANDWIDTH * J / (2.0 * k)
        self._take("speed_gain", "speed_gain", 1.0, gain, "a bandwidth of 752 1/s")
        integral = INTEGRAL_RATE * self.value("speed_gain")
        self._take("speed_integral_gain", "speed_integral_gain", 1.0, integral, "80 1/s times the speed gain")
        self._take(
            "hysteresis", "current_band", 1.0, max(BAND * limit, KEYS["current_band"].low), "2 % of peak_current"
        )
        self._take("control_period", "control_period", 1.0, 1e-4, "as the reference actuator's")


def as_text(machine: Machine) -> str:
    """Name, value, unit, 90 % interval and source of every parameter, as aligned text; then the notes."""
    lines = [f"{machine.name}; a phase, at the motor, SI units", ""]
    for name, p in machine.parameters.items():
        spread = f"+- {100.0 * p.tolerance:.3g} %" if p.tolerance and name in TOLERANCE else ""
        lines.append(f"{name:22} {p.value:12.6g} {UNITS[name]:12} {spread:12} {p.source:10} {p.of}")
    return "\n".join([*lines, *(f"note: {n}" for n in machine.notes)])


UNITS = {
    "bus_voltage": "V", "resistance": "ohm", "inductance": "H", "back_emf": "V s/rad", "pole_pairs": "",
    "inertia": "kg m2", "viscous_friction": "N m s/rad", "coulomb_friction": "N m", "static_over_coulomb": "",
    "gear_ratio": "", "backlash": "rad", "end_stop": "rad", "current_limit": "A", "speed_limit": "rad/s",
    "position_gain": "1/s", "speed_gain": "A s/rad", "speed_integral_gain": "A/rad", "hysteresis": "A",
    "switch_resistance": "ohm", "diode_voltage": "V", "copper_coefficient": "1/K", "reference_temperature": "degC",
    "control_period": "s",
}  # fmt: skip


def of_file(path: str | Path) -> Machine:
    """The actuator of a file.

    Raises
    ------
    InputError : see ``read_sheet`` and ``compose``
    """
    return compose(read_sheet(path))

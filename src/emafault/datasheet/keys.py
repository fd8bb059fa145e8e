"""What a file of one's own actuator may say, as datasheets give it; every quantity is kept in SI units."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Key:
    """One number of the file.

    ``low`` and ``high``: what any machine has (SI). ``tolerance``: half of the interval, over the value, that holds
    nine units of ten where the datasheet states none.
    """

    unit: str
    low: float
    high: float
    tolerance: float
    words: str
    example: str


#: name -> what it is; at the motor unless the words say otherwise
KEYS: dict[str, Key] = {
    "supply_voltage": Key("V", 1.0, 1e4, 0.01, "of the inverter's bus", "28 V"),
    "rated_voltage": Key("V", 1.0, 1e4, 0.0, "at which the no-load figures hold; supply_voltage unless given", "24 V"),
    "resistance": Key("ohm", 1e-4, 1e4, 0.05, "line to line, at reference_temperature", "0.60 ohm"),
    "inductance": Key("H", 1e-6, 10.0, 0.1, "line to line", "0.16 mH"),
    "torque_constant": Key("N m/A", 1e-5, 200.0, 0.05, "of two phases in series", "28 mN m/A"),
    "speed_constant": Key("rad/s/V", 5e-3, 1e5, 0.05, "line to line, of the peak", "341 rpm/V"),
    "back_emf_constant": Key("V s/rad", 1e-5, 200.0, 0.05, "line to line, peak", "2.93 V/krpm"),
    "pole_pairs": Key("", 1.0, 100.0, 0.0, "half the number of poles", "7"),
    "rotor_inertia": Key("kg m^2", 1e-10, 100.0, 0.1, "rotor with what turns with it", "120 g cm2"),
    "load_inertia": Key("kg m^2", 0.0, 1e5, 0.1, "at the output shaft", "0.01 kg m2"),
    "no_load_current": Key("A", 1e-4, 1e3, 0.3, "of two phases, with the gear if it is known so", "0.6 A"),
    "no_load_speed": Key("rad/s", 1.0, 1e5, 0.1, "at rated_voltage", "8100 rpm"),
    "coulomb_friction": Key("N m", 0.0, 1e4, 0.3, "at the motor, gear included", "17 mN m"),
    "viscous_friction": Key("N m s/rad", 0.0, 100.0, 0.3, "at the motor, gear included", "2e-5 N m s/rad"),
    "static_over_coulomb": Key("", 1.0, 10.0, 0.0, "static over Coulomb friction", "1.5"),
    "gear_ratio": Key("", 1.0, 1e5, 0.0, "motor over output", "120"),
    "backlash": Key("rad", 0.0, 1.0, 0.3, "total, at the output shaft", "1.4 arcmin"),
    "travel": Key("rad", 1e-4, 1e4, 0.0, "of the output shaft to either side", "57 deg"),
    "rated_current": Key("A", 1e-4, 1e4, 0.1, "continuous", "5 A"),
    "rated_torque": Key("N m", 1e-6, 1e5, 0.1, "continuous, at the motor", "140 mN m"),
    "peak_current": Key("A", 1e-3, 1e4, 0.0, "limit of the controller", "15 A"),
    "maximum_speed": Key("rad/s", 1.0, 1e5, 0.0, "limit of the controller, at the motor", "5700 rpm"),
    "position_gain": Key("1/s", 1e-3, 1e5, 0.0, "speed over position error, both at the motor", "100 1/s"),
    "speed_gain": Key("A s/rad", 1e-9, 1e4, 0.0, "current over speed error", "0.3 A s/rad"),
    "speed_integral_gain": Key("A/rad", 1e-9, 1e6, 0.0, "current over the integral of the speed error", "25 A/rad"),
    "current_band": Key("A", 1e-3, 1e3, 0.0, "half band of the current regulator", "0.3 A"),
    "control_period": Key("s", 1e-6, 1e-2, 0.0, "of the speed loop", "100 us"),
    "switch_resistance": Key("ohm", 0.0, 100.0, 0.0, "of one switch", "5 mohm"),
    "diode_voltage": Key("V", 0.0, 100.0, 0.0, "of a free-wheel diode", "0.8 V"),
    "copper_coefficient": Key("1/K", 1e-4, 0.1, 0.0, "of the winding's resistance", "0.00404 1/K"),
    "reference_temperature": Key("degC", -100.0, 200.0, 0.0, "that resistance holds at", "20 degC"),
}
#: cannot be assumed; of the three constants one is enough
REQUIRED = ("supply_voltage", "resistance", "pole_pairs", "gear_ratio")
CONSTANTS = ("torque_constant", "speed_constant", "back_emf_constant")
SOURCES = ("datasheet", "identified", "assumed")
UNKNOWN = "?"

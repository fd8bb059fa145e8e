"""Alternative forms of effects, for cases in which the library's formula is not the truth; the fixed step has them."""

from ..effects import EFFECTS

#: effects that have an alternative form; the position in this tuple is the index of its flag in compiled code
FORMS = tuple(sorted(EFFECTS))
INDEX = {effect: index for index, effect in enumerate(FORMS)}
F_ANGLE, F_SHAPE, F_PLAY = INDEX["angle_offset"], INDEX["back_emf_shape"], INDEX["backlash"]
F_BUS_R, F_BUS_V, F_COGGING = INDEX["bus_resistance"], INDEX["bus_voltage"], INDEX["cogging"]
F_COMPLIANCE, F_CONTACT, F_DELAY = INDEX["compliance"], INDEX["contact_resistance"], INDEX["control_delay"]
F_GAIN, F_OFFSET, F_DYNAMIC = INDEX["current_gain"], INDEX["current_offset"], INDEX["dynamic_eccentricity"]
F_ASYMMETRY, F_LEVEL, F_COLD = INDEX["friction_asymmetry"], INDEX["friction_level"], INDEX["friction_temperature"]
F_HALL, F_SATURATION, F_L = INDEX["hall_displacement"], INDEX["inductance_saturation"], INDEX["inductance_tolerance"]
F_INERTIA, F_LOAD, F_SPRING = INDEX["inertia"], INDEX["load_constant"], INDEX["load_spring"]
F_MAGNET, F_HEAT, F_LATENCY = INDEX["magnet_temperature"], INDEX["self_heating"], INDEX["speed_latency"]
F_SPEED, F_STRIBECK, F_UNIT = INDEX["speed_scale"], INDEX["stribeck"], INDEX["unit_calibration"]
F_NEUTRAL, F_VISCOUS, F_VOLTAGE = INDEX["virtual_neutral"], INDEX["viscous_friction"], INDEX["voltage_gain"]

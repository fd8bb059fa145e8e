"""How the gallery looks at each effect and form: equation, coordinate, what is seen, what tells it apart."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from emafault.diagnosis.forms import function, memory

FORM_SIZE = 0.01  # N m
#: equation -> what a picture has along its height
QUANTITY = {
    "electrical": "voltage of the phase (V)",
    "torque": "torque (N m)",
    "sensor_current": "sum of the currents (A)",
    "sensor_speed": "recorded speed (rad/s)",
    "position": "output angle (rad)",
    "bus": "bus voltage (V)",
    "control": "current, change in 2 ms (A)",
    "commutation": "current of the new phase (A)",
}
#: coordinate -> along its width
AXES = {
    "speed": "rotor speed (rad/s)",
    "acceleration": "acceleration of the rotor (rad/s2)",
    "output": "output angle (rad)",
    "time": "time (s)",
    "turn": "rotor angle in the turn (rad)",
    "angle": "rotor angle (rad)",
    "cogs": "rotor angle over two cogs (rad)",
    "electrical_angle": "electrical angle of phase a (degrees)",
    "current": "phase current (A)",
    "current_change": "change of the phase current in the interval (A)",
    "voltage": "phase voltage (V)",
    "bus_current": "current of the bus (A)",
    "temperature": "ambient temperature (degC)",
    "edge": "electrical angle from the edge (degrees)",
    "carried": "rotor angle over the gear ratio (rad)",
}


@dataclass(frozen=True)
class View:
    """How a signature is looked at.

    ``seen`` is what the picture shows, in words; ``apart`` what tells the effect from others. ``curves``: one for each
    phase, each parameter, or currents below and above a size; ``parameters`` that are on, all if none; ``rows`` that
    count; ``signed``: counted in the direction of the phase's back-EMF or current; ``path``: row after row in time.
    """

    equation: str
    along: str
    seen: str
    apart: str = ""
    curves: str = ""
    parameters: tuple[str, ...] = ()
    rows: str = ""
    signed: str = ""
    path: bool = False


VIEWS: dict[str, tuple[View, ...]] = {
    "magnet_temperature": (
        View(
            "electrical",
            "temperature",
            "a straight line that falls with temperature, through zero at 20 degC",
            "A smaller k in all phases, in voltage and torque alike, which only recordings at several temperatures "
            "tell "
            "from `unit_calibration`.",
            rows="on",
        ),
    ),
    "unit_calibration": (
        View(
            "electrical",
            "current",
            "a straight line through zero",
            "R shows along the current, k along the speed, both "
            "the same in all phases and at all temperatures. A k that is off moves the torque too.",
            parameters=("R_scale",),
        ),
        View(
            "electrical",
            "speed",
            "a straight line through zero where the phase is on its plateau",
            parameters=("k_scale",),
            rows="plateau",
        ),
    ),
    "contact_resistance": (
        View(
            "electrical",
            "current",
            "straight lines through zero, another slope in each phase",
            "As a resistance of single phases, which shorted turns change together with L and k. It does not grow with "
            "temperature.",
            "phases",
        ),
    ),
    "inductance_tolerance": (
        View(
            "electrical",
            "current_change",
            "a straight line through zero",
            "It goes with the change of the current, at any current, speed and angle, and alike in all phases.",
        ),
    ),
    "inductance_saturation": (
        View(
            "electrical",
            "current_change",
            "two lines that fall through zero, the steeper at larger currents",
            "It goes with the change of the current as `inductance_tolerance` does, but more at large currents.",
            "sizes",
            rows="ripple",
        ),
    ),
    "back_emf_shape": (
        View(
            "electrical",
            "electrical_angle",
            "pulses at the ramps from the width, waves of five and seven periods a turn",
            "It goes with the speed and repeats with each electrical turn; a k that is off has the shape of the "
            "trapezoid itself.",
            "parameters",
            rows="fast",
        ),
    ),
    "dynamic_eccentricity": (
        View(
            "electrical",
            "turn",
            "one wave in a turn of the rotor, shifted from phase to phase",
            "It repeats with the turn of the rotor and goes with the speed; static eccentricity is constant in "
            "each phase.",
            "phases",
            rows="plateau_fast",
            signed="back-EMF",
        ),
    ),
    "self_heating": (
        View(
            "electrical",
            "time",
            "a rise through the recording, larger where the current is larger",
            "As a resistance that grows from nothing in each recording, the faster the larger the current was.",
            rows="driven",
            signed="current",
        ),
    ),
    "current_gain": (
        View(
            "sensor_current",
            "electrical_angle",
            "six steps in an electrical turn, as the current goes from phase to phase",
            "The sum of the currents goes with the current and with the phases that carry it; an offset leaves it "
            "constant.",
            rows="fast",
        ),
    ),
    "current_offset": (
        View(
            "sensor_current",
            "electrical_angle",
            "a constant",
            "The sum of the currents is the same at any current, at rest too. The sum shows the three offsets "
            "together; the "
            "voltages tell which phase has which.",
            rows="fast",
        ),
    ),
    "voltage_gain": (
        View(
            "electrical",
            "voltage",
            "straight lines through zero, another slope in each phase",
            "It goes with the whole voltage, so with R, L and k of a phase in one proportion, and leaves the "
            "torque alone.",
            "phases",
        ),
    ),
    "virtual_neutral": (
        View(
            "electrical",
            "electrical_angle",
            "three waves in an electrical turn, the same in all phases, one curve on the other",
            "The recorded voltages add up to nothing, so their mean is missing in each, three times an electrical "
            "turn.",
            "phases",
            rows="fast",
        ),
    ),
    "speed_latency": (
        View(
            "sensor_speed",
            "acceleration",
            "a straight line that falls through zero",
            "It goes with the acceleration; a scale goes with the speed.",
            rows="steady",
        ),
    ),
    "speed_quantisation": (
        View(
            "sensor_speed",
            "speed",
            "a saw of the height and width of one step",
            "The recorded values lie on a lattice, whatever the motion.",
            rows="crawl",
        ),
    ),
    "speed_scale": (
        View(
            "sensor_speed",
            "speed",
            "a straight line through zero",
            "It goes with the speed; a lag goes with the acceleration.",
        ),
    ),
    "angle_offset": (
        View(
            "electrical",
            "electrical_angle",
            "pulses on the ramps of the trapezoid, one up and one down, nothing on the plateaus",
            "The trapezoid is shifted: the ramps show it in all phases, to the same side.",
            "phases",
            rows="fast",
        ),
    ),
    "cogging": (
        View(
            "torque",
            "cogs",
            "two periods of a sine",
            "It repeats 72 times a turn, whatever speed, current and time.",
            rows="slow",
        ),
    ),
    "friction_level": (
        View(
            "torque",
            "speed",
            "a step down at zero speed, constant to either side",
            "It has the sign of the motion and one size at all speeds; viscous friction grows with speed, Stribeck "
            "friction falls.",
        ),
    ),
    "viscous_friction": (
        View(
            "torque",
            "speed",
            "a straight line that falls through zero",
            "It grows with speed, in both directions alike.",
        ),
    ),
    "friction_temperature": (
        View(
            "torque",
            "temperature",
            "a straight line that rises with temperature, through zero at 20 degC",
            "A step at zero speed as of `friction_level`, which only recordings at several temperatures tell from it.",
            rows="ahead",
        ),
    ),
    "stribeck": (
        View(
            "torque",
            "speed",
            "a step down at zero speed that has died away at four times w_s",
            "It shows at low speed alone, and has the sign of the motion.",
        ),
    ),
    "friction_asymmetry": (
        View(
            "torque",
            "speed",
            "the same constant in both directions",
            "In motion it is the torque of a constant load: T_c a sign(w) sign(w) does not change sign. It grows "
            "with T_c, "
            "a load does not; recordings that do not tell have `load_constant` in its group.",
        ),
    ),
    "load_constant": (
        View(
            "torque",
            "speed",
            "the same constant in both directions",
            "It keeps its sign when the motion turns round, as friction does not; see `friction_asymmetry`.",
        ),
    ),
    "load_spring": (
        View(
            "torque",
            "output",
            "a straight line that falls through zero",
            "It goes with the angle of the user shaft, whatever its speed.",
        ),
    ),
    "inertia": (
        View(
            "torque",
            "acceleration",
            "a straight line that falls through zero",
            "It goes with the acceleration alone.",
            rows="steady",
        ),
    ),
    "backlash": (
        View(
            "position",
            "carried",
            "a loop: constant in either direction of motion, with a straight way across at each turn",
            "The output lags by half of the play, at any torque and speed; a flexible shaft lags by its torque.",
            path=True,
        ),
    ),
    "compliance": (
        View(
            "position",
            "acceleration",
            "a line that falls through zero, with a step of the play",
            "The user shaft lags by its torque, here that of its inertia, and swings after a shock; the play alone "
            "is the same at "
            "any torque.",
            rows="steady",
        ),
    ),
    "bus_voltage": (
        View("bus", "bus_current", "a constant", "It is the same at any current; a resistance goes with the current."),
    ),
    "bus_resistance": (
        View(
            "bus",
            "bus_current",
            "a straight line that falls from zero",
            "It goes with the current that the inverter draws, within 1 ms.",
        ),
    ),
    "control_delay": (
        View(
            "control",
            "time",
            "pulses where the motion turns round and the demanded current changes fast, little elsewhere",
            "It shows where the demand changes and nowhere else; a gain that is off shows wherever there is an "
            "error of the speed.",
            path=True,
        ),
    ),
    "hall_displacement": (
        View(
            "commutation",
            "edge",
            "a hump about the edge, of another sign and size in each phase",
            "It shows in the intervals of a commutation alone, by another angle in each phase.",
            "phases",
        ),
    ),
}


@dataclass(frozen=True)
class FormView:
    """How a form is drawn: its shape and coefficients in the torque, alone or times the direction of motion."""

    along: str
    shape: Mapping[str, float]
    coefficients: Sequence[float]
    seen: str
    apart: str
    against_motion: bool = False
    until: float = np.inf  # of the coordinate


FORM_VIEWS = {
    "order": FormView(
        "angle",
        {"order": 2.4},
        (FORM_SIZE, 0.0),
        "a wave of 2.4 periods in each turn of the rotor",
        "It keeps its phase along the angle at all speeds and in all recordings.",
        until=8.0 * np.pi,
    ),
    "frequency": FormView(
        "time",
        {"frequency": 8.0},
        (FORM_SIZE, 0.0),
        "a wave of 8 Hz",
        "It keeps its frequency whatever the speed, and has another phase in each recording.",
    ),
    "bump": FormView(
        "turn",
        {"centre": 2.0, "width": 0.3},
        (-FORM_SIZE,),
        "one dip about 2 rad, nothing elsewhere in the turn",
        "It is at one place of the turn; a wave goes all round.",
    ),
    "step_change": FormView(
        "time",
        {"time": 0.5},
        (FORM_SIZE,),
        "zero before 0.5 s and a constant after",
        "It comes at one time of the recording, and stays.",
    ),
    "pulse": FormView(
        "time",
        {"time": 0.3, "until": 0.6},
        (FORM_SIZE,),
        "a constant from 0.3 s to 0.6 s, zero before and after",
        "It comes at one time of the recording and goes at another, as a load that a bench applies for a while.",
    ),
    "function": FormView(
        "speed",
        {"coordinate": 0.0, "from": -160.0, "to": 160.0},
        tuple(function.BALANCED.T @ (FORM_SIZE * np.array([0.6, -0.8, 0.4, 0.8, -0.4, -0.6]))),
        "a smooth curve through six values",
        "It has one value for each speed (or current, output angle, time, temperature), but no simple law.",
    ),
    "power": FormView(
        "speed",
        {"exponent": 2.0},
        (-FORM_SIZE,),
        "a drag that grows with the square of the speed",
        "It is curved where viscous friction is straight, and zero at zero speed where dry friction jumps.",
        True,
    ),
    "memory": FormView(
        "time",
        {"source": float(memory.SOURCES.index("speed")), "time_constant": 0.3},
        (FORM_SIZE,),
        "a rise from zero that follows the speed late and smoothed",
        "It depends on what went before: the same speed, later in the recording, has another value.",
    ),
    "travel": FormView(
        "time",
        {"length": 3.0},
        (FORM_SIZE,),
        "a drag that is there against the motion once the rotor has turned by some radians since it turned round",
        "It changes with the travel since the last reversal, however long that took; dry friction jumps at once.",
    ),
}

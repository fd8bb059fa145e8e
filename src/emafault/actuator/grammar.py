"""What may act that no catalogue lists: places, forms and their parameters, as a configuration names them.

An entry of ``unlisted`` in a configuration has a place, a form and the form's parameters. In the machine it acts in the
simulated physics (``unlisted.py``), in the measuring chain on what is recorded (``chain.py``), in the controller on its
command (``commands.py``).
"""

from collections.abc import Mapping
from typing import Any

PHASES = ("a", "b", "c")
#: place in the machine, in the order of the simulations' terms -> unit of what a form adds there: to the driving
#: torque, to a phase's back-EMF coefficient as a share of it, to its resistance, to the torque against the motion, to
#: the electrical torque and to the rotor's inertia as a share of each, to back-EMF coefficient and resistance of all
#: phases, and to the driving torque in proportion to the speed and to its square, of 100 rad/s each
MACHINE = {
    "torque": "N m", **{f"emf_{j}": "1" for j in PHASES}, **{f"resistance_{j}": "ohm" for j in PHASES}, "drag": "N m",
    "torque_constant": "1", "inertia": "1", "back_emf": "1", "resistance": "ohm",
    "torque_by_speed": "N m", "torque_by_speed_squared": "N m",
}  # fmt: skip
#: what stands in the record of a run: the shape of the back-EMF of all phases, each along its own electrical angle, and
#: the windings of single phases -> unit of what a form adds to it
IN_RUN = {"emf": "1", "winding": "1"}
#: several channels that another logger may record, with a clock that is not that of the rest
LOGGERS = {"positions": ("angle", "output"), "motion": ("angle", "output", "speed")}
#: channel of the measuring chain -> its unit; without a phase, that of all three
CHANNELS = {
    "voltage": "V", **{f"voltage_{j}": "V" for j in PHASES}, "current": "A", **{f"current_{j}": "A" for j in PHASES},
    "speed": "rad/s", "angle": "rad", "output": "rad", "bus_voltage": "V",
    **dict.fromkeys(LOGGERS, "1"),
}  # fmt: skip
#: what multiplies a signal in the measuring chain -> its unit: a channel's relative gain, a voltage in proportion to
#: speed times the shape of the back-EMF, an output position in proportion to the direction or the acceleration
FACTORS = {
    "speed_scale": "1", **{f"current_gain_{j}": "1" for j in PHASES},
    **{f"voltage_per_speed_{j}": "V s/rad" for j in PHASES}, "output_play": "rad", "output_twist": "rad s2",
}  # fmt: skip
#: what a controller may do with its command before it compares it -> unit
CONTROLLER = {"command": "1"}
PLACES = MACHINE | IN_RUN | CHANNELS | FACTORS | CONTROLLER
#: what a ``function`` goes along -> its unit; the rotor's speed, the current of the phases that conduct (half the sum
#: of the magnitudes), the angle turned since the start over the gear ratio, time, the initial winding temperature
COORDINATES = {"rotor_speed": "rad/s", "current": "A", "output_angle": "rad", "time": "s", "temperature": "degC"}
#: of a memory: (current / 2)^2 (A2), magnitude of the speed over 100 rad/s, one from the start of the recording, and
#: what is left of one that is there at the start
SOURCES = ("loss", "speed", "start", "decay")
KNOTS = 6  # of a function, equally spaced
MOST_TERMS = 8  # in the machine

ANY, _SMALLEST = (-1e6, 1e6), 1e-6
#: parameter -> lowest and highest value, unit; without one it has the place's
PARAMETERS: dict[str, tuple[float, float, str]] = {
    "amplitude": (*ANY, ""), "jump": (*ANY, ""), "at_100_rad_s": (*ANY, ""), "depth": (*ANY, ""), "gain": (*ANY, ""),
    "growth": (*ANY, ""), "at_start": (*ANY, ""), "at_end": (*ANY, ""), "drop": (*ANY, "V"),
    "turn": (_SMALLEST, 1e6, "A"), "step": (_SMALLEST, 1e6, ""), "level": (_SMALLEST, 1e6, ""),
    "order": (_SMALLEST, 1000.0, "1"), "frequency": (_SMALLEST, 1e4, "Hz"), "phase": (*ANY, "rad"),
    "time": (0.0, 3600.0, "s"), "until": (0.0, 3600.0, "s"),
    "exponent": (0.01, 10.0, "1"), "centre": (*ANY, "rad"), "width": (1e-3, 10.0, "rad"),
    "time_constant": (1e-4, 1e6, "s"), "length": (1e-3, 1e6, "rad"), "lag": (-1.0, 1.0, "recording intervals"),
    "delay": (0.0, 100.0, "recording intervals"), "every": (2.0, 200.0, "recording intervals"),
    "bend": (-0.5, 0.5, "1 at full range"), "halves": (-0.5, 0.5, "1"), "dead": (*ANY, ""),
    "share": (0.0, 0.5, "1"), "samples": (1.0, 200.0, "1"), "scatter": (1e-9, 0.1, "s"),
    "late": (-100.0, 100.0, "recording intervals"), "rate": (-0.1, 0.1, "1"),
    "from": (*ANY, ""), "to": (*ANY, ""),
}  # fmt: skip
SHARE = 0.9  # largest, of what a form adds as a share
#: form -> its parameters; SI. What they mean: ``unlisted.SHAPES`` and ``chain``
SHAPES = {
    "order": ("amplitude", "order", "phase"), "frequency": ("amplitude", "frequency", "phase"),
    "step_change": ("jump", "time"), "pulse": ("jump", "time", "until"), "power": ("at_100_rad_s", "exponent"),
    "bump": ("depth", "centre", "width"),
    "memory": ("gain", "time_constant", "source"), "function": ("along", "from", "to", "values"),
    "travel": ("amplitude", "length"),
}  # fmt: skip
OF_CHANNELS = {
    "drift": ("at_start", "at_end"), "lag": ("lag",), "smoothing": ("delay",), "low_pass": ("delay",),
    "butterworth": ("delay",), "averaging": ("samples",),
    "sensor_curve": ("bend", "halves", "dead"), "gain": ("gain", "growth"), "drop": ("drop", "turn"),
    "crosstalk": ("source", "gain"), "pickup": ("gain",),
    "spikes": ("share", "level"), "held": ("share",), "hold": ("every",), "clipping": ("level",), "adc_step": ("step",),
    "clock": ("scatter", "late", "rate"),
}  # fmt: skip
#: a first-order filter, and the command's speed added to the demanded speed, times a gain
OF_CONTROLLER = {"command_filter": ("time_constant",), "feedforward": ("gain",)}
#: orders, per electrical turn, of what the shape of the back-EMF may have beside its trapezoid: sin(n x) each, which
#: is all that a shape has whose halves mirror one another
ORDERS = (3, 5, 7, 9, 11, 13)
OF_SHAPE = {"harmonics": tuple(f"h{n}" for n in ORDERS)}
#: shares by which phases' back-EMF coefficients and inductances differ from what their turns make of those of all
OF_WINDING = {"coefficient": tuple(f"{name}_{j}" for name in ("back_emf", "inductance") for j in PHASES)}
FORMS = SHAPES | OF_CHANNELS | OF_CONTROLLER | OF_SHAPE | OF_WINDING
#: parameters that may be left out: the phase of a wave in time is then another one in each run, a drift from nothing, a
#: gain that stays, a harmonic that is not there, a coefficient that does not differ, what a clock does not do, in what
#: way a curve is not bent
OPTIONAL = {
    "frequency": ("phase",), "drift": ("at_start",), "gain": ("growth",), "harmonics": OF_SHAPE["harmonics"],
    "coefficient": OF_WINDING["coefficient"], "clock": OF_CHANNELS["clock"],
    "sensor_curve": OF_CHANNELS["sensor_curve"],
}  # fmt: skip
#: an entry's values of single recordings, by name: they go before its own where that recording is replayed
EACH = "recordings"


def forms_at(place: str) -> list[str]:
    """Forms that a place may have."""
    if place in CONTROLLER:
        return list(OF_CONTROLLER)
    if place in IN_RUN:
        return list(OF_SHAPE if place == "emf" else OF_WINDING)
    if place in LOGGERS:
        return ["clock"]
    shapes = [form for form in SHAPES if form != "travel" or place == "torque"]
    if place not in CHANNELS:
        return shapes
    quantity, _, phase = place.partition("_")
    phased = quantity in ("voltage", "current")
    only = {
        "crosstalk": phased and phase in PHASES, "sensor_curve": phased, "gain": phased or quantity == "output",
        "drop": quantity == "voltage", "pickup": quantity == "current",
        "drift": phase in PHASES or quantity in ("speed", "angle", "output", "bus"),
        "clock": quantity in ("angle", "output", "speed"),
    }  # fmt: skip
    return [*shapes, *(form for form in OF_CHANNELS if only.get(form, True))]


def of_recording(entry: Mapping[str, Any], recording: str) -> dict[str, Any]:
    """An entry with the values that a recording has of its own, by the recording's name."""
    own = entry.get(EACH, {}).get(recording, {})
    return {key: value for key, value in entry.items() if key != EACH} | dict(own)

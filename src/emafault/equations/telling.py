"""Described forms in words and physical units: what a driver of an equation, a channel or a coefficient is."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..diagnosis.described import Described
from ..diagnosis.forms import FORMS, function, memory
from .coordinates import COEFFICIENTS, SWEPT, typical_torque

EQUATION = {"commutation": "control"}  # of a block -> of the verdict
Z = 1.645  # standard deviations of a 90 % interval
APART = 3.0  # standard deviations from nominal at which a controller's setting is told as different
TELLING = 0.02  # of a setting: smaller differences are not worth telling
SHARED = ("speed_gain", "speed_integral_gain", "speed_limit")  # settings that a remainder of the control law may have
SETTING = {"hysteresis": "half hysteresis band"}  # words, where the name has others
WORDS = {
    "loss": "builds up with the copper loss", "speed": "builds up with the speed",
    "start": "builds up with the time since the start", "decay": "is there at the start and goes",
}  # fmt: skip


def subject(form: Described, actuator: ActuatorParameters) -> tuple[str, str, float]:
    """What has the form, its unit, and the factor from a coefficient to that unit."""
    if form.channel == "R":
        return "the resistance of all phases", "ohm", 1.0
    if form.channel in COEFFICIENTS:
        of = f"phase {form.channel[-1]}" if form.channel != "k" else "all phases"
        return f"the back-EMF coefficient of {of}, as a share of it,", "1", 1.0
    if form.channel:
        quantity, _, phase = form.channel.partition("_")
        words = {
            "angle": "the recorded rotor angle", "output": "the recorded output position",
            "voltage": "each of the recorded voltages",
        }  # fmt: skip
        units = {"angle": "rad", "output": "rad", "voltage": "V"}
        return words.get(quantity, f"the recorded {quantity} of phase {phase}"), units.get(quantity, "A"), 1.0
    torque = typical_torque(actuator)
    if form.equation.startswith("electrical"):
        phase = form.equation[-1]
        return (
            (
                f"the recorded voltage of phase {phase}" if _of_a_clock(form) else f"a voltage of phase {phase}",
                "V",
                1.0,
            ),
            (f"the resistance of phase {phase}", "ohm", 1.0),
            (f"the back-EMF coefficient of phase {phase}", "V s/rad", SWEPT),
        )[form.driver]
    known = {
        "torque": (
            ("a torque", "N m", 1.0), ("a drag against the motion", "N m", -1.0),
            ("the torque constant, as a share of it,", "1", 1.0 / torque),
            ("the inertia, as a share of it,", "1", -1.0 / torque),
            ("a torque in proportion to the speed, of 100 rad/s,", "N m", 1.0),
            ("a torque in proportion to the square of the speed, of 100 rad/s,", "N m", 1.0),
        ),
        "sensor_speed": (("the recorded speed", "rad/s", 1.0), ("the scale of the recorded speed", "1", 0.01)),
        "sensor_current": (
            ("each of the recorded currents", "A", 1.0 / 3.0),
            ("the gain of current a against c", "1", 1.0), ("the gain of current b against c", "1", 1.0),
        ),
        "position": (
            ("the output position", "rad", 1.0), ("the play of the output position", "rad", 1.0),
            ("the twist of the output by its acceleration", "rad s2", 1e-3),
        ),
        "bus": (("the bus voltage", "V", 1.0), ("the bus resistance", "ohm", 1.0)),
    }  # fmt: skip
    return known[form.equation][form.driver]


def bare(what: str) -> str:
    """A subject as a label has it: without article and comma."""
    return what.removeprefix("a ").removeprefix("the ").rstrip(",")


def told(form: Described, linear: Mapping[str, tuple[float, float]], actuator: ActuatorParameters) -> dict[str, Any]:
    """A described form as the verdict tells it: where, along what, its parameters with 90 % intervals and a sentence.

    ``linear``: coefficients and their standard deviations by name.
    """
    module = FORMS[form.word]
    what, units, factor = subject(form, actuator)
    parameters: dict[str, dict] = {
        n: {"value": v, "low": v - Z * sd, "high": v + Z * sd, "units": u} for n, v, sd, u in form.shape if u
    }
    values = factor * np.array([v for v, _ in linear.values()])
    spread = abs(factor) * float(np.sqrt(np.mean([sd**2 for _, sd in linear.values()])))
    warms_up = _warms_up(form)
    for name, value in module.told(values, form.values).items():
        name = "offset" if warms_up else name
        angle = name == "phase"
        width = Z * (spread / max(float(np.hypot(*values[:2])), 1e-12) if angle else spread)
        parameters[name] = {
            "value": value,
            "low": value - width,
            "high": value + width,
            "units": "rad" if angle else units,
        }
    where, along = place(form), _along(form)
    return {
        "equation": where, "along": along,
        "form": _word(form), "parameters": parameters,
        "sentence": _sentence(form, where, what, {n: (p["value"], p["units"]) for n, p in parameters.items()}, along),
    }  # fmt: skip


def differing_settings(verdict: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Settings of the controller, as a verdict has them, that are told as different from the nominal ones."""
    left = any(d.get("unit") == "remainder:control" for d in verdict["discovered"])
    out = {}
    for name, g in verdict["controller"].items():
        if left and name in SHARED:
            continue  # what nothing describes may be their doing, or take their place
        apart, sd = abs(g["value"] - g["nominal"]), (g["high"] - g["low"]) / (2.0 * Z)
        if apart > APART * sd and apart > TELLING * g["nominal"]:
            out[name] = g
    return out


def setting(name: str) -> str:
    """A setting of the controller in words."""
    return SETTING.get(name, name.replace("_", " "))


def place(form: Described) -> str:
    """Equation that the verdict tells a form in: no winding has a clock, a voltage along time is its channel's."""
    if form.equation.startswith("electrical") and _of_a_clock(form):
        return "sensor_voltage"
    return EQUATION.get(form.equation, form.equation)


def _along(form: Described) -> str:
    if form.word == "function":
        return tuple(function.COORDINATES)[int(form.values["coordinate"])]
    return str(FORMS[form.word].ALONG)


def _of_a_clock(form: Described) -> bool:
    """Whether it adds something that goes with time alone."""
    source = memory.SOURCES[int(form.values["source"])] if form.word == "memory" else "start"
    adds = form.channel not in COEFFICIENTS if form.channel else form.driver == 0
    return adds and _along(form) == "time" and source in memory.OF_TIME


def _warms_up(form: Described) -> bool:
    """Whether it is a channel that settles once it is switched on."""
    return form.word == "memory" and _of_a_clock(form) and form.equation != "torque"


def _word(form: Described) -> str:
    """A form's word in the verdict."""
    if _warms_up(form):
        return "drift"
    if form.word == "function" and form.driver:
        return "coefficient"
    return {"power": "function", "travel": "memory", "pulse": "step_change"}.get(form.word, form.word)


def picture(form: Described, found: Mapping[str, list[float]], actuator: ActuatorParameters) -> dict[str, Any]:
    """A form's curve in physical units, with what its axes are."""
    at_place = replace(form, channel="", equation=form.seen or form.equation)
    what, units, factor = subject(at_place, actuator)
    axis = FORMS[form.word].AXIS
    if form.word == "function":
        along = tuple(function.COORDINATES)[int(form.values["coordinate"])]
        axis = f"{along.replace('_', ' ')} ({function.COORDINATES[along]})"
    scaled = {n: [factor * v for v in found[n]] for n in ("before", "after")}
    label = bare(what) + ("" if units == "1" else f" ({units})")
    return {
        "x": found["x"], **scaled, "error": [abs(factor) * e for e in found["error"]],
        "x_label": axis, "y_label": label,
    }  # fmt: skip


def _sentence(form: Described, where: str, what: str, found: Mapping[str, tuple[float, str]], along: str) -> str:
    def of(name: str) -> str:
        value, units = found[name]
        return f"{value:.3g}" if units == "1" else f"{value:.3g} {units}"

    place = "In the measuring chain" if where.startswith("sensor") else f"In the {where.replace('_', ' ')} equation"
    if form.word == "order":
        often = "once" if (times := f"{found['order'][0]:.4g}") == "1" else f"{times} times"
        says = f"{what} has a wave {often} per turn of the rotor, with an amplitude of {of('amplitude')}"
    elif form.word == "frequency":
        says = f"{what} oscillates at {of('frequency')} with an amplitude of {of('amplitude')}"
    elif form.word == "bump":
        size, units = found["depth"]
        more = "higher" if size > 0 else "lower"
        height = f"{abs(size):.3g}" + ("" if units == "1" else f" {units}")
        says = f"{what} is {height} {more} about {of('centre')} of the turn, over {of('width')}"
    elif form.word == "step_change":
        says = f"{what} jumps by {of('jump')} at {of('time')}"
    elif form.word == "pulse":
        says = f"{what} changes by {of('jump')} from {of('time')} to {of('until')}"
    elif form.word == "power":
        says = (
            f"{what} goes with the speed to the power of {found['exponent'][0]:.3g}, {of('at_100_rad_s')} at 100 rad/s"
        )
    elif form.word == "memory":
        source = memory.SOURCES[int(form.values["source"])]
        by = f"drifts by {of('offset')} from the start" if "offset" in found else WORDS[source]
        says = f"{what} {by}, with a time constant of {of('time_constant')}"
    elif form.word == "travel":
        says = f"a drag of {of('amplitude')} builds up anew after each reversal, over a travel of {of('length')}"
    else:
        knots = [found[n] for n in function.VALUES]
        low, high = min(v for v, _ in knots), max(v for v, _ in knots)
        unit = "" if knots[0][1] == "1" else f" {knots[0][1]}"
        says = (
            f"{what} goes with the {along.replace('_', ' ')} from {of('from')} to {of('to')}, "
            f"between {low:z.3g} and {high:z.3g}{unit}"
        )
    return f"{place}: {says}."

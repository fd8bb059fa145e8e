"""Faults of the measuring chain that have parameters of their own, what a controller does with its command and the
shape of the back-EMF, in words: one function a kind."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import hypot
from typing import Any

from ..actuator.parameters import ActuatorParameters
from .acquisition import CURVES, GAIN_NAMES, RATE, full_range
from .sensor_speed import SENSOR
from .telling import Z

LATE = {
    "late": "comes late by {late:.2g} intervals", "early": "comes early by {late:.2g} intervals",
    "smoothed": "is smoothed with a memory of {late:.2g} intervals",
    "filtered": "is behind a first-order filter with a time constant of {late:.2g} intervals",
    "butterworth": "is behind a second-order Butterworth filter that delays it by {late:.2g} intervals",
    "averaged": "is averaged over {samples:.2g} samples, and comes late by {late:.2g} intervals",
}  # fmt: skip
CHANNELS = {
    "output": "output position",
    "bus_voltage": "bus voltage",
    SENSOR: "speed sensor's",
}  # words of those that have others
LOGGERS = {"positions": "logger of angle and output position", "motion": "logger of angle, output position and speed"}
CONTROLLER = {
    "filter": "the command passes a first-order filter with a time constant of {:.2g} s",
    "feedforward": "{:.2g} of the command's speed is fed forward to the demanded speed",
}
WINDING = {"back_emf": "back-EMF coefficient", "inductance": "inductance"}
CHAIN = "In the measuring chain"
SUPPLY = "In the supply, or in the channel of its voltage"


@dataclass(frozen=True)
class Fault:
    """A fault as fitted: its channel, and by name of a parameter its value, standard deviation and unit."""

    channel: str
    linear: Mapping[str, tuple[float, float]]
    units: Mapping[str, str]
    actuator: ActuatorParameters

    @property
    def values(self) -> dict[str, float]:
        """By name."""
        return {n: v for n, (v, _) in self.linear.items()}

    @property
    def whose(self) -> str:
        """The channel in words."""
        return channel_in_words(self.channel)


@dataclass(frozen=True)
class Told:
    """What a verdict tells of a fault: a clause, what it goes along, its form, where it lies, and other names of its
    parameters."""

    says: str
    form: str
    along: str = "time"
    where: str = CHAIN
    names: Mapping[str, str] = field(default_factory=dict)


def told_of_chain(
    unit: str,
    equation: str,
    linear: Mapping[str, tuple[float, float]],
    units: Mapping[str, str],
    actuator: ActuatorParameters,
) -> dict[str, Any]:
    """A unit of the measuring chain or of the controller as ``discovered`` tells it.

    Parameters
    ----------
    equation : of the verdict
    linear : coefficients and their standard deviations by name
    """
    kind, _, channel = unit.removeprefix("~").partition("_")
    told = KINDS[kind](Fault(channel, linear, units, actuator))
    said = {
        told.names.get(n, n): {"value": v, "low": v - Z * sd, "high": v + Z * sd, "units": units[n]}
        for n, (v, sd) in linear.items()
    }
    return {
        "equation": equation, "along": told.along, "form": told.form, "parameters": said,
        "sentence": f"{told.where}: {told.says}.",
    }  # fmt: skip


def channel_in_words(name: str) -> str:
    """A channel, of all phases or of one."""
    quantity, _, phase = (name, "", "") if name in CHANNELS else name.partition("_")
    return f"{CHANNELS.get(quantity, quantity)} channel" + (f" of phase {phase}" if phase else "")


def of_phase(quantity: str, phase: str) -> str:
    """A channel of one phase, or of all."""
    return f"{quantity} of phase {phase}" if phase else f"{quantity}s"


def _curve(fault: Fault) -> Told:
    ((at, amount),) = ((n, v) for n, v in fault.values.items() if n != "dead.turn")
    kind, phase = at.partition(".")[0], at.partition("_")[2]
    unit = "V" if fault.channel == "voltage" else "A"
    which = f"the recorded {of_phase(fault.channel, phase)} {'has' if phase else 'have'}"
    side = "low" if amount > 0.0 else "high"
    if kind == "halves":
        says = (
            f"{which} a gain larger by {200.0 * abs(amount):.2g} % where {'positive' if amount > 0.0 else 'negative'}"
        )
    elif kind == "dead":
        says = f"{which} a dead band: {abs(amount):.2g} {unit} too {side} in size"
    else:
        full = f"{full_range(fault.actuator, fault.channel):g} {unit}"
        says = f"{which} a cubic nonlinearity, {100.0 * abs(amount):.2g} % too {side} at {full}"
    along = "current" if fault.channel == "current" else "time"
    return Told(says, "sensor_curve", along, names={at: CURVES[kind], "dead.turn": "turn"})


def _drop(fault: Fault) -> Told:
    ((at, amount),) = ((n, v) for n, v in fault.values.items() if n != "drop.turn")
    phase = at.partition("_")[2]
    high = f"{abs(amount):.2g} V too {'high' if amount > 0.0 else 'low'}"
    why = "as one is that is computed of duty cycles without the drop of the switches and their dead time"
    which = f"the recorded {of_phase('voltage', phase)} {'is' if phase else 'are'}"
    says = f"{which} {high} in the current's direction, {why}"
    return Told(says, "sensor_curve", "current", names={at: "drop", "drop.turn": "turn"})


def _controller(fault: Fault) -> Told:
    (amount,) = fault.values.values()
    return Told(CONTROLLER[fault.channel].format(amount), "controller", where="In the control equation")


def _harmonics(fault: Fault) -> Told:
    sizes = [f"{100.0 * v:.2g} % of order {n.rpartition('.h')[2]}" for n, v in fault.values.items()]
    listed = ", ".join(sizes[:-1]) + " and " * (len(sizes) > 1) + sizes[-1]
    says = f"the back-EMF of all phases has harmonics beside its trapezoid, {listed}"
    return Told(says, "coefficient", "rotor_angle", "In the electrical equation")


def _coefficient(fault: Fault) -> Told:
    parts = []
    for full, share in fault.values.items():
        name, _, phase = full.partition(".")[2].rpartition("_")
        size = f"{100.0 * abs(share):.2g} % too {'high' if share > 0.0 else 'low'}"
        parts.append(f"the {WINDING[name]} of phase {phase} is {size}")
    says = f"{', '.join(parts)} for its turns and the coefficients of all phases"
    return Told(says, "coefficient", "current", "In the electrical equation")


def _saliency(fault: Fault) -> Told:
    size = hypot(*fault.values.values())
    says = f"the inductances go with the rotor's angle (saliency), by {100.0 * size:.2g} % twice per turn of the field"
    return Told(says, "coefficient", "rotor_angle", "In the electrical equation")


def _mutual(fault: Fault) -> Told:
    mean = sum(fault.values.values()) / len(fault.values)
    sizes = [f"{100.0 * (v - mean):+.2g} % between {n[-2]} and {n[-1]}" for n, v in fault.values.items()]
    says = "the inductances between phases differ from their mean, over that of one phase: " + ", ".join(sizes)
    return Told(says, "coefficient", "current", "In the electrical equation")


def _ambient(fault: Fault) -> Told:
    above = fault.values.values()
    ends = f"{min(above):z.2g} to {max(above):z.2g} K above the recorded ambient temperature"
    return Told(f"at the start of the recordings the machine is {ends}", "drift", "temperature")


def _load(fault: Fault) -> Told:
    loads = fault.values.values()
    ends = f"from {min(loads):z.2g} to {max(loads):z.2g} N m at the rotor"
    return Told(f"a constant load differs between recordings, {ends}", "drift", where="In the torque equation")


def _crosstalk(fault: Fault) -> Told:
    ((name, gain),) = fault.values.items()
    if name.startswith("pickup."):
        which = name.partition("_")[2]
        whose = f"channel of phase {which} picks" if which else "channels pick"
        return Told(f"the current {whose} up {1e3 * gain:.2g} mA per volt of the phase's voltage", "crosstalk")
    phases, what = name.rpartition(".")[2], fault.channel
    takes_up = f"takes up {100.0 * gain:.2g} % of the {what} of phase {phases[1]}"
    return Told(f"the {what} channel of phase {phases[0]} {takes_up}", "crosstalk")


def _drift(fault: Fault) -> Told:
    if fault.channel == "bus_voltage":
        return Told(f"the {_drifts(fault, CHANNELS[fault.channel])}", "drift", where=SUPPLY)
    return Told(f"the {_drifts(fault, fault.whose)}", "drift")


def _drifts(fault: Fault, whose: str) -> str:
    unit = next(iter(fault.units.values()))
    if all("@" not in n for n in fault.linear):
        says = {"offset": "has an offset of {:.2g} {}", RATE: "drifts by {:.2g} {}"}
        parts = [says[n.partition("_")[0]].format(v, fault.units[n]) for n, v in fault.values.items()]
        return f"{whose} {' and '.join(parts)}"
    starts = [v for n, v in fault.values.items() if n.startswith("offset")]
    if not starts:
        grows = [v for n, v in fault.values.items() if n.startswith("drift")]
        return f"{whose} drifts along each recording, by {min(grows):z.2g} to {max(grows):z.2g} {unit}"
    ends = f"from {min(starts):z.2g} to {max(starts):z.2g} {unit}"
    also = ", and drifts within them" * (len(starts) < len(fault.linear))
    return f"offset of the {whose} differs between recordings, {ends}{also}"


def _gain(fault: Fault) -> Told:
    first = next(iter(fault.linear))
    phase = first.partition(".")[2].partition("@")[0]
    gains = list(fault.values.values())
    if first.startswith(GAIN_NAMES[1]):
        whose = of_phase(fault.channel, "" if phase == "all" else phase)
        ends = f"by {100.0 * min(gains):+z.2g} to {100.0 * max(gains):+z.2g} %"
        return Told(f"the gain of the recorded {whose} drifts along each recording, {ends} to its end", "drift")
    against = ""
    if phase == "all":  # told against one recording, which has none
        phase, against = "", " from that in one of them"
        gains.append(0.0)
    ends = f"by {100.0 * min(gains):+z.2g} to {100.0 * max(gains):+z.2g} %{against}"
    whose = of_phase(fault.channel, phase)
    return Told(f"the gain of the recorded {whose} differs between recordings, {ends}", "drift")


def _scale(fault: Fault) -> Told:
    ((at, gain),) = fault.values.items()
    size = f"{100.0 * abs(gain):.2g} % too {'large' if gain > 0.0 else 'small'}"
    also = ", and the controller sees it so" * at.endswith("sensor")
    return Told(f"the output position is recorded {size}{also}", "sensor_curve", "output_angle")


def _lag(fault: Fault) -> Told:
    ((at, amount),) = fault.values.items()
    channel, _, way = at.partition(".")[2].rpartition("_")
    also = ", and the controller sees it so" * (channel == SENSOR)
    says = LATE[way].format(late=amount, samples=1.0 + 2.0 * amount)
    return Told(f"the {fault.whose} {says}{also}", "lag")


def _clock(fault: Fault) -> Told:
    starts = [v for n, v in fault.values.items() if "@" in n]
    ends = f"{min(starts):z.2g} to {max(starts):z.2g} intervals" if starts else ""
    parts = [f"comes late by another amount in each recording, {ends}"] if starts else []
    parts += [
        f"has a clock that is {'slow' if v > 0.0 else 'fast'} by {1e6 * abs(v):.3g} ppm"
        for n, v in fault.values.items() if "@" not in n
    ]  # fmt: skip
    whose = LOGGERS.get(fault.channel, fault.whose)
    return Told(f"the {whose} {', and '.join(parts)}", "clock")


KINDS: dict[str, Callable[[Fault], Told]] = {
    "lag": _lag, "clock": _clock, "crosstalk": _crosstalk, "curve": _curve, "drop": _drop, "drift": _drift,
    "gain": _gain, "scale": _scale, "harmonics": _harmonics,
    "coefficient": _coefficient, "saliency": _saliency, "mutual": _mutual,
    "ambient": _ambient, "load": _load, "controller": _controller,
}  # fmt: skip

"""What a diagnosis describes, as entries of ``unlisted`` in a configuration, which both simulators have.

What cannot be an entry is None: an undescribed remainder, spikes, whose size is not estimated, and a resistance of the
bus that changes.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from ..actuator.grammar import EACH, PHASES
from ..actuator.parameters import ActuatorParameters
from ..diagnosis.described import Described
from ..diagnosis.forms import FORMS, function, memory
from .acquisition import CURVES, GAIN_NAMES, RATE
from .coordinates import COEFFICIENTS
from .parameters import BEYOND
from .sensor_speed import SENSOR
from .telling import subject

Entry = dict[str, Any]
#: equation -> place of what multiplies each of its drivers
DRIVERS: dict[str, tuple[str, ...]] = {
    **{f"electrical_{j}": (f"voltage_{j}", f"resistance_{j}", f"voltage_per_speed_{j}") for j in PHASES},
    "torque": ("torque", "drag", "torque_constant", "inertia", "torque_by_speed", "torque_by_speed_squared"),
    "sensor_speed": ("speed", "speed_scale"),
    "sensor_current": ("current", "current_gain_a", "current_gain_b"),
    "position": ("output", "output_play", "output_twist"),
    "bus": ("bus_voltage",),
}  # fmt: skip
#: what a controller does with its command, of a size
CONTROLLER: dict[str, Callable[[float], Entry]] = {
    "filter": lambda x: {"form": "command_filter", "time_constant": x},
    "feedforward": lambda x: {"form": "feedforward", "gain": x},
}
#: how a channel comes late -> form
SMOOTH = {"smoothed": "smoothing", "filtered": "low_pass", "butterworth": "butterworth"}
LATE_SENSOR = f"lag.{SENSOR}_"  # beginning of the names of what comes late before the controller takes it


def of_form(
    form: Described,
    linear: Mapping[str, tuple[float, float]],
    recordings: Sequence[str],
    actuator: ActuatorParameters,
) -> Entry | None:
    """Entry of a described form.

    Parameters
    ----------
    linear : coefficients and their standard deviations by name
    recordings : names, of those that have coefficients of their own
    """
    if form.channel:
        place = COEFFICIENTS.get(form.channel, form.channel)
    else:
        places = DRIVERS.get(form.equation, ())
        if form.driver >= len(places):
            return None
        place = places[form.driver]
    factor = subject(form, actuator)[2]
    module = FORMS[form.word]

    def told(recording: str) -> dict[str, float]:
        values = factor * np.array([linear[n][0] for n in form.names(recording) if n in linear])
        found = module.told(values, form.values)
        if "phase" in found:  # a wave is told by where it is highest
            found["phase"] = -found["phase"]
        return found

    entry: Entry = {"place": place, "form": form.word}
    shape = dict(form.values)
    if form.word == "function":
        entry["along"] = tuple(function.COORDINATES)[int(shape.pop("coordinate"))]
        shape.pop("nothing", None)
        values = told(recordings[0])
        return _rounded(entry | shape | {"values": [values[n] for n in function.VALUES]})
    if form.word == "memory":
        entry["source"] = memory.SOURCES[int(shape.pop("source"))]
    entry |= shape
    if not module.EACH:
        return _rounded(entry | told(recordings[0]))
    own = {}
    for name in recordings:
        pair = factor * np.array([linear[n][0] if n in linear else 0.0 for n in form.names(name)])
        own[name] = {"amplitude": float(np.hypot(*pair)), "phase": -float(np.arctan2(pair[1], pair[0]))}
    amplitude = float(np.sqrt(np.mean([v["amplitude"] ** 2 for v in own.values()])))
    return _rounded(entry | {"amplitude": amplitude, EACH: own})


def of_chain(unit: str, linear: Mapping[str, tuple[float, float]], lengths: Mapping[str, float]) -> Entry | None:
    """Entry of a unit that has parameters of its own: a lag, crosstalk, drift, curve or drop, the back-EMF's shape.

    ``lengths`` : of the recordings (s), by name
    """
    kind, _, channel = unit.removeprefix("~").partition("_")
    values = {name.partition(".")[2]: v for name, (v, _) in linear.items()}
    if kind == "lag":
        ((name, amount),) = values.items()
        late, _, way = name.rpartition("_")
        if late == SENSOR:  # a channel of the recorder does not make what the controller sees too: see ``of_sensor``
            return None
        if way == "averaged":
            return _rounded({"place": channel, "form": "averaging", "samples": 1.0 + 2.0 * amount})
        if way in SMOOTH:
            return _rounded({"place": channel, "form": SMOOTH[way], "delay": amount})
        return _rounded({"place": channel, "form": "lag", "lag": -amount if way == "early" else amount})
    if kind == "clock":
        starts = {full.partition("@")[2]: {"late": v} for full, (v, _) in linear.items() if "@" in full}
        rates = [v for full, (v, _) in linear.items() if "@" not in full]
        clock: Entry = {"place": channel, "form": kind} | ({"rate": rates[0]} if rates else {})
        return _rounded(clock | ({**_means(starts), EACH: starts} if starts else {}))
    if kind == "crosstalk":
        ((name, (gain, _)),) = linear.items()
        if name.startswith("pickup."):
            return _rounded({"place": name.partition(".")[2], "form": "pickup", "gain": gain})
        pair = name.rpartition(".")[2]
        return _rounded({"place": f"{channel}_{pair[0]}", "form": "crosstalk", "source": pair[1], "gain": gain})
    if kind == "curve":
        ((full, amount),) = ((n, v) for n, (v, _) in linear.items() if n != "dead.turn")
        bent, _, place = full.partition(".")
        return _rounded({"place": place, "form": "sensor_curve", CURVES[bent]: amount})
    if kind == "drop":
        ((place, drop),) = ((n, v) for n, v in values.items() if n != "turn")
        return _rounded({"place": place, "form": "drop", "drop": drop, "turn": values["turn"]})
    if kind in ("harmonics", "coefficient"):
        return _rounded({"place": channel, "form": kind, **values})
    if kind == "controller":
        ((_, amount),) = values.items()
        return _rounded({"place": "command", **CONTROLLER[channel](amount)})
    if kind == "scale":
        ((whose, gain),) = values.items()  # what the controller sees too, a channel of the recorder does not make
        return _rounded({"place": "output", "form": "gain", "gain": gain}) if whose == "recorder" else None
    if kind == "gain":
        phase = next(iter(linear)).partition(".")[2].partition("@")[0]
        growth = next(iter(linear)).startswith(GAIN_NAMES[1])
        gains = {
            full.partition("@")[2]: {"gain": 0.0, "growth": v} if growth else {"gain": v}
            for full, (v, _) in linear.items()
        }
        place = channel if phase == "all" else f"{channel}_{phase}"
        return _rounded({"place": place, "form": "gain", **_means(gains), EACH: gains})
    if kind == "load":
        resisting = {full.partition("@")[2]: {"jump": -v} for full, (v, _) in linear.items()}
        longest = max(lengths.values())
        return _rounded(
            {"place": "torque", "form": "pulse", "time": 0.0, "until": longest, **_means(resisting), EACH: resisting}
        )
    if kind == "drift":
        if all("@" not in full for full in linear):
            alike = {full.partition("_")[0]: v for full, (v, _) in linear.items()}
            start, rate = alike.get("offset", 0.0), alike.get(RATE, 0.0)
            ends = {n: {"at_start": start, "at_end": start + rate * length} for n, length in lengths.items()}
            whole: Entry = {"place": channel, "form": "drift", **_means(ends)}
            return _rounded(whole | ({EACH: ends} if rate and len(set(lengths.values())) > 1 else {}))
        own: dict[str, dict[str, float]] = {}
        for full, (v, _) in linear.items():
            entry = own.setdefault(full.partition("@")[2], {"at_end": 0.0})
            entry["at_end"] += v  # an offset stays
            if full.startswith("offset"):
                entry["at_start"] = v
        return _rounded({"place": channel, "form": "drift", **_means(own), EACH: own})
    return None


def of_sensor(values: Mapping[str, float], interval: float) -> float:
    """Time constant (s) of a filter of the speed that is as late as what the speed's sensor was found to be; recordings
    have an ``interval`` (s)."""
    return interval * sum(x for n, x in values.items() if n.startswith(LATE_SENSOR))


def _means(own: Mapping[str, Mapping[str, float]]) -> dict[str, float]:
    """Of what recordings have of their own, by name; all have the same."""
    return {n: float(np.mean([v[n] for v in own.values()])) for n in next(iter(own.values()))}


def entries(verdict: Mapping[str, Any]) -> list[Entry]:
    """What a verdict describes and the simulators carry."""
    return [d["term"] for d in verdict["discovered"] if d.get("term")]


def left_out(verdict: Mapping[str, Any]) -> list[str]:
    """Sentences of what a verdict describes and the simulators do not carry; values of the catalogue they have."""
    missing = [d for d in verdict["discovered"] if not d.get("term") and not d.get("unit", "").startswith(BEYOND)]
    return [str(d["sentence"]) for d in missing if not any(n.startswith(LATE_SENSOR) for n in d.get("parameters", ()))]


def _rounded(value: Any) -> Any:
    """The same with numbers of eight digits."""
    if isinstance(value, Mapping):
        return {key: _rounded(v) for key, v in value.items()}
    if isinstance(value, list):
        return [_rounded(v) for v in value]
    return float(f"{value:.8g}") if isinstance(value, float) else value

"""What a configuration may hold: one dataclass per group, each field with its unit and its accepted values.

``check`` compares a composed configuration (plain dicts) with these and refuses what does not fit, naming the key, what
it got and what it accepts.
"""

# ruff: noqa: RUF009  (a field with its accepted values is made by a function)

import difflib
import math
import types
import typing
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, is_dataclass, make_dataclass
from typing import Any

from .actuator import grammar
from .actuator.parameters import ECCENTRICITY_LAWS, ActuatorParameters
from .errors import InputError, shown
from .filters import FILTERS


def number(low: float = -math.inf, high: float = math.inf, unit: str = "") -> Any:
    """A number or an integer from ``low`` to ``high``, ends included."""
    return field(metadata={"low": low, "high": high, "unit": unit})


def choice(*accepted: str) -> Any:
    """One of these words; any word if none is given."""
    return field(metadata={"accepted": accepted})


def group() -> Any:
    """A group of its own."""
    return field()


#: smallest number that still counts as positive
POSITIVE = 1e-12
#: what the parameters of an actuator may be; beyond it a simulation would take for ever or mean nothing
_ACTUATOR: dict[str, tuple[float, float, str]] = {
    "bus_voltage": (POSITIVE, 1e4, "V"),
    "resistance": (POSITIVE, 1e4, "ohm"),
    "inductance": (1e-6, 10.0, "H"),
    "back_emf": (POSITIVE, 100.0, "V s/rad"),
    "pole_pairs": (1, 100, ""),
    "inertia": (POSITIVE, 100.0, "kg m2"),
    "viscous_friction": (0.0, 100.0, "N m s/rad"),
    "coulomb_friction": (0.0, 1e4, "N m"),
    "static_over_coulomb": (1.0, 10.0, ""),
    "gear_ratio": (1.0, 1e5, ""),
    "backlash": (0.0, 1.0, "rad"),
    "end_stop": (POSITIVE, 1e4, "rad"),
    "current_limit": (POSITIVE, 1e4, "A"),
    "speed_limit": (POSITIVE, 1e5, "rad/s"),
    "position_gain": (POSITIVE, 1e5, "1/s"),
    "speed_gain": (POSITIVE, 1e4, "A s/rad"),
    "speed_integral_gain": (POSITIVE, 1e6, "A/rad"),
    "hysteresis": (1e-3, 1e3, "A"),
    "switch_resistance": (0.0, 100.0, "ohm"),
    "diode_voltage": (0.0, 100.0, "V"),
    "copper_coefficient": (POSITIVE, 0.1, "1/K"),
    "reference_temperature": (-273.15, 500.0, "degC"),
    "control_period": (1e-6, 1e-2, "s"),
}
_parameters = [(f.name, f.type, number(*_ACTUATOR[f.name])) for f in fields(ActuatorParameters)]
Actuator = make_dataclass("Actuator", _parameters)  # type: ignore[arg-type]


@dataclass
class ShareRange:
    low: float = number(0.0, 0.9)
    high: float = number(0.0, 0.9)


@dataclass
class TemperatureRange:
    low: float = number(-200.0, 500.0, "K")
    high: float = number(-200.0, 500.0, "K")


@dataclass
class LagRange:
    low: float = number(-500.0, 500.0, "K")
    high: float = number(-500.0, 500.0, "K")


@dataclass
class AngleRange:
    low: float = number(0.0, 2.0 * math.pi, "rad")
    high: float = number(0.0, 2.0 * math.pi, "rad")


@dataclass
class Faults:
    law: str = choice(*ECCENTRICITY_LAWS)
    N: ShareRange = group()
    xi: ShareRange = group()
    dT: TemperatureRange = group()


@dataclass
class Magnet:
    coefficient: float = number(-0.005, 0.005, "1/K")
    lag: LagRange = group()


@dataclass
class Load:
    constant: float = number(-1000.0, 1000.0, "N m")
    spring: float = number(0.0, 10000.0, "N m/rad")


@dataclass
class Filter:
    kind: str = choice(*FILTERS)
    cutoff: float = number(1.0, 1e5, "Hz")
    before_noise: bool = group()
    undone: bool = group()


@dataclass
class RecordingConditions:
    duration: float = number(0.2, 3600.0, "s")
    discard: float = number(0.0, 3600.0, "s")
    interval: float = number(1e-5, 1e-2, "s")
    theta_0: AngleRange = group()
    filter: Filter = group()


@dataclass
class Sensors:
    voltage: float = number(0.0, 10.0, "V")
    current: float = number(0.0, 10.0, "A")
    current_end: float = number(0.0, 10.0, "A")
    speed: float = number(0.0, 100.0, "rad/s")
    angle: float = number(0.0, 1.0, "rad")
    position: float = number(0.0, 1.0, "rad")
    bus_voltage: float = number(0.0, 10.0, "V")
    ambient: float = number(0.0, 50.0, "K")


@dataclass
class Known:
    R: float = number(0.0, 1.0, "of R0")
    k: float = number(0.0, 1.0, "of k0")
    L: float = number(0.0, 1.0, "of L0")


@dataclass
class Unit:
    tolerance: float = number(0.0, 4.0, "standard deviations")
    training_tolerance: float = number(0.0, 4.0, "standard deviations")
    reference_recordings: int = number(0, 8)
    spread_of: list[str] | None = group()
    known: Known = group()


@dataclass
class Sampling:
    scheme: str = choice("random", "sobol")
    runs: int = number(20, 10_000_000)
    fresh: int = number(10, 10_000_000)
    seed: int = number(0, 2**31)
    shards: int | None = number(1, 100_000)


@dataclass
class Network:
    layers: int = number(1, 3)
    width: int = number(1, 256)
    activation: str = choice("tanh", "sigmoid", "relu")
    coordinates: str = choice("linear", "log")


@dataclass
class Training:
    optimiser: str = choice("levenberg_marquardt", "adam")
    train_fraction: float = number(0.1, 0.95)
    validation_fraction: float = number(0.01, 0.5)
    epochs: int = number(1, 1_000_000)
    max_fail: int = number(1, 1_000_000)
    weight_decay: float = number(0.0, 1e6)
    reweight: int = number(0, 5)
    learning_rate: float = number(POSITIVE, 10.0)
    batch: int = number(1, 1_000_000)


@dataclass
class Search:
    trials: int = number(0, 1_000_000)
    workers: int = number(1, 64)
    reconstruction: str = choice()
    sampler: str = choice("tpe", "nsga2")
    repeats: int = number(1, 100)
    tolerance: float = number(0.0, 10.0)
    seed: int = number(0, 2**31)
    storage: str | None = choice()
    space: dict[str, dict[str, Any]] = group()


@dataclass
class Evaluation:
    seeds: int = number(1, 100)
    bound_runs: int = number(1, 1_000_000)
    level: float = number(0.5, 0.999)


@dataclass
class Evidence:
    draws: int = number(2, 100_000)
    samples: int = number(19, 9_999)
    seed: int = number(0, 2**31)
    benches: list[int] = number(0, 2**31)
    recordings: int = number(1, 8)


@dataclass
class DesignLimits:
    speed: float = number(POSITIVE, 1e5, "rad/s")
    travel: float = number(POSITIVE, 100.0, "rad")
    supply: float = number(POSITIVE, 1.0, "of the bus voltage")
    heating: float = number(POSITIVE, 500.0, "K")
    heat_capacity: float = number(POSITIVE, 1e6, "J/K")


@dataclass
class Ends:
    low: float = number()
    high: float = number()


@dataclass
class LoadEnds:
    constant: Ends = group()
    spring: Ends = group()


@dataclass
class Design:
    experiment: str = choice()
    lengths: list[float] = number(0.2, 60.0, "s")
    trials: int = number(2, 100_000)
    seed: int = number(0, 2**31)
    faults: int = number(1, 1000)
    fresh: int = number(10, 1_000_000)
    limits: DesignLimits = group()
    load: LoadEnds = group()
    space: dict[str, dict[str, Ends]] = group()


@dataclass
class Several:
    experiments: list[str] = choice()
    counts: list[int] = number(1, 64)
    units: int = number(10, 1_000_000)
    seed: int = number(0, 2**31)


@dataclass
class Tracking:
    uri: str = choice()
    experiment: str = choice()


_COMMANDS: dict[str, dict[str, tuple[float, float, str]]] = {
    "parabolic": {"acceleration": (-100.0, 100.0, "rad/s2")},
    "ramp": {"speed": (-100.0, 100.0, "rad/s")},
    "step": {"amplitude": (-100.0, 100.0, "rad"), "time": (0.0, 3600.0, "s")},
    "sine": {"amplitude": (-100.0, 100.0, "rad"), "frequency": (POSITIVE, 1000.0, "Hz")},
    "chirp": {
        "amplitude": (-100.0, 100.0, "rad"),
        "frequency_start": (0.0, 1000.0, "Hz"),
        "frequency_end": (0.0, 1000.0, "Hz"),
    },
    "reversal": {"amplitude": (POSITIVE, 100.0, "rad"), "speed": (POSITIVE, 100.0, "rad/s")},
}
#: settings that every entry of the group reconstruction has, whatever its method
_WEIGHTED: list[tuple[str, Any, Any]] = [
    ("discard", float, number(0.0, 3600.0, "s")),
    ("margin", float, number(0.0, 89.0, "electrical degrees")),
    ("plateau_width", float, number(30.0, 180.0, "electrical degrees")),
    ("zero_current", float, number(0.0, 10.0, "A")),
    ("floating", bool, group()),
    ("noise", dict[str, float] | None, group()),
]
RECONSTRUCTIONS: dict[str, type] = {
    "paper": make_dataclass(
        "paper",
        [
            ("method", str, choice("paper")),
            ("discard", float, number(0.0, 3600.0, "s")),
            ("cutoff", float, number(POSITIVE, 1e5, "Hz")),
            ("threshold", float, number(0.0, 10.0, "of k0")),
            ("least_speed", float, number(POSITIVE, 1000.0, "rad/s")),
        ],
    ),
    "weighted": make_dataclass("weighted", [("method", str, choice("weighted")), *_WEIGHTED]),
    "nine": make_dataclass(
        "nine",
        [
            ("method", str, choice("nine")),
            ("discard", float, number(0.0, 3600.0, "s")),
            ("plateau_width", float, number(30.0, 180.0, "electrical degrees")),
            ("zero_current", float, number(0.0, 10.0, "A")),
            ("noise", dict[str, float] | None, group()),
            ("heating", bool, group()),
        ],
    ),
    "angle_resolved": make_dataclass(
        "angle_resolved",
        [
            ("method", str, choice("angle_resolved")),
            *_WEIGHTED,
            ("eccentricity_law", str, choice("rotor_angle", "rotor_angle_per_phase")),
            ("order", int, number(1, 20)),
            ("subdivisions", int, number(0, 360)),
        ],
    ),
}
COMMANDS: dict[str, type] = {
    name: make_dataclass(
        name, [("name", str, choice(name)), *((key, float, number(*spec)) for key, spec in settings.items())]
    )
    for name, settings in _COMMANDS.items()
}
COMMANDS["file"] = make_dataclass("file", [("name", str, choice("file")), ("path", str)])


def check(value: Any, schema: Any, key: str, metadata: Mapping = types.MappingProxyType({})) -> None:
    """Refuse ``value`` unless it fits: a dataclass, number, bool, str, list[...], dict[str, ...], X | None or anything.

    Raises
    ------
    InputError : naming the key, what it got and what it accepts
    """
    origin, arguments = typing.get_origin(schema), typing.get_args(schema)
    if is_dataclass(schema):
        known = {f.name: f for f in fields(schema)}
        if not isinstance(value, dict):
            refuse(key, value, "keys " + ", ".join(known))
        for name in value:
            if name not in known:
                raise InputError(unknown_key(name, key, known))
        for name, f in known.items():
            if name not in value:
                raise InputError(f"{key}.{name}: is missing")
            check(value[name], f.type, f"{key}.{name}" if key else name, f.metadata)
        if {"low", "high"} <= known.keys() and value["low"] > value["high"]:
            refuse(f"{key}.high", value["high"], f"a number not below {key}.low = {value['low']}")
    elif origin in (types.UnionType, typing.Union):
        if value is not None:
            check(value, next(a for a in arguments if a is not types.NoneType), key, metadata)
    elif origin is list:
        if not isinstance(value, list):
            refuse(key, value, "a list")
        for position, item in enumerate(value):
            check(item, arguments[0], f"{key}[{position}]", metadata)
    elif origin is dict:
        if not isinstance(value, dict):
            refuse(key, value, "a mapping")
        for name, item in value.items():
            if not isinstance(name, str):
                refuse(key, name, "keys that are words")
            check(item, arguments[1], f"{key}.{shown(name)}", metadata)
    elif schema is Any:
        pass
    elif schema is bool:
        if not isinstance(value, bool):
            refuse(key, value, "true or false")
    elif schema in (int, float):
        low, high = metadata.get("low", -math.inf), metadata.get("high", math.inf)
        is_number = isinstance(value, int if schema is int else (int, float)) and not isinstance(value, bool)
        if not (is_number and low <= value <= high and abs(value) != math.inf):
            refuse(key, value, _accepted_number(schema, low, high, metadata.get("unit", "")))
    elif schema is str:
        accepted = metadata.get("accepted")
        if not isinstance(value, str) or not value or (accepted and value not in accepted):
            refuse(key, value, ", ".join(accepted) if accepted else "a word")


def check_unlisted(entries: Any, key: str = "unlisted") -> None:
    """Refuse entries of ``unlisted`` (see ``actuator.grammar``) that are not a place, a form and its parameters.

    Raises
    ------
    InputError : naming the key, what it got and what it accepts
    """
    if not isinstance(entries, list):
        refuse(key, entries, "a list of entries, each with a place, a form and its parameters")
    for n, entry in enumerate(entries):
        at = f"{key}[{n}]"
        if not isinstance(entry, dict):
            refuse(at, entry, "a mapping with a place, a form and its parameters")
        place = entry.get("place")
        if place not in grammar.PLACES:
            refuse(f"{at}.place", place, ", ".join(grammar.PLACES))
        form = entry.get("form")
        if form not in grammar.forms_at(place):
            refuse(f"{at}.form", form, f"{', '.join(grammar.forms_at(place))} in {place}")
        wanted = grammar.FORMS[form]
        known = ["place", "form", *wanted, grammar.EACH]
        for name in entry:
            if name not in known:
                raise InputError(unknown_key(name, at, known))
        for name in wanted:
            if name not in entry and name not in grammar.OPTIONAL.get(form, ()):
                raise InputError(f"{at}.{name}: is missing; {form} has {', '.join(wanted)}")
            if name in entry:
                _check_parameter(entry[name], name, place, form, f"{at}.{name}")
        if form == "function" and not entry["to"] > entry["from"]:
            refuse(f"{at}.to", entry["to"], f"a number above {at}.from = {entry['from']}")
        check(entry.get(grammar.EACH, {}), dict[str, dict[str, Any]], f"{at}.{grammar.EACH}")
        for recording, own in entry.get(grammar.EACH, {}).items():
            for name, value in own.items():
                full = f"{at}.{grammar.EACH}.{recording}.{name}"
                if name not in wanted:
                    raise InputError(unknown_key(name, f"{at}.{grammar.EACH}.{recording}", list(wanted)))
                _check_parameter(value, name, place, form, full)


def _check_parameter(value: Any, name: str, place: str, form: str, key: str) -> None:
    """Check one parameter of an entry of ``unlisted``."""
    words = {"along": tuple(grammar.COORDINATES), "source": grammar.PHASES if form == "crosstalk" else grammar.SOURCES}
    if name in words:
        check(value, str, key, {"accepted": words[name]})
        return
    if name == "values" and not (isinstance(value, list) and len(value) == grammar.KNOTS):
        refuse(key, value, f"a list of {grammar.KNOTS} numbers, at equally spaced knots")
    low, high, unit = grammar.PARAMETERS.get(name, (*grammar.ANY, ""))
    share = form != "memory" and grammar.PLACES[place] == "1" and place not in grammar.CONTROLLER
    if not unit and share and name not in ("from", "to"):
        low, high = max(low, -grammar.SHARE), min(high, grammar.SHARE)
    accepted = {"low": low, "high": high, "unit": unit or ("" if name in ("from", "to") else grammar.PLACES[place])}
    check(value, list[float] if name == "values" else float, key, accepted)


def refuse(key: str, got: Any, accepted: str) -> typing.NoReturn:
    """Raise the one line that names a key, what it got and what it accepts."""
    raise InputError(f"{key}: got {shown(repr(got))}, accepted is {accepted}")


def unknown_key(name: object, parent: str, known: Iterable[str]) -> str:
    """The one line that refuses a key that does not exist."""
    full = f"{parent}.{shown(name)}" if parent else shown(name)
    accepts = f"{parent or 'the configuration'} accepts {', '.join(sorted(known))}"
    return f"{full}: there is no such key{near(name, known)}; {accepts}"


def near(name: object, known: Iterable[str]) -> str:
    """What to add to a line that refuses a name: the known one most like it; empty where none is."""
    close = difflib.get_close_matches(str(name), list(known), 1)
    return f" (did you mean {close[0]}?)" if close else ""


def _accepted_number(kind: type, low: float, high: float, unit: str) -> str:
    word = "an integer" if kind is int else "a number"
    if low == POSITIVE:
        limits = "above 0" if high == math.inf else f"above 0, to {high:g}"
    elif low == -math.inf and high == math.inf:
        limits = ""
    elif high == math.inf:
        limits = f"from {low:g}"
    else:
        limits = f"from {low:g} to {high:g}"
    return " ".join(part for part in (word, limits, f"({unit})" if unit else "") if part)

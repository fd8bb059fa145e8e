"""A file of one's own actuator, read: each number with its unit, tolerance and source."""

import json
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .. import schema
from ..errors import InputError, shown
from ..plain import read_yaml
from ..units import quantity
from .keys import CONSTANTS, KEYS, REQUIRED, SOURCES, UNKNOWN

SCHEMA = Path(__file__).with_name("actuator.schema.json")
PLUS_MINUS = re.compile(r"\+-|\+/-|±")
#: what datasheets write -> what pint reads
SPELT = (
    (r"\(?1000 ?(rpm|min-1|1/min)\)?", "krpm"), (r"min-1|1/min", "rpm"), (r"([munkM]?)Nm", r"\1N m"),
    (r"\b(k?g) ?([cm]?m)", r"\1 \2"), (r"([A-Za-z])(\d)", r"\1^\2"),
)  # fmt: skip
NUMBER = re.compile(r"^[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")


@dataclass(frozen=True)
class Number:
    """One number: ``value`` in the SI unit of its key; ``tolerance`` half of the 90 % interval over the value."""

    value: float
    tolerance: float
    source: str
    text: str  # as it was given
    datasheet: str = ""  # what the datasheet says where it was identified


@dataclass(frozen=True)
class Sheet:
    """A file read; what it does not say, or says to be unknown, is not among ``numbers``."""

    path: str
    name: str
    numbers: Mapping[str, Number]

    def get(self, key: str) -> Number | None:
        """A number, None where it is unknown."""
        return self.numbers.get(key)


def read_sheet(path: str | Path) -> Sheet:
    """Read and check the file of an actuator.

    Raises
    ------
    InputError : naming the file, the key, what it got and what it accepts
    """
    content = read_yaml(path)
    try:
        return _sheet(str(path), content)
    except InputError as error:
        raise InputError(f"{shown(path)}: {error}") from None


def _sheet(path: str, content: Mapping[str, Any]) -> Sheet:
    for key in content:
        if key not in KEYS and key != "name":
            raise InputError(schema.unknown_key(key, "the file", ["name", *KEYS]))
    for key in REQUIRED:
        if key not in content:
            raise InputError(f"{key}: is missing, {_wanted(key)} is needed")
    _validate(content)
    numbers = {key: _number(key, given) for key, given in content.items() if key in KEYS and not _unknown(given)}
    for key in REQUIRED:
        if key not in numbers:
            raise InputError(f"{key}: is unknown, {_wanted(key)} is needed")
    if not any(key in numbers for key in CONSTANTS):
        raise InputError(f"{CONSTANTS[0]}: is missing, and so are {' and '.join(CONSTANTS[1:])}; one of them is needed")
    return Sheet(path, str(content.get("name", Path(path).stem)), numbers)


def _validate(content: Mapping[str, Any]) -> None:
    from jsonschema import Draft202012Validator
    from jsonschema.exceptions import best_match

    rules = json.loads(SCHEMA.read_text(encoding="utf-8"))
    error = best_match(Draft202012Validator(rules).iter_errors(content))
    if error is not None:
        where = ".".join(map(str, error.absolute_path)) or "the file"
        raise InputError(f"{where}: {shown(error.message)}; {_wanted(where.split('.')[0])} is accepted")


def _wanted(key: str) -> str:
    return (
        f"a number with its unit as '{KEYS[key].example}' ({KEYS[key].words})" if key in KEYS else "what the schema has"
    )


def _unknown(given: Any) -> bool:
    return given == UNKNOWN or (isinstance(given, Mapping) and given["value"] == UNKNOWN)


def _number(key: str, given: Any) -> Number:
    entry = given if isinstance(given, Mapping) else {"value": given}
    source = entry.get("source", "datasheet")
    schema.check(source, str, f"{key}.source", {"accepted": SOURCES})
    text, *spread = PLUS_MINUS.split(str(entry["value"]))
    if len(spread) > 1 or (spread and "tolerance" in entry):
        raise InputError(f"{key}: states two tolerances, accepted is one")
    value = _quantity(key, text)
    stated = str(entry["tolerance"]) if "tolerance" in entry else spread[0] if spread else None
    tolerance = KEYS[key].tolerance if stated is None else _tolerance(key, stated, value, text)
    return Number(value, tolerance, source, str(entry["value"]), str(entry.get("datasheet", "")))


def _quantity(key: str, text: str) -> float:
    known = KEYS[key]
    number, unit = split(text)
    if math.isnan(number) or bool(unit) != bool(known.unit):
        raise InputError(f"{key}: got {shown(repr(text.strip()))}, {_wanted(key)} is accepted")
    value = quantity(f"{number!r} {unit}", known.unit, key) if unit else number
    if not known.low <= value <= known.high:
        raise InputError(
            f"{key}: got {shown(text.strip())}, which no machine has; {known.low:g} to {known.high:g} {known.unit} "
            f"({known.words}) is accepted"
        )
    if key == "pole_pairs" and value != round(value):
        raise InputError(f"{key}: got {shown(text.strip())}, accepted is a whole number")
    return value


def _tolerance(key: str, text: str, value: float, of: str) -> float:
    number, unit = split(text)
    if unit == "%":
        share = 0.01 * number
    elif unit and KEYS[key].unit:
        share = quantity(f"{number!r} {unit}", KEYS[key].unit, f"{key}: tolerance") / abs(value or 1.0)
    elif split(of)[1]:  # in the unit of the number
        share = abs(number / (split(of)[0] or 1.0))
    else:
        share = math.nan
    if not 0.0 < share < 2.0:
        raise InputError(f"{key}: the tolerance '{shown(text.strip())}' is none, accepted is as '5 %' or '0.02 ohm'")
    return share


def split(text: str) -> tuple[float, str]:
    """A number and its unit as pint spells it; nan where the text begins with no number.

    Datasheets write ``g cm2`` and ``mNm/A`` for ``g cm^2`` and ``mN m/A``.
    """
    found = NUMBER.match(text.strip())
    if not found:
        return math.nan, ""
    unit = text.strip()[found.end() :].strip()
    for spelt, meant in SPELT:
        unit = re.sub(spelt, meant, unit)
    return float(found[0]), unit

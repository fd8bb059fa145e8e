"""Units by pint: what a number in a unit of a file or map is in that of the recording format."""

from functools import lru_cache

from .errors import InputError

#: what loggers write that pint does not know, or takes for something else
_SPELT = {
    "°": "degree", "°C": "degC", "C": "degC", "1/min": "rpm", "u/min": "rpm", "min-1": "rpm", "rev/min": "rpm",
    "%": "percent", "volt": "V", "volts": "V", "amp": "A", "amps": "A", "ampere": "A", "second": "s", "seconds": "s",
    "sec": "s", "radian": "rad", "radians": "rad", "rpm": "rpm", "Nm": "N m",
}  # fmt: skip


@lru_cache(maxsize=1)
def registry():
    """The registry of units, read once.

    Raises
    ------
    InputError : pint is not installed
    """
    try:
        import pint
    except ImportError as error:
        raise InputError("pint is needed to read units; pip install pint") from error
    return pint.UnitRegistry()


def spelt(unit: str) -> str:
    """A unit as pint spells it."""
    return _SPELT.get(unit, _SPELT.get(unit.lower(), unit))


def is_unit(text: str) -> bool:
    """Whether a text is a unit that can be read."""
    units = registry()
    try:
        units.parse_units(spelt(text))
    except Exception:  # pint raises many kinds for text that is no unit
        return False
    return bool(text)


def factor(unit: str, wanted: str, where: str) -> float:
    """What one ``unit`` is in ``wanted``.

    Raises
    ------
    InputError : a unit that is none or of another kind
    """
    units = registry()
    try:
        return float(units.Quantity(1.0, spelt(unit)).to(wanted).magnitude)
    except Exception as error:
        raise InputError(f"{where}: the unit '{unit}' is not one of {wanted} ({error})") from error


def converted(values, unit: str, wanted: str, where: str):
    """Numbers in ``unit`` in ``wanted``, temperatures with their zero.

    Raises
    ------
    InputError : a unit that is none or of another kind
    """
    units = registry()
    try:
        given, target = units.parse_units(spelt(unit)), units.parse_units(wanted)
        out = units.Quantity(values, given).to(target).magnitude
    except Exception as error:
        raise InputError(f"{where}: the unit '{unit}' is not one of {wanted} ({error})") from error
    if ("hertz" in str(given)) != ("hertz" in str(target)):  # pint takes one for a rad/s
        raise InputError(f"{where}: the unit '{unit}' is not one of {wanted} (a turn a second is 'turn/s')")
    return out


def quantity(given, wanted: str, where: str) -> float:
    """A number, taken to be in ``wanted``, or a text as "200 us" or "21.5 degC", in ``wanted``.

    Raises
    ------
    InputError : a text that is no number with a unit of that kind
    """
    if isinstance(given, int | float):
        return float(given)
    units = registry()
    try:
        number, _, unit = str(given).strip().partition(" ")
        value = units.Quantity(float(number), spelt(unit.strip()) or wanted)
        return float(value.to(wanted).magnitude)
    except Exception as error:
        raise InputError(f"{where}: got '{given}', accepted is a number with a unit of {wanted} ({error})") from error

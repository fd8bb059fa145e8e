"""A map guessed from names and units of channels, with blanks for what only its owner knows."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml

from ..units import registry, spelt
from .mapping import BLANK
from .readers import read_raw

HEADER = """\
# Guessed from the names and units of channels: look it over, and fill in every ??? .
# reference: star, dc_minus, virtual_star, line_to_line or duty; health: healthy, unknown or seeded;
# ambient: winding temperature at the start, as 21.5 degC. samples: instants, or means over each sample's step.
"""
_PHASE = {
    "a": 0,
    "b": 1,
    "c": 2,
    "u": 0,
    "v": 1,
    "w": 2,
    "1": 0,
    "2": 1,
    "3": 2,
    "r": 0,
    "s": 1,
    "t": 2,
    "ab": 0,
    "bc": 1,
    "ca": 2,
}
#: units where a file has none; decades are found by the import, a speed's unit altogether
_USUAL = {"phase_voltage": "V", "phase_current": "A", "phase_current_end": "A", "bus_voltage": "V"}
# short stems begin or are a word: "enc" is no part of "Efficiency"
_BUS = re.compile(r"\b[uv]?(bus|dc|batt|supply|link)")
_COMMAND = re.compile(r"\b(cmd|ref|reference|set|setpoint)\b|\bsoll|command|target|demand")
_OUTPUT = re.compile(r"\b(out|output|load|user)\b|\bout ?pos|shaft|lvdt|surface|flap|position")
_ANGLE = re.compile(r"\b(rotor|motor)?angle\b|theta|\b(enc|encoder|resolver)\b")
_END = re.compile(r"\b(end|inst)")
_VOLTS, _AMPS, _DUTY = (re.compile(x) for x in (r"volt|^[uv]", r"curr|\bamp|^i", r"\bduty|\bpwm"))
_SPEED = re.compile(r"speed|rpm\b|omega|veloc|drehzahl")
_HALL = re.compile(r"\bhall")


def guess(paths: Sequence[str | Path], folder: Path) -> str:
    """Text of a map for the recordings ``paths``, alike in their channels, relative to the map's folder.

    Raises
    ------
    InputError : a file that cannot be read
    """
    found = read_raw(paths[0])
    channels = {str(n): (_kind(v.attrs["units"]), v.attrs["units"]) for n, v in found.data_vars.items()}
    signals = _signals(channels)
    recordings = [
        {"name": re.sub(r"\W+", "_", Path(p).stem), "file": _beside(Path(p), folder), "health": BLANK, "ambient": BLANK}
        for p in paths
    ]
    timed = all(v.dims[0] in found.coords for v in found.data_vars.values())
    logger = {"samples": BLANK} | ({} if timed else {"rate": BLANK})
    content = {"interval": "200 us", "loggers": {"logger": logger}, "recordings": recordings, "signals": signals}
    return HEADER + yaml.safe_dump(content, sort_keys=False, allow_unicode=True, width=120)


def _beside(path: Path, folder: Path) -> str:
    try:
        return str(path.resolve().relative_to(folder.resolve()))
    except ValueError:
        return str(path.resolve())


def _kind(unit: str) -> str:
    """What a unit is of: V, A, speed, angle, length, or nothing where it does not say; "other" is of none of these."""
    if not unit:
        return ""
    try:
        found = registry().Quantity(1.0, spelt(unit))
    except Exception:  # pint raises many kinds for text that is no unit
        return ""
    if found.check("1"):
        angles = ("rad", "deg", "degree", "degrees", "turn", "mrad", "rev")
        return "angle" if spelt(unit) in angles else "other" if unit.strip() == "%" else ""
    if "hertz" in str(found.units):  # which pint takes for rad/s
        return "other"
    for kind, wanted in (("V", "volt"), ("A", "ampere"), ("speed", "rad/s"), ("length", "m")):
        if found.dimensionality == registry().Quantity(1.0, wanted).dimensionality:
            return kind
    return "other"


def _signals(channels: dict[str, tuple[str, str]]) -> dict:
    volts: list[str | None] = [None] * 3
    amps: list[str | None] = [None] * 3
    duty: list[str | None] = [None] * 3
    ends: list[str | None] = [None] * 3
    halls: list[str] = []
    single: dict[str, str] = {}
    for name, (kind, _) in channels.items():
        bare = name.split("/")[-1]
        words, phase = _words(bare), _phase_of(bare)
        if _HALL.search(words):
            halls.append(name)
        elif _DUTY.search(words) and phase is not None:
            duty[phase] = name
        elif kind == "other" or (kind in ("V", "A", "speed") and _COMMAND.search(words)):
            continue  # no signal of the map
        elif not kind and _BUS.search(words):
            single.setdefault("bus_voltage", name)
        elif kind == "V" or (not kind and _VOLTS.search(words) and not _SPEED.search(words)):
            if _BUS.search(words) or phase is None:
                single.setdefault("bus_voltage", name)
            else:
                volts[phase] = name
        elif (kind == "A" or (not kind and _AMPS.search(words))) and phase is not None:
            (ends if _END.search(words) else amps)[phase] = name
        elif kind == "speed" or _SPEED.search(words):
            single.setdefault("rotor_speed", name)
        elif _COMMAND.search(words):
            single.setdefault("commanded_position", name)
        elif _OUTPUT.search(words):
            single.setdefault("output_position", name)
        elif kind == "angle" or _ANGLE.search(words):
            single.setdefault("rotor_angle", name)
    by_duty = None in volts and None not in duty
    voltage = {"reference": "duty" if by_duty else BLANK, "channels": _or_blank(duty if by_duty else volts)}
    out: dict[str, dict[str, Any]] = {
        "phase_voltage": voltage,
        "phase_current": {"channels": _or_blank(amps) if amps.count(None) > 1 else amps},
    }
    if None not in ends:
        out["phase_current_end"] = {"channels": ends}
    if "rotor_angle" not in single and len(halls) == 3:
        out["rotor_angle"] = {"hall": halls}
    else:
        out["rotor_angle"] = {"channel": single.get("rotor_angle", BLANK)}
    out |= {k: {"channel": single.get(k, BLANK)} for k in ("output_position", "commanded_position")}
    out |= {k: {"channel": single[k]} for k in ("rotor_speed", "bus_voltage") if k in single}
    for signal, entry in out.items():
        named = [c for c in entry.get("channels", [entry.get("channel")]) if c]
        if signal != "rotor_speed" and any(c in channels and not channels[c][1] for c in named):
            entry["unit"] = "1" if entry.get("reference") == "duty" else _USUAL.get(signal, BLANK)
    return out


def _or_blank(names: list) -> list:
    return [BLANK if n is None else n for n in names]


def _words(name: str) -> str:
    """A name as words with spaces between: ``RotorAngle_1`` -> ``rotor angle 1``."""
    parts = re.findall(r"[A-Z]?[a-zäöüß]+|[A-Z]+(?![a-z])|\d+", name)
    return " ".join(parts).lower()


def _phase_of(name: str) -> int | None:
    """Phase by the last letters or digit of a name."""
    words = re.split(r"[^a-z0-9]+", name.lower())
    for word in reversed(words):
        ending = re.search(r"(ab|bc|ca|[abcuvwrst123])$", word)
        if ending and (len(word) <= 3 or word == ending[1] or word[: -len(ending[1])] in _STEMS):
            return _PHASE[ending[1]]
    return None


_STEMS = ("phase", "volt", "voltage", "current", "curr", "duty", "pwm", "channel", "ch")

"""The map of an import: read, checked against its schema, and what it leaves to be filled in."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..plain import read_yaml

SCHEMA = Path(__file__).with_name("map.schema.json")
MACHINE_SCHEMA = Path(__file__).with_name("machine_map.schema.json")  # of a map that names a machine of another kind
BLANK = "???"  # what a guessed map leaves for its owner to say
PHASED = ("phase_voltage", "phase_current", "phase_current_end")


def read_map(path: str | Path) -> dict[str, Any]:
    """Map of a YAML file, defaults filled in; files are paths from the working folder.

    Raises
    ------
    InputError : a file that cannot be read, a blank that is not filled in, or a key or value that the schema refuses
    """
    return complete(read_yaml(path), Path(path))


def complete(content: Any, path: Path) -> dict[str, Any]:
    """A map checked, with loggers and files said out.

    Raises
    ------
    InputError : see ``read_map``
    """
    _refuse_blanks(content, path, "")
    _validate(content, path)
    loggers = content.get("loggers") or {"logger": {}}
    first = next(iter(loggers))
    machine = content.get("machine", "")
    content = content | ({"machine": str(path.parent / machine)} if machine.endswith(".py") else {})
    loggers = {
        name: {"samples": "instants", "stamp": "end", "clock": "same"} | given for name, given in loggers.items()
    }
    recordings = []
    for entry in content["recordings"]:
        files = entry.get("files") or {first: entry["file"]}
        for logger in files:
            _known(logger, loggers, f"{path}: recordings.{entry['name']}.files")
        recordings.append(entry | {"files": {k: str(path.parent / v) for k, v in files.items()}})
    names = [entry["name"] for entry in recordings]
    if len(set(names)) < len(names):
        raise InputError(
            f"{path}: two recordings are named '{next(n for n in names if names.count(n) > 1)}'; rename one"
        )
    signals = {name: {"logger": first} | given for name, given in content["signals"].items()}
    for name, given in signals.items():
        _known(given["logger"], loggers, f"{path}: signals.{name}.logger")
    return content | {"loggers": loggers, "recordings": recordings, "signals": signals}


def _known(logger: str, loggers: Mapping[str, Any], where: str) -> None:
    if logger not in loggers:
        raise InputError(f"{where}: got '{logger}', the map's loggers are {', '.join(loggers)}")


def _refuse_blanks(content: Any, path: Path, key: str) -> None:
    if content == BLANK:
        raise InputError(f"{path}: {key} is still {BLANK}; say what it is")
    inside = (
        content.items() if isinstance(content, Mapping) else enumerate(content) if isinstance(content, list) else ()
    )
    for name, value in inside:
        _refuse_blanks(value, path, f"{key}.{name}" if key else str(name))


def _validate(content: Any, path: Path) -> None:
    from jsonschema import Draft202012Validator
    from jsonschema.exceptions import best_match

    schema = MACHINE_SCHEMA if "machine" in content else SCHEMA
    error = best_match(Draft202012Validator(json.loads(schema.read_text(encoding="utf-8"))).iter_errors(content))
    if error is not None:
        raise InputError(f"{path}: {'.'.join(map(str, error.absolute_path)) or 'the map'}: {error.message}")

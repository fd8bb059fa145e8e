"""Checks of a whole composed configuration: every group against its schema, and values that must go together."""

from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from . import schema
from .errors import InputError

_SCHEMAS = {
    "actuator": schema.Actuator,
    "faults": schema.Faults,
    "magnet": schema.Magnet,
    "load": schema.Load,
    "recording": schema.RecordingConditions,
    "sensors": schema.Sensors,
    "unit": schema.Unit,
    "sampling": schema.Sampling,
    "network": schema.Network,
    "training": schema.Training,
    "search": schema.Search,
    "evaluation": schema.Evaluation,
    "tracking": schema.Tracking,
    "effects": dict[str, dict[str, float]],
    "variants": dict[str, list[str]],
    "name": str,
    "dataset": str,
}


def check_configuration(config: Mapping[str, Any]) -> None:
    """Refuse a composed configuration that does not fit the schemas or whose values do not go together.

    Raises
    ------
    InputError : naming the key, what it got and what it accepts
    """
    known = {*_SCHEMAS, "command", "reconstruction", "question"}
    for key in config:
        if key not in known:
            raise InputError(schema.unknown_key(key, "", sorted(known)))
    for key in known - config.keys():
        raise InputError(f"{key}: is missing from the configuration")
    for key, kind in _SCHEMAS.items():
        schema.check(config[key], kind, key)
    for key in ("name", "dataset"):
        if not all(word and set(word) <= _NAME and word[0] != "." for word in config[key].split("/")):
            schema.refuse(key, config[key], "letters, digits, _, - and .")
    _check_named("command", config["command"], "name", schema.COMMANDS)
    schema.check(config["reconstruction"], dict[str, dict[str, Any]], "reconstruction")
    for name, entry in config["reconstruction"].items():
        _check_named(f"reconstruction.{name}", entry, "method", schema.RECONSTRUCTIONS)
    if config["command"]["name"] == "file" and not Path(config["command"]["path"]).is_file():
        schema.refuse("command.path", config["command"]["path"], "the path of an existing file")
    _check_effects(config["effects"])
    for effect in config["unit"]["spread_of"] or []:
        if effect not in _calibrations():
            schema.refuse("unit.spread_of", effect, ", ".join(_calibrations()))
    recording = config["recording"]
    intervals = recording["duration"] / recording["interval"]
    if abs(intervals - round(intervals)) > 1e-6:
        schema.refuse(
            "recording.duration", recording["duration"], f"a whole number of {recording['interval']} s intervals"
        )
    discards = {f"reconstruction.{name}.discard": entry["discard"] for name, entry in config["reconstruction"].items()}
    for key, discard in {"recording.discard": recording["discard"], **discards}.items():
        if discard > recording["duration"] - 0.15:
            schema.refuse(key, discard, "at least 0.15 s less than recording.duration")
    if config["sampling"]["shards"] > min(config["sampling"]["runs"], config["sampling"]["fresh"]):
        schema.refuse("sampling.shards", config["sampling"]["shards"], "no more than sampling.runs and sampling.fresh")
    _check_space(config["search"]["space"])
    if config["search"]["reconstruction"] not in config["reconstruction"] and config["search"]["trials"]:
        schema.refuse(
            "search.reconstruction", config["search"]["reconstruction"], ", ".join(sorted(config["reconstruction"]))
        )


_NAME = set("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-.")


def _check_space(space: Mapping[str, Mapping[str, Any]]) -> None:
    """Check that every end and every value of the space that is searched is one that the setting accepts."""
    groups = {"network": schema.Network, "training": schema.Training}
    for section, keys in space.items():
        if section not in groups:
            raise InputError(schema.unknown_key(section, "search.space", list(groups)))
        known = {field.name: field for field in fields(groups[section])}
        for name, values in keys.items():
            key = f"search.space.{section}.{name}"
            if name not in known:
                raise InputError(schema.unknown_key(name, f"search.space.{section}", list(known)))
            if isinstance(values, Mapping):
                if not {"low", "high"} <= set(values) <= {"low", "high", "log", "step"}:
                    schema.refuse(key, values, "a list of values, or low, high and at will log and step")
                if values["low"] > values["high"]:
                    schema.refuse(f"{key}.high", values["high"], f"a number not below {key}.low = {values['low']}")
                values = [values["low"], values["high"]]
            for value in values if isinstance(values, list) else [values]:
                schema.check(value, known[name].type, key, known[name].metadata)


def _check_named(key: str, value: Mapping[str, Any], label: str, schemas: Mapping[str, type]) -> None:
    """Check a group whose entry ``label`` says which schema holds."""
    chosen = value.get(label) if isinstance(value, Mapping) else value
    if not isinstance(chosen, str) or chosen not in schemas:
        schema.refuse(f"{key}.{label}", chosen, ", ".join(schemas))
    schema.check(value, schemas[chosen], key)


def _calibrations() -> list[str]:
    """Effects with a tolerance."""
    from .effects import EFFECTS

    return [id_ for id_, effect in EFFECTS.items() if any(p.tolerance for p in effect.parameters.values())]


def _check_effects(effects: Mapping[str, Mapping[str, float]]) -> None:
    from .effects import EFFECTS

    for effect, values in effects.items():
        if effect not in EFFECTS:
            raise InputError(schema.unknown_key(effect, "effects", list(EFFECTS)))
        for name in values:
            if name not in EFFECTS[effect].parameters:
                raise InputError(schema.unknown_key(name, f"effects.{effect}", list(EFFECTS[effect].parameters)))

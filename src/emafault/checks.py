"""Checks of a whole composed configuration: every group against its schema, and values that must go together."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from . import schema
from .actuator.grammar import MACHINE, MOST_TERMS
from .errors import InputError, shown
from .places import kind

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
    "tolerances": dict[str, dict[str, float]],
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
    known = {*_SCHEMAS, "command", "reconstruction", "question", "unlisted", "learnt_from"}
    for key in config:
        if key not in known:
            raise InputError(schema.unknown_key(key, "", sorted(known)))
    for key in known - config.keys():
        raise InputError(f"{key}: is missing from the configuration")
    for key, expected in _SCHEMAS.items():
        schema.check(config[key], expected, key)
    if not isinstance(config["question"], str):
        schema.refuse("question", config["question"], "text")
    for key in ("name", "dataset"):
        check_name(key, config[key])
    if config["learnt_from"] is not None:
        check_name("learnt_from", config["learnt_from"], parts=1)
    for variant in config["variants"]:
        check_name("variants", variant, parts=1)
    _check_named("command", config["command"], "name", schema.COMMANDS)
    _check_reconstruction(config["reconstruction"])
    if config["command"]["name"] == "file" and kind(config["command"]["path"], "command.path") != "file":
        schema.refuse("command.path", config["command"]["path"], "the path of an existing file")
    _check_effects(config["effects"], config["actuator"])
    _check_tolerances(config["tolerances"])
    schema.check_unlisted(config["unlisted"])
    in_machine = sum(entry["place"] in MACHINE for entry in config["unlisted"])
    if in_machine > MOST_TERMS:
        schema.refuse("unlisted", f"{in_machine} entries in the machine", f"{MOST_TERMS} at most")
    for effect in config["unit"]["spread_of"] or []:
        if effect not in _calibrations():
            schema.refuse("unit.spread_of", effect, ", ".join(_calibrations()))
    recording = config["recording"]
    if recording["filter"]["undone"] and recording["filter"]["kind"] == "moving_average":
        schema.refuse("recording.filter.undone", True, "false of a moving average, which cannot be undone")
    intervals = recording["duration"] / recording["interval"]
    if abs(intervals - round(intervals)) > 1e-6:
        schema.refuse(
            "recording.duration", recording["duration"], f"a whole number of {recording['interval']} s intervals"
        )
    if intervals > MOST_SAMPLES:
        schema.refuse("recording.interval", recording["interval"], f"what gives up to {MOST_SAMPLES:.0e} samples")
    discards = {f"reconstruction.{name}.discard": entry["discard"] for name, entry in config["reconstruction"].items()}
    for key, discard in {"recording.discard": recording["discard"], **discards}.items():
        if discard > recording["duration"] - 0.15:
            schema.refuse(key, discard, "at least 0.15 s less than recording.duration")
    if (config["sampling"]["shards"] or 1) > min(config["sampling"]["runs"], config["sampling"]["fresh"]):
        schema.refuse("sampling.shards", config["sampling"]["shards"], "no more than sampling.runs and sampling.fresh")
    _check_space(config["search"]["space"])
    if config["search"]["reconstruction"] not in config["reconstruction"] and config["search"]["trials"]:
        schema.refuse(
            "search.reconstruction", config["search"]["reconstruction"], ", ".join(sorted(config["reconstruction"]))
        )


def check_trained(config: Mapping[str, Any]) -> None:
    """Refuse what a trained experiment's configuration says of identifying, where it does not fit.

    Raises
    ------
    InputError : naming the key, what it got and what it accepts
    """
    for key in ("actuator", "magnet", "load", "effects", "faults", "sensors", "variants"):
        if key not in config:
            raise InputError(f"{key}: is missing from the configuration")
        schema.check(config[key], _SCHEMAS[key], key)
    _check_effects(config["effects"], config["actuator"])
    _check_reconstruction(config.get("reconstruction"))


def check_name(key: str, name: Any, parts: int = 2) -> None:
    """Refuse what cannot be a folder of results, and what YAML, a page or the workflow would read as something else.

    Parameters
    ----------
    parts : how many words a name may have with a slash between them

    Raises
    ------
    InputError : naming the key and what is accepted
    """
    words = name.split("/") if isinstance(name, str) else []
    good = 0 < len(words) <= parts and all(word and set(word) <= _NAME and word[0] not in ".-" for word in words)
    if not good or len(name) > LONGEST_NAME:
        accepted = f"letters, digits, _, - and ., at most {LONGEST_NAME}, a letter, digit or _ first"
        raise InputError(f"{key}: got {shown(repr(name))}, accepted are {accepted}")


LONGEST_NAME = 100
MOST_SAMPLES = 1e7  # of a recording, a gigabyte
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
                ends = [values["low"], values["high"]]
            else:
                ends = values if isinstance(values, list) else [values]
            for value in ends:
                schema.check(value, known[name].type, key, known[name].metadata)
            if isinstance(values, Mapping) and values["low"] > values["high"]:
                schema.refuse(f"{key}.high", values["high"], f"a number not below {key}.low = {values['low']}")


def _check_reconstruction(entries: Any) -> None:
    """Check every method, each by the schema of its kind."""
    schema.check(entries, dict[str, dict[str, Any]], "reconstruction")
    if not entries:
        raise InputError("reconstruction: got none, accepted is one method or more")
    for name, entry in entries.items():
        check_name("reconstruction", name, parts=1)
        _check_named(f"reconstruction.{name}", entry, "method", schema.RECONSTRUCTIONS)


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


def _check_tolerances(tolerances: Mapping[str, Mapping[str, float]]) -> None:
    from .effects import EFFECTS

    for effect, values in tolerances.items():
        if effect not in _calibrations():
            raise InputError(schema.unknown_key(effect, "tolerances", _calibrations()))
        known = [name for name, p in EFFECTS[effect].parameters.items() if p.tolerance]
        for name, value in values.items():
            if name not in known:
                raise InputError(schema.unknown_key(name, f"tolerances.{effect}", known))
            schema.check(value, float, f"tolerances.{effect}.{name}", {"low": schema.POSITIVE, "high": 1.0})


def _check_effects(effects: Mapping[str, Mapping[str, float]], actuator: Mapping[str, Any]) -> None:
    from .actuator.parameters import ActuatorParameters
    from .effects.scaling import scaled

    catalogue = scaled(ActuatorParameters(**actuator))
    for effect, values in effects.items():
        if effect not in catalogue:
            raise InputError(schema.unknown_key(effect, "effects", list(catalogue)))
        for name, value in values.items():
            key, parameters = f"effects.{effect}.{name}", catalogue[effect].parameters
            if name not in parameters:
                raise InputError(schema.unknown_key(name, f"effects.{effect}", list(parameters)))
            low, high = parameters[name].possible
            schema.check(value, float, key, {"low": low, "high": high, "unit": parameters[name].units})

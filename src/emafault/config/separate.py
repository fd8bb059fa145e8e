"""What has a file of settings of its own: the check of the evidence, the optimal command, several recordings."""

from typing import Any

from .. import schema
from ..errors import InputError
from ..paths import CONF
from ..plain import read_yaml
from .composition import compose, recursively_sorted
from .stages import dataset_spec, known, magnet_coefficient, pick

RANK_BINS = 20  # of the ranks of the check of the evidence


def _read(name: str, form: type, listed: str, accepts: str) -> dict[str, Any]:
    """Settings of conf/NAME.yaml, checked by their form; one of them is a list that is not empty."""
    read = read_yaml(CONF / f"{name}.yaml")
    schema.check(read, form, name)
    if not read[listed]:
        schema.refuse(f"{name}.{listed}", read[listed], accepts)
    return read


def evidence() -> dict[str, Any]:
    """The settings of conf/evidence.yaml.

    Raises
    ------
    InputError : naming the key, what it got and what it accepts
    """
    read = _read("evidence", schema.Evidence, "benches", "a list of one seed or more")
    if (read["samples"] + 1) % RANK_BINS:
        schema.refuse("evidence.samples", read["samples"], f"one less than a multiple of {RANK_BINS}")
    return read


def evidence_spec() -> dict[str, Any]:
    """What the check of the evidence reads: its own settings, the actuator and the sensors."""
    return recursively_sorted(pick(compose(), "actuator", "sensors") | {"evidence": evidence()})


def design() -> dict[str, Any]:
    """The settings of conf/optimal_command.yaml.

    Raises
    ------
    InputError : naming the key, what it got and what it accepts
    """
    read = _read("optimal_command", schema.Design, "lengths", "a list of one length or more (s)")
    for name, ends in read["space"].items():
        if name not in schema.COMMANDS or name == "file":
            raise InputError(schema.unknown_key(name, "optimal_command.space", schema.COMMANDS.keys() - {"file"}))
        for end in ("low", "high"):
            settings = {"name": name, **{key: float(value[end]) for key, value in ends.items()}}
            schema.check(settings, schema.COMMANDS[name], f"optimal_command.space.{name}")
    return read


def design_lengths() -> list[float]:
    """Lengths (s) of recording for which a command is searched."""
    return design()["lengths"]


def design_spec() -> dict[str, Any]:
    """What the search for the command that identifies best reads."""
    read = design()
    config = compose(read["experiment"], ["reconstruction=[weighted_floating,nine]"])
    spec = {
        "design": read,
        "dataset": dataset_spec(config, "fresh"),
        "known": known(config),
        "magnet_coefficient": magnet_coefficient(config),
    }
    return recursively_sorted(spec)


def several_spec() -> dict[str, Any]:
    """What identifying one fault from several recordings reads: conf/several_recordings.yaml and its experiments.

    Raises
    ------
    InputError : naming the key, what it got and what it accepts
    """
    read = _read("several_recordings", schema.Several, "counts", "a list of one number or more")
    own = []
    for name in read.pop("experiments"):
        config = compose(name)
        parts = {"dataset": dataset_spec(config, "fresh"), "known": known(config), "name": name}
        own.append(parts | {"alpha_m": magnet_coefficient(config), "question": config["question"]})
    return recursively_sorted({"settings": read, "experiments": own})

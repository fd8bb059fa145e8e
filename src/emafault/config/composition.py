"""Composition of an experiment by Hydra; what cannot be composed is refused in one line."""

import functools
import shlex
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from omegaconf import OmegaConf

from .. import checks, schema
from ..errors import InputError, one_line, shown
from ..paths import CONF
from ..places import file_at
from ..plain import read_yaml

#: groups whose options are chosen as a whole: ``magnet=smco``; experiments are chosen apart
GROUPS = sorted(p.name for p in CONF.iterdir() if p.is_dir() and p.name not in ("effect", "experiment", "withheld"))
#: keys of a composed configuration
_KEYS = {*GROUPS, "name", "question", "dataset", "effects", "tolerances", "learnt_from", "variants"}
LONGEST_KEY = 200
_GIVEN = "emafault_given_experiment"


def reference_actuator():
    """The nominal actuator of conf/actuator/reference.yaml."""
    from ..actuator.parameters import ActuatorParameters

    return ActuatorParameters(**read_yaml(CONF / "actuator" / "reference.yaml"))


def experiments() -> list[str]:
    """Names of the experiments in conf/experiment."""
    return sorted(p.stem for p in (CONF / "experiment").glob("*.yaml"))


def experiment_path(name: str) -> Path:
    """Where an experiment of this name stands, or would stand."""
    return CONF / "experiment" / f"{name}.yaml"


def recursively_sorted(value: Any) -> Any:
    """The same mappings with sorted keys, since Snakemake compares parameters in the order of their keys."""
    if isinstance(value, Mapping):
        return {str(key): recursively_sorted(value[key]) for key in sorted(value, key=str)}
    if isinstance(value, list | tuple):
        return [recursively_sorted(item) for item in value]
    return value


def split_overrides(overrides: str | Iterable[str] | None) -> list[str]:
    """One string of Hydra overrides, split as a shell would; a list of them is taken as it is.

    Raises
    ------
    InputError : an unclosed quote, or neither text nor a list of texts
    """
    if isinstance(overrides, str):
        try:
            return shlex.split(overrides)
        except ValueError as error:
            raise InputError(f"overrides: got {shown(repr(overrides))}, {error}") from error
    if overrides is not None and (
        not isinstance(overrides, list | tuple) or not all(isinstance(item, str) for item in overrides)
    ):
        raise InputError(f"overrides: got {shown(repr(overrides))}, accepted is text such as 'command=sine'")
    return list(overrides or [])


def refuse_unread(overrides: Iterable[str], read: Iterable[str], command: str) -> None:
    """Refuse overrides of groups that a command does not read, which would change nothing without a word.

    Raises
    ------
    InputError : naming the key and the groups that the command reads
    """
    for text in overrides:
        key = text.lstrip("+~").split("=")[0]
        if key.split(".")[0] not in read and key.split(".")[0] in _KEYS:
            raise InputError(f"{shown(key)}: is not read by {command}, which accepts {', '.join(sorted(read))}")


def compose(experiment: str = "paper", overrides: str | Iterable[str] | None = None) -> dict[str, Any]:
    """Compose and check one experiment.

    Parameters
    ----------
    experiment : a name in conf/experiment or the path of such a file (``.yaml``)
    overrides : Hydra overrides, as one string or a list; ``actuator=mine.yaml`` takes the file of an actuator (see
        ``datasheet``)

    Returns
    -------
    the configuration as plain, recursively sorted dictionaries

    Raises
    ------
    InputError : an unknown key, group option or experiment, or an impossible value
    """
    if not isinstance(experiment, str):
        raise InputError(f"experiment: got {shown(repr(experiment))}, accepted is a name or the path of a .yaml file")
    texts = split_overrides(overrides)
    keys = [text.lstrip("+~").split("=")[0] for text in texts]
    for key in keys:
        if keys.count(key) > 1:
            raise InputError(f"{shown(key)}: is overridden twice, accepted is one value")
    return composed(experiment, texts)


def composed(experiment: str, overrides: list[str]) -> dict[str, Any]:
    """The same of overrides of which the last one counts."""
    path, given = _experiment_file(experiment)
    texts = [item for text in overrides for item in _of_actuator_file(text)]
    return _compose(path, path.read_text(encoding="utf-8") if given else "", tuple(texts))


def _of_actuator_file(text: str) -> list[str]:
    """An override; of one that names the file of an actuator those of its numbers."""
    key, _, value = text.partition("=")
    if key != "actuator" or not value.endswith((".yaml", ".yml")):
        return [text]
    from ..datasheet.compose import of_file

    return of_file(file_at(value, "actuator")).overrides()


@functools.cache
def _compose(path: Path, text: str, overrides: tuple[str, ...]) -> dict[str, Any]:
    """Compose the experiment of conf/experiment, or the one of which this is the text."""
    import hydra
    import yaml
    from hydra.errors import HydraException
    from omegaconf.errors import OmegaConfBaseException

    items = [_checked_override(item) for item in overrides]
    with (
        tempfile.TemporaryDirectory(prefix="emafault-") as folder,
        hydra.initialize_config_dir(str(CONF), version_base="1.3"),
    ):
        chosen = [f"experiment={path.stem}"]
        if text:  # under a name of our own, since Hydra reads null, 1 or a=b in names
            (Path(folder) / "experiment").mkdir()
            (Path(folder) / "experiment" / f"{_GIVEN}.yaml").write_text(text, encoding="utf-8")
            chosen = [f"experiment={_GIVEN}", f"hydra.searchpath=['file://{folder}']"]
        try:
            composed = hydra.compose("config", overrides=[*chosen, *items])
            config: Any = OmegaConf.to_container(composed, resolve=True, throw_on_missing=True)
        except (HydraException, OmegaConfBaseException, yaml.YAMLError, RecursionError, ValueError) as error:
            about = f"{shown(path)}: " if text and not overrides else ""
            said = _list_for_mapping(path, text) or _one_line(error, chosen, overrides)
            raise InputError(about + said.replace(_GIVEN, path.stem)) from error
    config["name"] = config["name"] or path.stem
    config["dataset"] = config["dataset"] or path.stem
    checks.check_configuration(config)
    return recursively_sorted(config) | {"variants": config["variants"]}  # variants keep their order


def _experiment_file(experiment: str) -> tuple[Path, bool]:
    """The file of an experiment, checked, and whether it was given as a path."""
    given = experiment.endswith((".yaml", ".yml"))
    if not given and experiment not in experiments():
        named = f"experiment: got '{shown(experiment)}'"
        raise InputError(f"{named}, accepted are {', '.join(experiments())} or the path of a .yaml file")
    path = file_at(experiment, "experiment") if given else experiment_path(experiment)
    checks.check_name(f"experiment: {shown(path)}: its name", path.stem, parts=1)
    read = read_yaml(path)
    defaults = read.get("defaults", [])
    if not isinstance(defaults, list) or not all(isinstance(entry, str | dict) for entry in defaults):
        raise InputError(
            f"{shown(path)}: defaults: got {shown(repr(defaults))}, accepted is a list of words and options"
        )
    chosen = [key for entry in defaults if isinstance(entry, dict) for key in entry]
    for key in chosen:
        if chosen.count(key) > 1:
            raise InputError(f"{shown(path)}: defaults: {shown(key)} is chosen twice, accepted is one option")
    for key in _unset(read):
        raise InputError(f"{shown(path)}: {key}: needs a value")
    if "hydra" in read:
        raise InputError(f"{shown(path)}: hydra: is not a key of an experiment")
    return path, given


def _unset(read: Mapping[str, Any], above: str = "") -> list[str]:
    """Keys that stand without a value."""
    found = []
    for key, value in read.items():
        if value == "???":
            found.append(f"{above}{key}")
        elif isinstance(value, Mapping):
            found += _unset(value, f"{above}{key}.")
    return found


def _checked_override(text: str) -> str:
    """One override, refused in one line if it cannot be read; effects may be added without a plus sign."""
    from hydra.core.override_parser.overrides_parser import OverridesParser
    from hydra.errors import HydraException

    try:
        (item,) = OverridesParser.create().parse_overrides([text])
    except HydraException as error:
        raise InputError(
            f"override {shown(repr(text))}: cannot be read, accepted is key=value or group=option"
        ) from error
    key = item.key_or_group
    if not key or len(key) > LONGEST_KEY:
        raise InputError(f"override {shown(repr(text))}: has no key that there could be, accepted is key=value")
    if item.package is not None or key.split(".")[0].split("/")[0] == "hydra":
        raise InputError(f"{shown(text)}: packages and Hydra's own keys are not accepted, key=value or group=option is")
    if item.is_sweep_override():
        raise InputError(f"{key}: got the sweep {text!r}, accepted is one value; a study's variants are an experiment")
    if key == "experiment":
        how = "--experiment NAME, or experiment=NAME beside overrides"
        raise InputError(f"experiment: is chosen by itself ({how}), not as an override")
    if key in GROUPS and not item.is_delete():
        options = sorted(p.stem for p in (CONF / key).glob("*.yaml"))
        chosen = item.value()
        for option in chosen if isinstance(chosen, list) and key == "reconstruction" else [chosen]:
            if option not in options:
                own = " or the path of a .yaml file" if key == "actuator" else ""
                raise InputError(f"{key}: got {option!r}, accepted is {', '.join(options)}{own}")
    if key.startswith(("effects.", "tolerances.")) and not text.startswith(("+", "~")):
        return f"++{text}"
    return text


def _list_for_mapping(path: Path, text: str) -> str:
    """What refuses an experiment that puts a list where keys are accepted, of which Hydra does not say where."""
    from hydra import compose as hydra_compose

    read: Any = OmegaConf.to_container(OmegaConf.create(text or path.read_text(encoding="utf-8")))
    pending: list[tuple[str, Any, Any]] = [("", read, OmegaConf.to_container(hydra_compose("config")))]
    while pending:
        above, read, base = pending.pop()
        for name, value in read.items():
            below = base.get(name)
            if isinstance(below, dict):
                key = f"{above}{name}"
                if isinstance(value, list):
                    return f"{key}: got {shown(repr(value))}, accepted is a mapping with {', '.join(map(str, below))}"
                if isinstance(value, dict):
                    pending.append((f"{key}.", value, below))
    return ""


def _one_line(error: Exception, chosen: list[str], overrides: tuple[str, ...]) -> str:
    """Hydra's refusal as one line; an unknown key is answered with the keys there are."""
    from hydra import compose as hydra_compose
    from hydra.errors import HydraException

    if isinstance(error, RecursionError):
        return "defaults: refer to themselves, accepted are other files"
    if getattr(error, "full_key", None) and "Missing mandatory value" in str(error):
        key = error.full_key  # type: ignore[attr-defined]
        return f"{key}: needs a value, accepted is {key}=VALUE"
    groups = [text for text in overrides if text.split("=")[0] in GROUPS]
    try:
        base = hydra_compose("config", overrides=[*chosen, *groups])
    except HydraException:  # the experiment itself is what is wrong
        return one_line(error)
    for text in overrides:
        words, node = text.lstrip("+~").split("=")[0].split("."), base
        for depth, word in enumerate(words):
            if not OmegaConf.is_dict(node):
                return f"{'.'.join(words)}: there is no such key; {'.'.join(words[:depth])} is a single value"
            if word not in node:
                return schema.unknown_key(".".join(words[depth:]), ".".join(words[:depth]), [str(k) for k in node])
            node = OmegaConf.select(base, ".".join(words[: depth + 1]))
    return one_line(error)

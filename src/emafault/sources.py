"""Where each value of a composed configuration comes from: a file of ``conf``, the experiment or an override."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from .config import GROUPS, split_overrides
from .paths import CONF
from .plain import read_yaml


def sources(experiment: str, overrides: str | Iterable[str] | None, keys: Iterable[str]) -> dict[str, str]:
    """What gives each key of a configuration its value.

    Parameters
    ----------
    experiment, overrides : as of ``config.compose``, which has accepted them
    keys : dotted, of values that are no mappings

    Returns
    -------
    key -> the override, or the path of a file
    """
    texts = [text.lstrip("+~") for text in split_overrides(overrides)]
    given = {text.split("=")[0]: text for text in texts}
    given_file = experiment.endswith((".yaml", ".yml"))
    path = Path(experiment) if given_file else CONF / "experiment" / f"{experiment}.yaml"
    own = read_yaml(path)
    base = read_yaml(CONF / "config.yaml")
    chosen = _options(base) | _options(own) | {g: t.split("=", 1)[1] for g, t in given.items() if g in GROUPS}
    return {key: _source(key, given, own, path.as_posix() if given_file else _shown(path), chosen) for key in keys}


def _source(key: str, given: Mapping[str, str], own: Mapping[str, Any], experiment: str, chosen: Mapping) -> str:
    words = key.split(".")
    above = [".".join(words[:n]) for n in range(len(words), 0, -1)]
    for name in above:
        if name in given and name not in GROUPS:
            return f"override {given[name]}"
    if _holds(own, words):
        return experiment
    if words[0] in chosen:
        option = chosen[words[0]]
        return _shown(CONF / words[0] / f"{words[1] if isinstance(option, list) else option}.yaml")
    return "the experiment's file name" if key == "name" else _shown(CONF / "config.yaml")


def _options(read: Mapping[str, Any]) -> dict[str, Any]:
    """Group -> option, or options, that the defaults of a file choose."""
    return {
        key.removeprefix("override /"): option
        for entry in read.get("defaults", [])
        if isinstance(entry, Mapping)
        for key, option in entry.items()
    }


def _holds(tree: Any, words: list[str]) -> bool:
    for word in words:
        if not isinstance(tree, Mapping) or word not in tree:
            return False
        tree = tree[word]
    return True


def _shown(path: Path) -> str:
    return f"conf/{path.relative_to(CONF).as_posix()}"

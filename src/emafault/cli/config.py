"""``emafault config``: an experiment and overrides -> the configuration that a run would read."""

import argparse
from collections.abc import Mapping
from typing import Any

WIDTH = 60  # of the column of values


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "overrides", nargs="*", metavar="OVERRIDE", help="Hydra overrides, as command=sine actuator.gear_ratio=400"
    )
    parser.add_argument(
        "--experiment", default="paper", metavar="NAME", help="experiment to compose, or such a file (paper)"
    )
    parser.add_argument("--plain", action="store_true", help="print YAML without where the values come from")


def run(args: argparse.Namespace) -> None:
    """Print the composed configuration as YAML.

    Raises
    ------
    InputError : an unknown key, group option or experiment, or an impossible value
    """
    import yaml

    from .. import config
    from ..sources import sources

    composed = config.compose(args.experiment, args.overrides)
    text = yaml.safe_dump(composed, sort_keys=False, allow_unicode=True, width=float("inf"))
    if args.plain:
        print(text, end="")
        return
    found = sources(args.experiment, args.overrides, _keys(composed))
    for line, key in zip(text.splitlines(), _keys_of_lines(text)):
        print(f"{line:{WIDTH}} # {found[key]}" if key in found else line)


def _keys(tree: Mapping[str, Any], above: str = "") -> list[str]:
    """Dotted keys of the values that are no mapping."""
    found = []
    for key, value in tree.items():
        found += _keys(value, f"{above}{key}.") if isinstance(value, Mapping) and value else [f"{above}{key}"]
    return found


def _keys_of_lines(text: str) -> list[str]:
    """The dotted key that each line of YAML in block style gives a value to; empty of any other line."""
    path: list[tuple[int, str]] = []
    keys = []
    for line in text.splitlines():
        key, colon, _ = line.strip().partition(":")
        if not colon or line.strip().startswith("-"):
            keys.append("")
            continue
        depth = len(line) - len(line.lstrip())
        path = [(d, k) for d, k in path if d < depth] + [(depth, key)]
        keys.append(".".join(k for _, k in path))
    return keys

"""The option ``--actuator`` of the commands: the file of one's own actuator in the place of the reference actuator."""

import argparse


def add_actuator(parser: argparse.ArgumentParser) -> None:
    """Declare the option."""
    parser.add_argument("--actuator", metavar="FILE", help="file of one's own actuator (docs/actuators.md)")


def with_actuator(args: argparse.Namespace, overrides: list[str]) -> list[str]:
    """Overrides with what ``--actuator`` stands for before them, so that single values can still be changed."""
    return overrides if args.actuator is None else [of_file(args.actuator), *overrides]


def of_file(path: str) -> str:
    """The override of a file, refused here if it is not YAML, which an override would take for the name of an option.

    Raises
    ------
    InputError : a name that does not end as YAML's do
    """
    from ..errors import InputError, shown

    if not path.endswith((".yaml", ".yml")):
        raise InputError(f"--actuator: got '{shown(path)}', accepted is the path of a .yaml file")
    return f"actuator={path}"

"""The option ``--actuator`` of the commands: the file of one's own actuator in the place of the reference actuator."""

import argparse


def add_actuator(parser: argparse.ArgumentParser) -> None:
    """Declare the option."""
    parser.add_argument("--actuator", metavar="FILE", help="file of one's own actuator (docs/actuators.md)")


def with_actuator(args: argparse.Namespace, overrides: list[str]) -> list[str]:
    """Overrides with what ``--actuator`` stands for before them, so that single values can still be changed."""
    from ..datasheet.override import override_of

    return overrides if args.actuator is None else [override_of(args.actuator), *overrides]

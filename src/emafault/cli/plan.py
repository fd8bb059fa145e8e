"""``emafault plan``: a bench or its verdict -> what to record next, with motions that a bench can play."""

import argparse

from .machine import add_actuator, with_actuator


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "path", metavar="PATH", help="bench: a folder of recordings of the actuator; or the diagnosis.json of one"
    )
    parser.add_argument(
        "overrides",
        nargs="*",
        metavar="OVERRIDE",
        help="Hydra overrides of the nominal actuator, as actuator.gear_ratio=400",
    )
    add_actuator(parser)
    parser.add_argument("--out", metavar="DIR", help="folder for the motions (results/plans/<name of the bench>)")
    parser.add_argument("--force", action="store_true", help="replace files that are no motions")


def run(args: argparse.Namespace) -> None:
    """Print what to record next, and write each motion as a table of time (s) and position (rad).

    Raises
    ------
    InputError : recordings or a verdict that cannot be used, or a folder that cannot be written
    """
    from .. import config
    from ..equations.plan import plan

    overrides = with_actuator(args, args.overrides)
    config.refuse_unread(overrides, config.DIAGNOSED, "plan")
    plan(args.path, config.diagnosis_spec(config.compose(overrides=overrides)), args.out, args.force)

"""The command ``emafault``: one module for each subcommand, imported when it is called."""

import argparse
import importlib
import os
import sys
from collections.abc import Sequence

# before NumPy is imported: with more threads small linear algebra is many times slower
for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

#: subcommand -> what it does; its module of the same name has ``arguments(parser)`` and ``run(args)``
COMMANDS = {
    "import": "make recordings of measured files of any logger, by a map of their channels",
    "simulate": "simulate one recording of an actuator with a given fault",
    "identify": "identify the fault vector in recordings",
    "diagnose": "say where a simulator and a bench disagree, which effect causes it and how far it explains it",
    "plan": "say what to record next on a bench, and write the motions for it to play",
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a subcommand; 0 if it did what was asked, 2 with one line on refused input."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    parser = argparse.ArgumentParser(prog="emafault", description=importlib.import_module("emafault").__doc__)
    parser.add_argument(
        "--version", action="version", version=f"emafault {importlib.import_module('emafault').__version__}"
    )
    subparsers = parser.add_subparsers(dest="command", required=True, metavar="{" + ",".join(COMMANDS) + "}")
    for name, text in COMMANDS.items():
        sub = subparsers.add_parser(name, help=text, description=text[0].upper() + text[1:] + ".")
        if name in given[:1]:
            importlib.import_module(f"{__name__}.{name}").arguments(sub)
    args, rest = parser.parse_known_args(given)
    if rest and (not hasattr(args, "overrides") or any(word.startswith("-") for word in rest)):
        parser.error(f"unrecognized arguments: {' '.join(rest)}")
    if rest:  # overrides that follow an option
        args.overrides += rest

    from ..errors import InputError

    try:
        importlib.import_module(f"{__name__}.{args.command}").run(args)
    except InputError as error:
        print(f"emafault {args.command}: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    return 0

"""``emafault completion``: the script by which a shell completes commands, options and paths."""

import argparse

from . import COMMANDS, parser_of

SHELLS = ("bash", "zsh", "tcsh")
#: names of arguments that are completed by paths
FOLDERS, FILES = ("DIR",), ("PATH", "FILE", "FILE_OR_FOLDER", "HEALTHY", "BENCH", "MAP", "OUT", "FILE | OVERRIDE")


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("shell", choices=SHELLS, help="as in: emafault completion bash > ~/.emafault-completion")


def run(args: argparse.Namespace) -> None:
    """Print the script.

    Raises
    ------
    InputError : the library that writes it is not installed
    """
    from ..errors import InputError

    try:
        import shtab
    except ImportError:
        raise InputError('needs the library shtab: pip install "emafault[completion]"') from None
    parser, subparsers = parser_of(COMMANDS)
    for action in (action for sub in subparsers.choices.values() for action in sub._actions):
        name = action.metavar or action.dest.upper()
        if name in FOLDERS or name in FILES:
            action.complete = shtab.DIRECTORY if name in FOLDERS else shtab.FILE
    print(shtab.complete(parser, shell=args.shell))

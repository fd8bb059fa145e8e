"""The command ``emafault``: one module for each subcommand, imported when it is called."""

import argparse
import importlib
import os
import sys
from collections.abc import Collection, Sequence
from typing import Any, NoReturn

from ..errors import InputError, one_line, shown

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
    "actuator": "compose the file of one's own actuator, identify its numbers in healthy recordings, or export them",
    "demo": "diagnose the bench in the box and open its page",
    "runs": "open MLflow on what was logged, with the columns that one compares",
    "config": "print a composed configuration, with where each value comes from",
    "schema": "print the JSON Schema of a file that emafault writes or reads",
    "completion": "print the completion script of a shell",
}


class _Parser(argparse.ArgumentParser):
    """Refuses in one line, as everything else does."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {shown(message, 400)} ({self.prog} --help)\n")


def whole_number(text: str) -> int:
    """A seed: what ``type`` of an argument makes of its text."""
    if not (text.isascii() and text.isdigit() and int(text[:20]) <= 2**31):
        raise argparse.ArgumentTypeError(f"got '{shown(text)}', accepted is an integer from 0 to {2**31}")
    return int(text)


def parser_of(commands: Collection[str]) -> tuple[argparse.ArgumentParser, Any]:
    """The parser and its subparsers, with the arguments of these commands, whose modules are imported for them."""
    package = importlib.import_module("emafault")
    parser = _Parser(prog="emafault", description=package.__doc__)
    parser.add_argument("--version", action="version", version=f"emafault {package.__version__}")
    subparsers = parser.add_subparsers(dest="command", required=True, metavar="{" + ",".join(COMMANDS) + "}")
    for name, text in COMMANDS.items():
        sub = subparsers.add_parser(name, help=text, description=text[0].upper() + text[1:] + ".")
        if name in commands:
            importlib.import_module(f"{__name__}.{name}").arguments(sub)
    return parser, subparsers


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a subcommand; 0 if it did what was asked, 2 with one line on refused input, 1 on a fault of the program."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    parser, subparsers = parser_of(given[:1])
    args, rest = parser.parse_known_args(given)
    if rest and (not hasattr(args, "overrides") or any(word.startswith("-") for word in rest)):
        subparsers.choices[args.command].error(f"unrecognized arguments: {shown(' '.join(rest))}")
    if rest:  # overrides that follow an option
        args.overrides += rest
    try:
        importlib.import_module(f"{__name__}.{args.command}").run(args)
        sys.stdout.flush()
    except InputError as error:
        print(f"emafault {args.command}: {one_line(error)}", file=sys.stderr)
        return 2
    except BrokenPipeError:  # whoever read what is printed has read enough
        sys.stdout = open(os.devnull, "w")
        return 0
    except KeyboardInterrupt:
        print(f"emafault {args.command}: interrupted", file=sys.stderr)
        return 130
    except Exception as error:
        if os.environ.get("EMAFAULT_TRACEBACK"):
            raise
        text = f"{type(error).__name__}: {shown(error)}"
        remedy = "EMAFAULT_TRACEBACK=1 shows where; please report it with that and the command"
        print(f"emafault {args.command}: a fault of emafault, not of its input: {text}; {remedy}", file=sys.stderr)
        return 1
    return 0

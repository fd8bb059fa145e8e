"""``emafault schema``: the JSON Schemas of what is written and read."""

import argparse


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("name", nargs="?", metavar="NAME", help="such as verdict or map; without one all are listed")


def run(args: argparse.Namespace) -> None:
    """Print a schema, or the names of all: every ``NAME.schema.json`` of the package.

    Raises
    ------
    InputError : a schema that there is not
    """
    from ..errors import InputError, shown
    from ..paths import PACKAGE

    ending = ".schema.json"
    schemas = {path.name.removesuffix(ending): path for path in sorted(PACKAGE.rglob(f"*{ending}"))}
    if args.name is None:
        print("\n".join(schemas))
    elif args.name not in schemas:
        raise InputError(f"schema: got '{shown(args.name)}', accepted are {', '.join(schemas)}")
    else:
        print(schemas[args.name].read_text(encoding="utf-8"), end="")

"""``emafault import``: measured files and a map -> a bench of recordings."""

import argparse
from pathlib import Path


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "overrides",
        nargs="*",
        metavar="FILE | OVERRIDE",
        help="files to list, or to guess a map for; of an import, Hydra overrides of the nominal actuator, as "
        "actuator.pole_pairs=7",
    )
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--list", action="store_true", help="show the channels of the files, with units and rates")
    what.add_argument("--guess", metavar="MAP", help="write a map guessed from the channels' names and units")
    what.add_argument("--map", metavar="MAP", help="import by this map")
    parser.add_argument("--out", metavar="DIR", help="folder to write recordings and import.html to")


def run(args: argparse.Namespace) -> None:
    """List, guess or import.

    Raises
    ------
    InputError : a file or map that cannot be used, or a folder that cannot be written
    """
    from ..errors import InputError

    files = args.overrides
    if args.map:
        if not args.out:
            raise InputError("--map: needs --out DIR, a folder to write to")
        _import(args.map, args.out, args.overrides)
        return
    if not files:
        raise InputError("no file is named; name at least one")
    if args.list:
        from ..imports.listing import as_text, listed

        for path in files:
            print(f"{path}\n{as_text(listed(path))}")
        return
    from ..imports.guess import guess
    from ..io.atomic import write_text

    if Path(args.guess).exists():
        raise InputError(f"{args.guess}: exists; name a new map")
    write_text(args.guess, guess(files, Path(args.guess).parent))
    print(f"{args.guess}: fill in every ???, then emafault import --map {args.guess} --out bench/")


def _import(path: str, out: str, overrides: list[str]) -> None:
    from .. import config
    from ..actuator.parameters import ActuatorParameters
    from ..imports.run import import_bench

    spec = config.diagnosis_spec(config.compose(overrides=overrides))
    result = import_bench(path, out, ActuatorParameters(**spec["actuator"]), spec["sensors"]["voltage"])
    for finding in result.findings:
        print(finding.text())
    for name, lost in result.lost.items():
        for text in dict.fromkeys(lost):
            print(f"{name}: {text}")
    print(f"{', '.join(result.recordings)} and import.html written to {out}")

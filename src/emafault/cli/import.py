"""``emafault import``: measured files and a map -> a bench of recordings, or the tables of another kind of machine."""

import argparse
from pathlib import Path

from .machine import add_actuator, with_actuator


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "overrides",
        nargs="*",
        metavar="FILE | OVERRIDE",
        help="files to list, or to guess a map for; of an import, Hydra overrides of the nominal actuator, as "
        "actuator.pole_pairs=7",
    )
    add_actuator(parser)
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--list", action="store_true", help="show the channels of the files, with units and rates")
    what.add_argument("--guess", metavar="MAP", help="write a map guessed from the channels' names and units")
    what.add_argument("--map", metavar="MAP", help="import by this map")
    parser.add_argument("--out", metavar="DIR", help="folder to write recordings and import.html to")
    parser.add_argument("--force", action="store_true", help="replace files that exist")


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
        from ..imports.mapping import read_map

        given = read_map(args.map)
        if "machine" not in given:
            _import(args.map, args.out, with_actuator(args, args.overrides), args.force)
        elif files or args.actuator:
            raise InputError(f"{args.map}: names a machine, for which neither overrides nor --actuator are accepted")
        else:
            _import_tables(given, args.map, args.out, args.force)
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
    from ..places import refuse_output

    refuse_output(args.guess, "--guess", read=files, force=args.force)
    write_text(args.guess, guess(files, Path(args.guess).parent))
    print(f"{args.guess}: fill in every ???, then emafault import --map {args.guess} --out bench/")


def _import(path: str, out: str, overrides: list[str], force: bool) -> None:
    from .. import config
    from ..actuator.parameters import ActuatorParameters
    from ..imports.run import import_bench

    config.refuse_unread(overrides, config.DIAGNOSED, "import")
    spec = config.diagnosis_spec(config.compose(overrides=overrides))
    result = import_bench(path, out, ActuatorParameters(**spec["actuator"]), spec["sensors"]["voltage"], force)
    for finding in result.findings:
        print(finding.text())
    for name, lost in result.lost.items():
        for text in dict.fromkeys(lost):
            print(f"{name}: {text}")
    print(f"{', '.join(result.recordings)} and import.html written to {out}")


def _import_tables(given, path: str, out: str, force: bool) -> None:
    from ..imports.tables import import_tables

    notes = import_tables(given, path, out, force)
    for name, done in notes.items():
        for text in done:
            print(f"{name}: {text}")
    machine = given["machine"]
    print(f"{', '.join(notes)} written to {out}; next: emafault diagnose {out} --twin {machine}")

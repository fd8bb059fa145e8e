"""``emafault actuator``: the file of one's own actuator composed, identified in recordings, or exported."""

import argparse
import sys


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="{show,identify,export}")
    show = verbs.add_parser("show", help="print the numbers of the equations with their sources")
    identify = verbs.add_parser("identify", help="fit the numbers to healthy recordings and write the completed file")
    export = verbs.add_parser("export", help="print the joint's numbers for another simulator")
    for verb in (show, identify, export):
        verb.add_argument("file", metavar="FILE", help="file of the actuator (docs/actuators.md)")
    identify.add_argument("recordings", nargs="+", metavar="HEALTHY", help="healthy recordings, or folders of them")
    identify.add_argument("--out", metavar="FILE", help="completed file to write (FILE with _identified in its name)")
    export.add_argument("--to", required=True, choices=["mjcf", "urdf"], help="format")
    export.add_argument("--out", metavar="FILE", help="file to write, instead of printing")
    for verb in (identify, export):
        verb.add_argument("--force", action="store_true", help="replace the file if it exists")


def run(args: argparse.Namespace) -> None:
    """Show, identify or export.

    Raises
    ------
    InputError : a file or recordings that cannot be used, or a file that cannot be written
    """
    {"show": _show, "identify": _identify, "export": _export}[args.verb](args)


def _show(args: argparse.Namespace) -> None:
    from ..datasheet.compose import as_text, of_file

    print(as_text(of_file(args.file)))


def _identify(args: argparse.Namespace) -> None:
    from pathlib import Path

    from .. import config
    from ..actuator.sensors import SensorNoise
    from ..datasheet.compose import as_text, compose
    from ..datasheet.identify import identify_actuator
    from ..datasheet.sheet import read_sheet
    from ..datasheet.write import completed
    from ..io.atomic import write_text
    from ..io.recording import recordings_in
    from ..places import refuse_output

    sheet = read_sheet(args.file)
    machine = compose(sheet)
    files = recordings_in(args.recordings)
    path = Path(args.file)
    out = args.out or str(path.with_name(f"{path.stem}_identified{path.suffix}"))
    refuse_output(out, "--out", read=[args.file, *files], force=args.force)
    found = identify_actuator(machine, files, SensorNoise(**config.compose()["sensors"]))
    print(as_text(found.machine))
    for note in found.notes:
        print(f"note: {note}")
    for name in found.kept:
        print(f"{name}: these recordings do not determine it; that of the file stays", file=sys.stderr)
    write_text(out, completed(sheet, found.machine, len(files)))
    print(f"written to {out}")


def _export(args: argparse.Namespace) -> None:
    from ..datasheet.compose import of_file
    from ..datasheet.export import FORMATS
    from ..io.atomic import write_text
    from ..places import refuse_output

    if args.out is not None:
        refuse_output(args.out, "--out", read=[args.file], force=args.force)
    machine = of_file(args.file)
    text = FORMATS[args.to](machine.name, machine.actuator)
    if args.out is None:
        print(text, end="")
    else:
        write_text(args.out, text)
        print(f"written to {args.out}")

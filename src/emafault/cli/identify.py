"""``emafault identify``: recordings -> fault vectors with intervals, by a method and a trained experiment."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import shown
from .machine import add_actuator

if TYPE_CHECKING:
    from ..api.identification import Identification


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("files", nargs="+", metavar="FILE_OR_FOLDER", help="recordings, or folders of them (*.nc)")
    parser.add_argument("--experiment", default="paper", metavar="NAME", help="trained experiment to use (paper)")
    add_actuator(parser)
    parser.add_argument("--json", metavar="OUT", help="file to write the estimates to")
    parser.add_argument(
        "--reference",
        nargs="+",
        default=[],
        metavar="HEALTHY",
        help="healthy recordings of the same unit, to calibrate it with",
    )
    parser.add_argument(
        "--method",
        metavar="RECONSTRUCTION[/ESTIMATOR]",
        help="such as weighted/network or paper/closed_form; the most accurate of the experiment unless given",
    )
    parser.add_argument(
        "--diagnosis",
        metavar="VERDICT",
        help="diagnosis.json of their bench: the fault vectors with the effects taken out that it names and describes",
    )
    parser.add_argument(
        "--together",
        action="store_true",
        help="the recordings are of one unit with one fault: N and xi from all of them, the temperature of each",
    )
    parser.add_argument("--level", type=float, default=0.9, help="of the intervals (0.9)")
    parser.add_argument("--force", action="store_true", help="replace the file of --json if it exists")
    parser.add_argument("--results", metavar="DIR", help="folder of results (results here, else the project's)")


def run(args: argparse.Namespace) -> None:
    """Identify, print a table and write the JSON file.

    Raises
    ------
    InputError : recordings, a reference, an experiment or a method that cannot be used
    """
    from ..api.identification import identify
    from ..api.recordings import Recordings
    from ..io.recording import read_recording, recordings_in
    from ..places import refuse_output

    paths, healthy = recordings_in(args.files), recordings_in(args.reference)
    if args.json is not None:
        refuse_output(args.json, "--json", read=[*paths, *healthy], force=args.force)
    if args.diagnosis is not None:
        _of_diagnosis(args, paths)
        return
    given, reference = (
        Recordings(what, {str(path): read_recording(path) for path in files})
        for what, files in (("files", paths), ("--reference", healthy))
    )
    options = {"results": args.results, "actuator": args.actuator, "together": args.together}
    found = identify(given, reference, args.experiment, args.method, args.level, **options)
    _tell(found, args)


def _of_diagnosis(args: argparse.Namespace, paths: list[Path]) -> None:
    """Print, and write, what a diagnosis has of these recordings.

    Raises
    ------
    InputError : options that a diagnosis does not take, or a verdict that is not of these recordings
    """
    from ..api.identification import of_diagnosis
    from ..errors import InputError

    for option in ("reference", "method", "actuator", "together"):
        if getattr(args, option):
            raise InputError(f"--{option}: is that of the diagnosis where --diagnosis is given")
    _tell(of_diagnosis(args.diagnosis, paths, args.level), args)


def _tell(found: "Identification", args: argparse.Namespace) -> None:
    import json

    from ..io.atomic import write_text

    print(found)
    for name, note in found.notes.items():
        print(f"{shown(name)}: {note}", file=sys.stderr)
    if args.json is not None:
        write_text(args.json, json.dumps(found.estimates, indent=1) + "\n")

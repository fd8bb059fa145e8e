"""``emafault identify``: recordings -> fault vectors with intervals, by a method and a trained experiment."""

import argparse
import sys
from pathlib import Path

from ..errors import shown
from .machine import add_actuator


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
    parser.add_argument("--level", type=float, default=0.9, help="of the intervals (0.9)")
    parser.add_argument("--force", action="store_true", help="replace the file of --json if it exists")
    parser.add_argument("--results", metavar="DIR", help="folder of results (results here, else the project's)")


def run(args: argparse.Namespace) -> None:
    """Identify, print a table and write the JSON file.

    Raises
    ------
    InputError : recordings, a reference, an experiment or a method that cannot be used
    """
    import json

    from ..identification.recordings import identify_recordings
    from ..io.atomic import write_text
    from ..io.recording import read_recording, recordings_in
    from ..places import refuse_output
    from .model import load_model

    paths, healthy = recordings_in(args.files), recordings_in(args.reference)
    if args.json is not None:
        refuse_output(args.json, "--json", read=[*paths, *healthy], force=args.force)
    if args.diagnosis is not None:
        _of_diagnosis(args, paths)
        return
    model = load_model(args.experiment, args.method, args.results, args.actuator)
    reference = [read_recording(path) for path in healthy]
    found = identify_recordings(model, [read_recording(path) for path in paths], reference, args.level)
    result = {str(path): estimate for path, estimate in zip(paths, found.estimates)}
    print(table(result, args.level))
    unit = f"calibrated on {len(reference)} healthy recording(s)" if reference else "taken for nominal (no --reference)"
    print(f"experiment {args.experiment}, method {model.name}, unit {unit}")
    for path, note in zip(paths, found.notes):
        if note:
            print(f"{shown(path)}: {note}", file=sys.stderr)
    if args.json is not None:
        write_text(args.json, json.dumps(result, indent=1) + "\n")


def _of_diagnosis(args: argparse.Namespace, paths: list[Path]) -> None:
    """Print, and write, what a diagnosis has of these recordings.

    Raises
    ------
    InputError : options that a diagnosis does not take, or a verdict that is not of these recordings
    """
    import json

    from ..errors import InputError
    from ..identification.diagnosed import of_verdict
    from ..io.atomic import write_text

    for option in ("reference", "method", "actuator"):
        if getattr(args, option):
            raise InputError(f"--{option}: is that of the diagnosis where --diagnosis is given")
    found = of_verdict(args.diagnosis, paths, args.level)
    result = {str(path): estimate for path, estimate in zip(paths, found.estimates)}
    print(table(result, args.level))
    taken_out = ", ".join(found.taken_out) or "nothing"
    print(f"diagnosis {args.diagnosis}, taken out: {taken_out}, the unit's tolerances fitted")
    if args.json is not None:
        write_text(args.json, json.dumps(result, indent=1) + "\n")


def table(result: dict, level: float) -> str:
    """Estimates and intervals as aligned text."""
    from ..faults import FAULT_NAMES

    width = max(len("file"), *(len(shown(name)) for name in result))
    lines = [f"{'file':{width}} " + " ".join(f"{name:>28}" for name in FAULT_NAMES)]
    for name, estimate in result.items():
        cells = []
        for component in FAULT_NAMES:
            e, digits = estimate[component], 2 if component == "dT" else 4
            cells.append(f"{e['value']:9.{digits}f} [{e['low']:7.{digits}f}, {e['high']:7.{digits}f}]")
        lines.append(f"{shown(name):{width}} " + " ".join(f"{cell:>28}" for cell in cells))
    return "\n".join([*lines, f"in brackets {100 * level:.0f} % intervals; N and xi in 1, dT in K above 20 degC"])

"""``emafault diagnose``: a bench of recordings -> a verdict, by the twin of the machine it was recorded on."""

import argparse
from pathlib import Path

from .machine import add_actuator, with_actuator


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("path", metavar="PATH", help="bench: a folder of recordings, or a file that the twin reads")
    parser.add_argument(
        "overrides",
        nargs="*",
        metavar="OVERRIDE",
        help="Hydra overrides of the nominal actuator, as actuator.gear_ratio=400",
    )
    add_actuator(parser)
    parser.add_argument("--out", metavar="DIR", help="folder to write to (results/diagnoses/<name of the bench>)")
    parser.add_argument(
        "--twin",
        default="actuator",
        metavar="NAME",
        help="machine the bench comes from, or a Python file that states one",
    )
    parser.add_argument(
        "--exclude", nargs="+", default=[], metavar="EFFECT", help="effects to leave out of the library"
    )
    parser.add_argument(
        "--experiment", metavar="NAME", help="write the fix as conf/experiment/NAME.yaml too, for snakemake to run"
    )
    parser.add_argument(
        "--corrected", metavar="DIR", help="write the recordings with the faults of their measuring chain undone to DIR"
    )
    parser.add_argument(
        "--calibration", metavar="FILE", help="calibration.json of the actuator, which snakemake calibration writes"
    )
    parser.add_argument(
        "--samples",
        type=int,
        metavar="N",
        help="most samples that are taken of a bench, spread over conditions (100000)",
    )
    parser.add_argument("--force", action="store_true", help="replace files that are not of this bench's diagnosis")
    parser.add_argument("--no-tracking", action="store_true", help="log no MLflow run")


def run(args: argparse.Namespace) -> None:
    """Diagnose and write ``diagnosis.json``, ``report.html`` and ``experiment.yaml``.

    Raises
    ------
    InputError : recordings, a twin or a setting that cannot be used
    """
    from .. import config
    from ..checks import LONGEST_NAME
    from ..errors import InputError, shown
    from ..io.enough import SAMPLES
    from ..reporting.written import refuse_experiment

    actuator = args.twin == "actuator"
    overrides = with_actuator(args, args.overrides)
    config.refuse_unread(overrides, config.DIAGNOSED if actuator else ("tracking",), "diagnose")
    target = None
    if args.experiment:
        word = args.experiment
        if not (word.isascii() and word.replace("_", "").replace("-", "").isalnum()) or len(word) > LONGEST_NAME:
            raise InputError(f"--experiment: got '{shown(word)}', accepted are letters, digits, _ and -")
        target = config.experiment_path(word)
        refuse_experiment(target)
    spec = config.diagnosis_spec(config.compose(overrides=overrides))
    tracking = not args.no_tracking
    if actuator:
        from ..equations.run import diagnose_folder

        more = args.corrected, args.force, args.calibration, SAMPLES if args.samples is None else args.samples
        diagnose_folder(args.path, spec, args.out, args.exclude, target, tracking, *more)
        if args.corrected:
            print(identified(args.path, args.corrected, args.actuator))
    else:
        if args.corrected:
            raise InputError("--corrected: only recordings of the actuator can be corrected")
        if args.samples is not None:
            raise InputError("--samples: only of recordings of the actuator, accepted without --twin")
        if args.calibration:
            raise InputError("--calibration: only probabilities of an actuator are checked, accepted without --twin")
        if target is not None:
            raise InputError("--experiment: a measured machine has no simulator that could run one")
        from ..machines.run import diagnose_file

        diagnose_file(args.path, args.twin, spec, args.out, args.exclude, tracking, args.force)
    if target is not None:
        print(f"snakemake --cores all --config experiment={Path(target).stem}")


def identified(bench: str | Path, corrected: str | Path, actuator: str | None = None) -> str:
    """Fault vectors identified in recordings of a bench and in the corrected ones, as aligned text.

    By what ``emafault identify`` uses unless told otherwise; a recording that determines no fault vector is left out.
    """
    from ..api.model import load_model
    from ..errors import InputError
    from ..faults import FAULT_NAMES
    from ..identification.recordings import identify_recordings
    from ..io.recording import read_recording, recordings_in

    model = load_model("paper", actuator=actuator)
    originals = {path.name: path for path in recordings_in([bench])}
    width = max(len("identified in"), *(len(name) for name in originals))
    lines = [f"{'identified in':{width}} {'':>9} " + " ".join(f"{name:>9}" for name in FAULT_NAMES)]
    for path in recordings_in([corrected]):
        recordings = [read_recording(p) for p in (originals[path.name], path)]
        try:
            found = identify_recordings(model, recordings).estimates
        except InputError:
            continue
        rows = {stage: [e[c]["value"] for c in FAULT_NAMES] for stage, e in zip(("recorded", "corrected"), found)}
        truth = recordings[0].fault
        rows |= {} if truth is None else {"true": truth.tolist()}
        for n, (stage, values) in enumerate(rows.items()):
            cells = " ".join(f"{x:9.{2 if c == 'dT' else 4}f}" for c, x in zip(FAULT_NAMES, values))
            lines.append(f"{path.name if n == 0 else '':{width}} {stage:>9} {cells}")
    return "\n".join([*lines, f"method {model.name}, unit taken for nominal; N and xi in 1, dT in K above 20 degC"])

"""``emafault diagnose``: a bench of recordings -> a verdict, by the twin of the machine it was recorded on."""

import argparse
from pathlib import Path


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("path", metavar="PATH", help="bench: a folder of recordings, or a file that the twin reads")
    parser.add_argument(
        "overrides",
        nargs="*",
        metavar="OVERRIDE",
        help="Hydra overrides of the nominal actuator, as actuator.gear_ratio=400",
    )
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
    from ..reporting.written import refuse_experiment

    actuator = args.twin == "actuator"
    config.refuse_unread(args.overrides, config.DIAGNOSED if actuator else ("tracking",), "diagnose")
    target = None
    if args.experiment:
        word = args.experiment
        if not (word.isascii() and word.replace("_", "").replace("-", "").isalnum()) or len(word) > LONGEST_NAME:
            raise InputError(f"--experiment: got '{shown(word)}', accepted are letters, digits, _ and -")
        target = config.CONF / "experiment" / f"{word}.yaml"
        refuse_experiment(target)
    spec = config.diagnosis_spec(config.compose(overrides=args.overrides))
    tracking = not args.no_tracking
    if actuator:
        from ..equations.run import diagnose_folder

        diagnose_folder(args.path, spec, args.out, args.exclude, target, tracking, args.corrected, args.force)
    else:
        if args.corrected:
            raise InputError("--corrected: only recordings of the actuator can be corrected")
        if target is not None:
            raise InputError("--experiment: a measured machine has no simulator that could run one")
        from ..machines.run import diagnose_file

        diagnose_file(args.path, args.twin, spec, args.out, args.exclude, tracking, args.force)
    if target is not None:
        print(f"snakemake --cores all --config experiment={Path(target).stem}")

"""``emafault diagnose``: a bench of recordings -> a verdict, by the twin of the machine it was recorded on."""

import argparse


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("path", metavar="PATH", help="bench: a folder of recordings, or a file that the twin reads")
    parser.add_argument("--out", metavar="DIR", help="folder to write to (results/diagnoses/<name of the bench>)")
    parser.add_argument("--twin", default="actuator", metavar="NAME", help="machine the bench comes from (actuator)")


def run(args: argparse.Namespace) -> None:
    """Diagnose and write ``diagnosis.json`` and ``report.html``.

    Raises
    ------
    InputError : recordings or a twin that cannot be used
    """
    from ..gap.diagnose import diagnose_path

    diagnose_path(args.path, out=args.out, twin=args.twin)

"""A few blind cases of one rung, diagnosed and scored, while developing.

    python benchmarks/ladder.py T7 [--cases 20] [--first SEED] [--out FOLDER]

Seeds are those of development, above every scoreboard's. A verdict that is there is not made again: give another
``--out`` after the diagnosis has changed.
"""

import argparse
import tempfile
from pathlib import Path

from emafault.config import compose, diagnosis_spec
from emafault.study.quick import look
from emafault.withheld.cases import RUNGS


def main() -> None:
    """Run the cases, print a line each and the scores."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("rung", choices=RUNGS)
    parser.add_argument("--cases", type=int, default=20)
    parser.add_argument("--first", type=int, default=0, help="seeds begin here, counted from the first of development")
    parser.add_argument("--out", type=Path, help="folder that keeps keys and verdicts; else they are lost")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        look(args.rung, args.cases, args.out or Path(scratch), diagnosis_spec(compose()), args.first)


if __name__ == "__main__":
    main()

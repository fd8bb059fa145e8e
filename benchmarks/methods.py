"""All methods by all experiments that were evaluated: errors over both bounds, and what 90 % intervals cover.

    python benchmarks/methods.py [--results DIR] [EXPERIMENT[/VARIANT] ...]

Prints a table in Markdown: mean absolute errors of dT (K), N and xi on fresh runs, the same over the bound of the
recordings (with the rate of heating unknown where the method has it so) and over that of six features with
floating-phase samples, of calibrated units over those with their healthy recordings; then the rows whose intervals
cover less or more than they should, by chance or not, and those below the bound by more than chance. What an experiment
needs to be evaluated is `snakemake --cores all --config experiment=NAME`; several_recordings is a target of its own.
"""

import argparse
import sys
from pathlib import Path

from emafault.errors import InputError, one_line
from emafault.paths import results_folder
from emafault.study.methods import markdown, rows_of


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="EXPERIMENT", help="of these alone (all that were evaluated)")
    parser.add_argument("--results", type=Path, default=None, help="folder of results (results)")
    args = parser.parse_args()
    try:
        rows = rows_of(args.results or results_folder(), args.names)
    except InputError as error:
        sys.exit(f"emafault: {one_line(error)}")
    print("\n".join(markdown(rows)))


if __name__ == "__main__":
    main()

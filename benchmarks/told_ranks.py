"""Ranks of true parameters within what verdicts on blind cases tell of them.

    python benchmarks/told_ranks.py FOLDER [--rung T1]

FOLDER is what ``ladder.py --out`` leaves, or a draw's.
"""

import argparse
from pathlib import Path

from emafault.study.told_ranks import told_ranks


def main() -> None:
    """Print the histogram, the share within 90 % intervals and the probability of ranks as uneven."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="of keys and diagnoses")
    parser.add_argument("--rung", default="T1")
    args = parser.parse_args()
    found = told_ranks(args.folder, args.rung)
    print(f"{found['cases']} cases named exactly, {len(found['ranks'])} parameters")
    if found["ranks"]:
        print(f"in tenths {found['counts']}, within 90 % intervals {found['inside']:.3f}, p = {found['p']:.3g}")


if __name__ == "__main__":
    main()

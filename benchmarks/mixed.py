"""How often a listed effect is named beside something that no catalogue lists, and another name beside it.

    python benchmarks/mixed.py [--cases N] [--first SEED] [--out FILE]

Benches of single effects are diagnosed as they are and with a disturbance of the measuring chain put in, or with a
controller whose gains are up to 50 % off; a third of the disturbances lie outside what the diagnosis has forms for.
"""

import argparse
from pathlib import Path

from emafault.config import compose, diagnosis_spec
from emafault.study.mixed import run_mixed


def main() -> None:
    """Run and print shares with 90 % bootstrap intervals."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=33)
    parser.add_argument("--first", type=int, default=0, help="seeds begin here, above those of every other draw")
    parser.add_argument("--out", type=Path, default=Path("results/mixed.json"))
    args = parser.parse_args()
    args.out.parent.mkdir(parents=True, exist_ok=True)
    spec = diagnosis_spec(compose()) | {"cases": args.cases, "first": args.first}
    found = run_mixed(spec, args.out)["summary"]
    for name, shares in found.items():
        cells = [
            f"{k.replace('_', ' ')} {v['value']:.2f} ({v['low']:.2f} to {v['high']:.2f})"
            for k, v in shares.items()
            if k != "cases"
        ]
        print(f"{name}, {shares['cases']} cases: {'; '.join(cells)}")


if __name__ == "__main__":
    main()

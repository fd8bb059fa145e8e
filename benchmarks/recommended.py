"""Whether recommended recordings decide what they promise, and how many are needed beside a random choice.

    python benchmarks/recommended.py [--cases 20] [--first SEED] [--rungs T1 T2]

Blind cases, on seeds of development, that a diagnosis leaves more than one reading of: the recording that it recommends
is simulated on the true unit and diagnosed with the others, until one reading is left. A line each, then the row of the
scoreboard (a promise is an expected Bayes factor of 20 or more), the expected beside the achieved log odds, and the
mean number of recordings, each way on the same cases.
"""

import argparse
from itertools import count

import numpy as np

from emafault.actuator.parameters import ActuatorParameters
from emafault.actuator.sensors import SensorNoise
from emafault.config import compose, diagnosis_spec
from emafault.study.blind import DEVELOPMENT
from emafault.study.recommended import DECIDED, MOST, Sequential, Step, at_random, recommended_first, sequence
from emafault.withheld.cases import RUNGS, draw_case


def main() -> None:
    """Go through cases until enough were left open."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=20, help="cases with more than one reading left")
    parser.add_argument("--first", type=int, default=0, help="seeds begin here, counted from the first of development")
    parser.add_argument("--rungs", nargs="+", default=["T1", "T2"], choices=RUNGS)
    args = parser.parse_args()
    spec = diagnosis_spec(compose())
    actuator, noise = ActuatorParameters(**spec["actuator"]), SensorNoise(**spec["sensors"])
    steps: list[Step] = []
    needed: list[tuple[Sequential, Sequential]] = []
    looked = 0
    for n in count(args.first):
        if len(needed) == args.cases:
            break
        case = draw_case(args.rungs[n % len(args.rungs)], DEVELOPMENT + n)
        found = sequence(case, recommended_first, actuator, noise)
        looked += 1
        if found.needed == 0 or not found.steps:
            continue
        chance = sequence(case, at_random(np.random.default_rng(case.seed)), actuator, noise)
        needed.append((found, chance))
        steps += found.steps
        print(f"{case.rung} {case.seed} ({', '.join(case.effects) or '-'}):", end=" ")
        print(f"{_told(found)} recommended, {_told(chance)} at random")
        for s in found.steps:
            truth = {1: "the first", -1: "the second", 0: "neither"}[s.acts]
            change = f"promised {s.promised:.1f}, from {s.before:.1f} to {s.after:.1f}"
            print(f"    {s.leading} or {s.rival}: {change}, {truth} acts", flush=True)
    promises = [s for s in steps if s.promised >= DECIDED]
    print(f"{looked} cases, {len(needed)} with more than one reading left")
    print(f"promises kept: {sum(s.kept for s in promises)} of {len(promises)}")
    for low, high in ((0.0, 1.0), (1.0, DECIDED), (DECIDED, np.inf)):
        some = [s.achieved for s in steps if low <= s.promised < high and s.achieved is not None]
        if some:
            middle = f"{np.median(some):.1f} (median of {len(some)})"
            print(f"expected log Bayes factor {low:g} to {high:g}: achieved {middle}")
    for word, k in (("recommended", 0), ("at random", 1)):
        counts = [MOST + 1 if pair[k].needed is None else pair[k].needed for pair in needed]
        print(f"{word}: {np.mean(counts):.2f} recordings until one reading is left, {MOST + 1} where {MOST} do not do")


def _told(found: Sequential) -> str:
    return f"more than {len(found.steps) or MOST}" if found.needed is None else str(found.needed)


if __name__ == "__main__":
    main()

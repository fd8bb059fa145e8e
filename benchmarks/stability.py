"""Whether the verdict is the same in other noise, and what is sure in some recordings of a unit denied in others.

    python benchmarks/stability.py [--cases 10] [--repetitions 20] [--first SEED] [--rungs T0 T1 T7]

The cases go through the rungs in turn; seeds are those of development, above every scoreboard's. The two rows of the
scoreboard that these are: the same verdict over 20 seeds of the noise (0.95), and an inclusion above 0.9 on some
recordings of a unit and below 0.1 on others (0.03). An effect may be denied because the other recordings do not show
it.
"""

import argparse

from emafault.actuator.parameters import ActuatorParameters
from emafault.actuator.sensors import SensorNoise
from emafault.config import compose, diagnosis_spec
from emafault.study.blind import DEVELOPMENT
from emafault.study.stability import stability
from emafault.withheld.cases import RUNGS


def main() -> None:
    """Run the cases; a line each, then the two shares."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=10)
    parser.add_argument("--repetitions", type=int, default=20)
    parser.add_argument("--first", type=int, default=0, help="seeds begin here, counted from the first of development")
    parser.add_argument("--rungs", nargs="+", default=["T0", "T1", "T7"], choices=RUNGS)
    args = parser.parse_args()
    spec = diagnosis_spec(compose())
    actuator, noise = ActuatorParameters(**spec["actuator"]), SensorNoise(**spec["sensors"])
    same, sure, denied = [], 0, 0
    for n in range(args.cases):
        rung, seed = args.rungs[n % len(args.rungs)], DEVELOPMENT + args.first + n
        found = stability(rung, seed, actuator, noise, args.repetitions)
        same.append(found.same)
        sure, denied = sure + len(found.sure), denied + len(found.denied)
        others = sorted(set(found.verdicts) - {max(found.verdicts, key=found.verdicts.count)})
        print(f"{rung} {seed}: {found.same:.2f} {max(found.verdicts, key=found.verdicts.count)}", flush=True)
        for verdict in others:
            print(f"    {found.verdicts.count(verdict)} of {args.repetitions}: {verdict}")
        if found.denied:
            print(f"    denied by other recordings: {', '.join(found.denied)}")
    print(f"same verdict over {args.repetitions} seeds of the noise: {sum(same) / len(same):.3f} of {len(same)} cases")
    print(f"sure on some recordings and denied on others: {denied} of {sure} effects")


if __name__ == "__main__":
    main()

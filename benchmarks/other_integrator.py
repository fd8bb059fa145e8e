"""Diagnoses of benches that a fixed step simulated: is another integrator taken for an effect, or an effect missed?

    python benchmarks/other_integrator.py [--step 1e-6] [--sampled] [--rung T1] [--first 1060000] [--cases 31]

Prints each verdict that is not right and how many of the detectable cases are; the seeds are those of development.
With ``--sampled`` comparator and commutation act at the steps only.
"""

import argparse
import json
import tempfile
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from emafault import config
from emafault.actuator.parameters import ActuatorParameters
from emafault.actuator.sensors import SensorNoise
from emafault.study.blind import diagnose_bench
from emafault.withheld.benches import simulate_truth, write_bench, write_key
from emafault.withheld.cases import draw_case
from emafault.withheld.verdicts import judge


def run(rung: str, seed: int, step: float, sampled: bool, folder: Path) -> dict:
    """Simulate, diagnose and judge one case."""
    spec = config.diagnosis_spec(config.compose())
    actuator, noise = ActuatorParameters(**spec["actuator"]), SensorNoise(**spec["sensors"])
    case = draw_case(rung, seed)
    write_bench(case, folder / case.name, actuator, noise, step, sampled)
    key = folder / f"{case.name}.json"
    write_key(case, key, actuator, noise, simulate_truth(case, actuator))
    verdict = diagnose_bench(folder / case.name, actuator, noise, case.left_out)
    return judge(json.loads(key.read_text()), verdict)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--step", type=float, default=1e-6, help="s")
    parser.add_argument("--sampled", action="store_true")
    parser.add_argument("--rung", default="T1", choices=("T0", "T1"))
    parser.add_argument("--first", type=int, default=1_060_000)
    parser.add_argument("--cases", type=int, default=31)
    options = parser.parse_args()
    given = options.step, options.sampled
    seeds = range(options.first, options.first + options.cases)
    with tempfile.TemporaryDirectory() as scratch, ProcessPoolExecutor(2) as pool:
        every = [pool.submit(run, options.rung, seed, *given, Path(scratch)) for seed in seeds]
        rows = [r for r in (e.result() for e in every) if r["detectable"] or not r["truth"]]
    for row in rows:
        if not row["right"]:
            print(row["name"], "+".join(row["truth"]), "was called", "+".join(row["named"]) or row["answer"])
    events = ", events at the steps only" if options.sampled else ""
    right = sum(r["right"] for r in rows)
    print(f"{right} of {len(rows)} right on {options.rung} at {options.step:g} s{events}")


if __name__ == "__main__":
    main()

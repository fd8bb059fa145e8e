"""Diagnoses of benches whose machine does something that neither the catalogue nor any form describes as it is.

    python benchmarks/machines.py [--only "eddy-current brake" ...] [--cases T0:7 T1:11]

The physics of a copy of the fixed-step simulator is changed for each; cases are those of the blind ladder, by rung and
seed. Printed for each is what was named, what was told beside it and where something is left, how much of the gap is
closed on the recordings that took no part, and what of the former is wrong. No gap is wrong too, and one that is
explained by none of the listed effects that the machine is much like.
"""

import argparse
import tempfile
import time
from pathlib import Path

import patched
from emafault import config
from emafault.actuator.grammar import MACHINE
from emafault.actuator.parameters import ActuatorParameters
from emafault.diagnosis.naming import NAMED
from emafault.equations.run import diagnose_bench
from emafault.io.bench import read_bench
from emafault.withheld.cases import draw_case

STEPPED = "src/emafault/actuator/fixed_step.py"
SPEC = config.diagnosis_spec(config.compose())
SIMULATE = """
import sys
from pathlib import Path
from emafault import config
from emafault.actuator.parameters import ActuatorParameters
from emafault.actuator.sensors import SensorNoise
from emafault.withheld.benches import STEP, write_bench
from emafault.withheld.cases import draw_case
spec = config.diagnosis_spec(config.compose())
for case in sys.argv[2:]:
    rung, seed = case.split(":")
    actuator, noise = ActuatorParameters(**spec["actuator"]), SensorNoise(**spec["sensors"])
    write_bench(draw_case(rung, int(seed)), Path(sys.argv[1]) / case, actuator, noise, STEP)
"""
STATE = "    memory, added = np.zeros(len(terms)), np.zeros(len(PLACES))\n"
COEFFICIENTS = "            set_coefficients(record, forms, k0, R20, Rx, k, e, R, table, theta, middle_angle, w_mid"
#: by machine, lines that set what is added at places of the grammar, and the listed effects that it is much like;
#: ``now``, ``middle_angle``, ``w_mid``, currents ``i``, output ``motion.theta_u``, numbers of ``memory`` are at hand
MACHINES = {
    "eddy-current brake": (
        "torque -= 0.04 * (w_mid / 60.0) / (1.0 + (w_mid / 60.0) ** 2)", "viscous_friction",
    ),
    "pendulum at the output": ("torque -= 0.03 * np.sin(6.0 * motion.theta_u)", "load_spring"),
    "tooth that is worn at the output": (
        "torque -= 0.03 * np.exp(-0.5 * ((motion.theta_u - 0.02) / 0.004) ** 2)",
    ),
    "unbalance that grows with the speed": ("torque += 0.01 * (w_mid / 100.0) ** 2 * np.cos(middle_angle)",),
    "drag that grows with the current": ("torque -= np.sign(w_mid) * 0.004 * np.abs(i).sum()",),
    "gust at random": ("""
if now >= memory[1]:
    memory[0] = 0.02 - memory[0]
    u = np.sin(12.9898 * (memory[2] + record.theta_0) + record.dT) * 43758.5453
    memory[1] += 0.01 + 0.04 * (u - np.floor(u))
    memory[2] += 1.0
torque -= memory[0]""",),
    "vibration that glides": ("torque += 0.01 * np.sin(2.0 * np.pi * now * (40.0 + 100.0 * now))",),
    "inertia that glides": ("inertia += 0.1 * np.sin(2.0 * np.pi * now * (10.0 + 20.0 * now))",),
    "absorber at the shaft": ("""
pull = (2.0 * np.pi * 60.0) ** 2 * (middle_angle - record.theta_0 - memory[0]) + 20.0 * (w_mid - memory[1])
memory[1] += dt * pull
memory[0] += dt * memory[1]
torque -= 0.2 * record.inertia * pull""",),
    "magnets that weaken with the current": ("""
emf_a -= 0.002 * np.abs(i).sum()
emf_b -= 0.002 * np.abs(i).sum()
emf_c -= 0.002 * np.abs(i).sum()""",),
    "contact that lifts at a place of the turn": ("resistance_a += 0.05 * (np.cos(middle_angle) > 0.7)",),
    "contact that is worse at small currents": ("resistance_b += 0.2 / (1.0 + abs(i[1]))", "contact_resistance"),
}  # fmt: skip


def lines_of(text: str) -> str:
    """Lines of the simulator's that do what a machine does, where ``added`` is filled."""
    for place in sorted(MACHINE, key=len, reverse=True):
        for sign in ("+=", "-="):
            text = text.replace(f"{place} {sign}", f"added[{list(MACHINE).index(place)}] {sign}")
    return "".join(f"            {line}\n" for line in ["added[:] = 0.0", *text.strip().split("\n")])


def told(verdict: dict) -> str:
    """What a verdict tells beside its names."""
    found = [f"{d['form']} in {d['equation']}" for d in verdict["discovered"]]
    return ", ".join(found) or "nothing"


def main() -> None:
    """Simulate, diagnose, print a line a bench and how many are right."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=MACHINES, default=list(MACHINES), metavar="MACHINE")
    parser.add_argument("--cases", nargs="+", default=["T0:7", "T1:11"], help="rung and seed of the blind ladder")
    parser.add_argument("--keep", help="folder where the benches are kept")
    args = parser.parse_args()
    right = count = 0
    for name in args.only:
        with tempfile.TemporaryDirectory() as benches:
            into = (Path(args.keep) / name.replace(" ", "_") if args.keep else Path(benches)).resolve()
            lines, *like = MACHINES[name]
            changes = (STATE, STATE.replace("len(terms)", "4")), (COEFFICIENTS, lines_of(lines) + COEFFICIENTS)
            patched.run(SIMULATE, STEPPED, changes, into, *args.cases)
            for case in args.cases:
                rung, seed = case.split(":")
                begun = time.perf_counter()
                bench = read_bench(into / case, ActuatorParameters(**SPEC["actuator"]))
                verdict = diagnose_bench(bench, SPEC).verdict
                took = time.perf_counter() - begun
                named = {e for e, p in verdict["inclusion"].items() if p >= NAMED}
                truth = set(draw_case(rung, int(seed)).effects)
                unseen = verdict["verdict"] == "no_gap" or (verdict["verdict"] == "explained" and not named & {*like})
                fine = named <= {*truth, *like} and not unseen
                count, right = count + 1, right + fine
                closed = (verdict["shrinks"]["signal"] or {}).get("closed")
                share = "" if closed is None else f", {100.0 * closed:.0f} % closed"
                print(
                    f"{name}, {case} ({' + '.join(sorted(truth)) or 'none'}): {verdict['verdict']}: "
                    f"{' + '.join(sorted(named)) or 'none'}; beside it {told(verdict)}{share}, {took:.0f} s"
                    f"{'' if fine else ': not right'}",
                    flush=True,
                )
    print(f"{right} of {count} right")


if __name__ == "__main__":
    main()

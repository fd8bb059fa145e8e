"""Diagnoses of benches whose controller is built otherwise than any that the diagnosis knows.

    python benchmarks/controllers.py [--only "dead band" ...]

The control law of a copy of the simulator is changed for each; six recordings of 0.6 s of one unit a bench, once
without effect, once with a contact resistance in phase a, once with Stribeck friction. What a controller does is no gap
of the machine: printed for each is what was named, what was told beside it, and what of the former is wrong.
"""

import argparse
import tempfile
from dataclasses import dataclass
from pathlib import Path

import patched
from channels import EFFECTS, SPEC
from emafault.actuator.parameters import ActuatorParameters
from emafault.diagnosis.naming import NAMED
from emafault.equations.run import diagnose_bench
from emafault.io.bench import read_bench

LAW = "src/emafault/actuator/instants.py"
SIMULATE = """
import sys
from pathlib import Path
sys.path.insert(0, "benchmarks")
from channels import EFFECTS
from diagnosis import Case, simulate_bench
for effect, overrides in EFFECTS.items():
    folder = Path(sys.argv[1]) / effect
    folder.mkdir()
    simulate_bench(folder, Case(6, 0.6, overrides))
"""
ERROR = "    error = w_ref - measured\n"
DEMAND = "    demand = p.speed_gain * error + p.speed_integral_gain * advanced\n"
LIMITED = "        demand = p.speed_gain * error + p.speed_integral_gain * s.integral\n"
WANTED = "    w_ref = p.gear_ratio * p.position_gain * (commanded - s.shaft)\n"
ADVANCED = "    advanced = s.integral + error * p.control_period\n"
ASKED = "        s.I_ref = demand\n"
DELAYED = "    if p.control_delay_delay > 0.0:\n        slot"
KEPT = "    kept = s.pending_value\n"  # of demands that are delayed, which none is here


@dataclass(frozen=True)
class Law:
    """A control law: lines of the simulator's and what takes their place; ``listed``: what it is of the catalogue."""

    changes: tuple[tuple[str, str], ...]
    listed: tuple[str, ...] = ()


LAWS = {
    "dead band of the position": Law((
        (WANTED, "    away = commanded - s.shaft\n    away = 0.0 if abs(away) < 2e-4 else away\n"
                 "    w_ref = p.gear_ratio * p.position_gain * away\n"),
    )),
    "integral of the position": Law((
        (WANTED, f"{KEPT}    kept[0] += (commanded - s.shaft) * p.control_period\n"
                 "    w_ref = p.gear_ratio * (p.position_gain * (commanded - s.shaft) + 300.0 * kept[0])\n"),
    )),
    "demanded speed that changes by 4000 rad/s2 at most": Law((
        (ERROR, f"{KEPT}    most = 4000.0 * p.control_period\n"
                f"    w_ref = min(max(w_ref, kept[0] - most), kept[0] + most)\n    kept[0] = w_ref\n{ERROR}"),
    )),
    "integral that fades over 50 ms": Law((
        (ADVANCED, "    advanced = s.integral * (1.0 - p.control_period / 0.05) + error * p.control_period\n"),
    )),
    "no stop of the integral": Law(((LIMITED, "        s.integral = advanced\n"),)),
    "speed gain that doubles up to 200 rad/s": Law((
        (DEMAND, "    gain = p.speed_gain * (1.0 + min(abs(measured) / 200.0, 1.0))\n"
                 "    demand = gain * error + p.speed_integral_gain * advanced\n"),
        (LIMITED, "        demand = gain * error + p.speed_integral_gain * s.integral\n"),
    )),
    "derivative of the speed": Law((
        (DEMAND, f"{KEPT}    kept[1] += 0.05 * ((measured - kept[0]) / p.control_period - kept[1])\n"
                 f"    kept[0] = measured\n    error -= 1e-3 * kept[1]\n{DEMAND}"),
    )),
    "demand in steps of 0.2 A": Law(((ASKED, "        s.I_ref = 0.2 * np.round(demand / 0.2)\n"),)),
    "demand that changes by 300 A/s at most": Law((
        (ASKED, "        most = 300.0 * p.control_period\n"
                "        s.I_ref = min(max(demand, s.I_ref - most), s.I_ref + most)\n"),
    )),
    "0.5 A in the direction of the motion": Law((
        (ASKED, "        s.I_ref = demand + 0.5 * min(max(w_ref / 5.0, -1.0), 1.0)\n"),
    )),
    "0.2 A in one direction": Law(((ASKED, "        s.I_ref = demand + 0.2\n"),)),
    "0.15 A at 180 Hz": Law(((ASKED, "        s.I_ref = demand + 0.15 * np.sin(2.0 * np.pi * 180.0 * s.t)\n"),)),
    "loop of 1 kHz": Law(((DELAYED, f"    if s.tick % 10 != 0:\n        s.tick += 1\n        return\n{DELAYED}"),),
                         ("control_delay",)),
}  # fmt: skip


def main() -> None:
    """Simulate, diagnose, print a line a bench and how many are right."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=LAWS, default=list(LAWS), metavar="LAW")
    args = parser.parse_args()
    right = wrong = count = 0
    for name in args.only:
        with tempfile.TemporaryDirectory() as benches:
            patched.run(SIMULATE, LAW, LAWS[name].changes, benches)
            for effect in EFFECTS:
                bench = read_bench(Path(benches) / effect, ActuatorParameters(**SPEC["actuator"]))
                verdict = diagnose_bench(bench, SPEC).verdict
                named = {e for e, p in verdict["inclusion"].items() if p >= NAMED}
                wanted = {*([] if effect == "none" else [effect]), *LAWS[name].listed}
                told = [f"{d['form']} in {d['equation']}" for d in verdict["discovered"]]
                count, right, wrong = count + 1, right + (named == wanted), wrong + bool(named - wanted)
                beside = f"; beside it {', '.join(told)}" if told else ""
                beside += f"; wrong: {', '.join(sorted(named - wanted))}" if named - wanted else ""
                print(f"{name}, {effect}: {' + '.join(sorted(named)) or 'none'}{beside}", flush=True)
    print(f"{right} of {count} right, a wrong name in {wrong}")


if __name__ == "__main__":
    main()

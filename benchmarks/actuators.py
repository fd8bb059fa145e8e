"""From datasheet to diagnosis on three actuators, of 28, 48 and 270 V.

    python benchmarks/actuators.py [FILE ...] [--effects EFFECT ...] [--seed 0]

For each file of an actuator a unit within its tolerances is drawn and recorded healthy, the file is identified in these
recordings, and benches of the unit are diagnosed with the identified file: one without an effect, and one with each
effect of the catalogue. Printed: how far identified numbers are off beside their 90 % intervals, and what each verdict
names.
"""

import argparse
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from emafault import config
from emafault.actuator.commands import command_positions
from emafault.actuator.parameters import ActuatorParameters, make_runs
from emafault.actuator.sensors import SensorNoise, measure
from emafault.actuator.simulate import simulate, time_axis
from emafault.datasheet.compose import TOLERANCE, Machine, of_file
from emafault.datasheet.identify import identify_actuator
from emafault.effects import Effect
from emafault.effects.scaling import scaled
from emafault.equations.diagnose import diagnose
from emafault.errors import InputError
from emafault.io.recording import Recording, write_recording
from emafault.io.split import split_bench

FILES = sorted((Path(__file__).parents[1] / "examples" / "actuators").glob("*.yaml"))
DURATION, INTERVAL = 0.8, 2e-4  # s
#: command, its settings for a shaft that turns at 1 rad/s at most, degC, rotor angle at the start (rad)
PLANS = (
    ("parabolic", {"acceleration": 0.3}, 50.0, 0.3),
    ("parabolic", {"acceleration": -0.3}, 0.0, 4.0),
    ("reversal", {"amplitude": 0.04, "speed": 0.25}, 50.0, 1.1),
    ("reversal", {"amplitude": 0.03, "speed": 0.2}, 20.0, 5.1),
    ("sine", {"amplitude": 0.02, "frequency": 2.0}, 0.0, 2.0),
    ("sine", {"amplitude": 0.04, "frequency": 1.0}, 20.0, 3.0),
)
LENGTHS = ("acceleration", "amplitude", "speed")
SHARE = (0.6, 1.0)  # of an effect's range that is drawn
PHASES, LESS = ("_a", "_b", "_c"), 0.3

Effects = Mapping[str, Mapping[str, float]]


def recorded(actuator: ActuatorParameters, effects: Effects, noise: SensorNoise, seed: int) -> dict[str, Recording]:
    """A healthy bench of a unit."""
    reach = actuator.speed_limit / actuator.gear_ratio
    out = {}
    for n, (command, settings, ambient, theta_0) in enumerate(PLANS):
        fault = np.array([[0.0] * 5 + [ambient - actuator.reference_temperature]])
        runs = make_runs(actuator, fault, effects=effects, theta_0=theta_0)
        motion = {k: v * reach if k in LENGTHS else v for k, v in settings.items()}
        position = command_positions(command, motion, DURATION, actuator.control_period)
        signals = measure(simulate(runs, position, DURATION, INTERVAL), runs, noise, seed, n)
        measured = float(signals.pop("ambient_temperature")[0])
        out[f"r{n}.nc"] = Recording(
            time=time_axis(DURATION, INTERVAL), ambient_temperature=measured, name=f"r{n}.nc",
            attributes={"health": "healthy", "command": command}, **{k: v[0] for k, v in signals.items()},
        )  # fmt: skip
    return out


def unit_of(machine: Machine, rng: np.random.Generator) -> dict[str, dict[str, float]]:
    """A unit within the file's tolerances, as values of the calibration effects."""
    out: dict[str, dict[str, float]] = {}
    for effect, own in machine.tolerances().items():
        for name, tolerance in own.items():
            parameter = scaled(machine.actuator)[effect].parameters[name]
            factor = float(np.exp(np.clip(tolerance, 0.0, 0.3) * np.clip(rng.standard_normal(), -2.0, 2.0)))
            out.setdefault(effect, {})[name] = parameter.nominal * factor
    return out


def drawn(effect: Effect, rng: np.random.Generator) -> dict[str, float]:
    """An effect at the upper end of its range; of phases one, and another less."""
    out = {}
    more = int(rng.integers(3))
    for name, p in effect.parameters.items():
        low, high = (p.low, p.high) if p.low > p.nominal or p.high == p.nominal else (p.nominal, p.high)
        start = p.nominal if p.low <= p.nominal <= p.high else low
        end = high if high != p.nominal else p.low
        share = float(rng.uniform(*SHARE))
        if name[-2:] in PHASES:
            share *= (1.0, LESS, 0.0)[(PHASES.index(name[-2:]) + more) % 3]
        out[name] = start + share * (end - start)
    return out


def together(unit: Effects, effect: str, values: Mapping[str, float], catalogue: Mapping[str, Effect]) -> Effects:
    """A unit with an effect: a calibration multiplies what the unit has."""
    own = dict(unit.get(effect, {}))
    for name, value in values.items():
        nominal = catalogue[effect].parameters[name].nominal
        own[name] = own[name] * value / nominal if name in own else value
    return {**unit, effect: own}


def identified(machine: Machine, unit: Effects, noise: SensorNoise) -> Machine:
    """The file identified in healthy recordings; prints what it is off by."""
    with tempfile.TemporaryDirectory() as folder:
        for name, recording in recorded(machine.actuator, unit, noise, 1).items():
            write_recording(Path(folder) / name, recording)
        begun = time.perf_counter()
        found = identify_actuator(machine, [folder], noise)
    print(f"{machine.name}: identified in {time.perf_counter() - begun:.1f} s")
    for name, (effect, parameter) in TOLERANCE.items():
        catalogue = scaled(machine.actuator)[effect].parameters[parameter]
        truth = getattr(machine.actuator, name) * unit[effect][parameter] / catalogue.nominal
        now = found.machine.parameters[name]
        before = machine.parameters[name].value
        off, was = (100.0 * (x / truth - 1.0) for x in (now.value, before))
        print(f"  {name:18} datasheet {was:+7.2f} %, identified {off:+7.3f} % +- {100 * now.tolerance:.3f} %")
    for note in found.notes:
        print(f"  note: {note}")
    return found.machine


def judged(machine: Machine, recordings: Mapping[str, Recording], noise: SensorNoise) -> tuple[str, list[str]]:
    """The verdict in a word, and what it names."""
    verdict = diagnose(
        "bench", recordings, split_bench(recordings), machine.actuator, noise, processes=1,
        tolerances=machine.tolerances(),
    ).verdict  # fmt: skip
    named = list(verdict["which"][0]["effects"]) if verdict["verdict"] == "explained" else []
    grouped = ["/".join(group) for group in verdict["groups"]]
    return verdict["verdict"], [*named, *grouped, *(d["unit"] for d in verdict["discovered"])]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", nargs="*", default=FILES, metavar="FILE")
    parser.add_argument("--effects", nargs="*", metavar="EFFECT", help="effects to try (all)")
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    noise = SensorNoise(**config.compose()["sensors"])
    for path in args.files:
        rng = np.random.default_rng(args.seed)
        machine = of_file(path)
        catalogue = scaled(machine.actuator)
        unit = unit_of(machine, rng)
        own = identified(machine, unit, noise)
        right: list[bool] = []
        for effect in [None, *(args.effects if args.effects is not None else catalogue)]:
            values = drawn(catalogue[effect], rng) if effect else {}
            effects = together(unit, effect, values, catalogue) if effect else unit
            try:
                said, names = judged(own, recorded(machine.actuator, effects, noise, 100 + len(right)), noise)
            except InputError as error:
                said, names = f"refused: {error}", []
            ok = said == "no_gap" if effect is None else any(effect in n.split("/") for n in names)
            right.append(ok)
            truth = ", ".join(f"{k} {v:.3g}" for k, v in values.items())
            print(
                f"  {'right' if ok else 'WRONG'} {effect or 'none':22} {truth:44} {said}: {', '.join(names)}",
                flush=True,
            )
        print(f"{machine.name}: {sum(right)} of {len(right)} verdicts right")


if __name__ == "__main__":
    main()

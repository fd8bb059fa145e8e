"""Diagnoses of benches whose channels come in coarse steps, are noisier than the reference's, filtered or computed of
duty cycles, or whose controller does more with its command.

    python benchmarks/channels.py [--only "encoder of 4096 counts" ...]

Six recordings of 0.6 s of one unit a bench, once without effect, once with a contact resistance in phase a, once with
Stribeck friction. Printed for each: what was named, and what was told beside it and the steps or filters themselves.
All noise is that of voltages, currents, speed and positions; the sensors' filter that of voltages, currents and speed.
"""

import argparse
import tempfile
from pathlib import Path

from diagnosis import Case, simulate_bench
from emafault import config
from emafault.actuator.parameters import ActuatorParameters
from emafault.equations.run import diagnose_bench
from emafault.io.bench import read_bench

EFFECTS = {
    "none": (), "contact_resistance": ("effects.contact_resistance.R_x_a=0.04",),
    "stribeck": ("effects.stribeck.a=0.02",),
}  # fmt: skip
SPEC = config.diagnosis_spec(config.compose())
THEMSELVES = ("adc_step", "lag", "sensor_curve", "controller")
TRUE = {"sensors' filter of 5 kHz": ("speed_latency",)}  # what a channel is, of the listed effects
NOISY = ("voltage", "current", "current_end", "speed", "angle", "position")


def in_steps(place: str, step: float) -> tuple[str, ...]:
    """Overrides by which a channel comes in steps."""
    return (f"unlisted=[{{place: {place}, form: adc_step, step: {step}}}]",)


def noisier(factor: float, *channels: str) -> tuple[str, ...]:
    """Overrides by which channels, or all, have so many times their noise."""
    return tuple(f"sensors.{n}={factor * SPEC['sensors'][n]:g}" for n in channels or NOISY)


def entry(place: str, form: str, **numbers: float) -> tuple[str, ...]:
    """Overrides by which a form acts at a place."""
    return (f"unlisted=[{{place: {place}, form: {form}, {', '.join(f'{n}: {x:g}' for n, x in numbers.items())}}}]",)


CHANNELS = {
    "currents in steps of 20 mA": in_steps("current", 0.02),
    "currents in steps of 50 mA": in_steps("current", 0.05),
    "voltages in steps of 0.1 V": in_steps("voltage", 0.1),
    "bus voltage in steps of 0.1 V": in_steps("bus_voltage", 0.1),
    "encoder of 4096 counts": in_steps("angle", 1.534e-3),
    "output in counts of 0.1 mrad": in_steps("output", 1e-4),
    "all noise a tenth": noisier(0.1),
    "all noise five times": noisier(5.0),
    "all noise ten times": noisier(10.0),
    "voltages' noise ten times": noisier(10.0, "voltage"),
    "speed's noise ten times": noisier(10.0, "speed"),
    "angle's noise ten times": noisier(10.0, "angle"),
    "currents late by half an interval": entry("current", "lag", lag=0.5),
    "angle late by half an interval": entry("angle", "lag", lag=0.5),
    "currents smoothed": entry("current", "smoothing", delay=0.4),
    "voltages smoothed": entry("voltage", "smoothing", delay=0.4),
    "voltages of duty cycles": entry("voltage", "drop", drop=0.7, turn=0.1),
    "sensors' filter of 5 kHz": ("recording.filter={kind: first_order, cutoff: 5000, before_noise: true}",),
    "filter of the command": entry("command", "command_filter", time_constant=0.005),
    "feed-forward": entry("command", "feedforward", gain=0.5),
}


def main() -> None:
    """Simulate, diagnose, print a line a bench and how many are right."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=CHANNELS, default=list(CHANNELS), metavar="CHANNEL")
    args = parser.parse_args()
    right = clean = count = 0
    with tempfile.TemporaryDirectory() as scratch:
        for channel in args.only:
            for effect, overrides in EFFECTS.items():
                folder = Path(scratch) / f"{channel} {effect}"
                folder.mkdir()
                simulate_bench(folder, Case(6, 0.6, (*overrides, *CHANNELS[channel])))
                verdict = diagnose_bench(read_bench(folder, ActuatorParameters(**SPEC["actuator"])), SPEC).verdict
                named = verdict["which"][0]["effects"]
                told = [f"{d['form']} in {d['equation']}" for d in verdict["discovered"] if d["form"] not in THEMSELVES]
                wanted = {*([] if effect == "none" else [effect]), *TRUE.get(channel, ())}
                count, right = count + 1, right + (set(named) == wanted)
                clean += not told
                beside = f"; beside it {', '.join(told)}" if told else ""
                p = verdict["which"][0]["probability"]
                print(f"{channel}, {effect}: {' + '.join(named) or 'none'} ({p:.2f}){beside}", flush=True)
    print(f"{right} of {count} right, nothing else told in {clean}")


if __name__ == "__main__":
    main()

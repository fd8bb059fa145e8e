"""Diagnoses of benches on which several things are wrong at once: controller, measuring chain, something that turns or
pulls, and a listed effect.

    python benchmarks/mixed.py [--only "drift, late speed, wave" ...] [--seed 0]

Six recordings of 1 s of the nominal unit a bench, fast ones among them. Prints what the bench has and what
``emafault diagnose`` says of it.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from channels import entries
from emafault import config
from emafault.dataset import simulate_recording
from emafault.io.recording import write_recording

COMMANDS = (
    ("command=step", "command.amplitude=0.1"),
    ("command=sine", "command.amplitude=0.2", "command.frequency=2"),
    ("command=parabolic",),
    ("command=reversal", "command.amplitude=0.2", "command.speed=0.7"),
    ("command=sine", "command.amplitude=0.1", "command.frequency=4"),
    ("command=step", "command.amplitude=-0.2"),
)
WAVE = ("torque", "order", {"amplitude": 0.008, "order": 1, "phase": 0.4})
#: what a bench has, as overrides of a simulation
CASES = {
    "nothing": (),
    "wave": entries(WAVE),
    "drift, late speed, wave": (
        "actuator.position_gain=82", "effects.cogging.a=0.004",
        *entries(("current_b", "drift", {"at_end": 0.05}), ("speed", "lag", {"lag": 0.6}), WAVE),
    ),
    "coarse voltages, late angle": (
        "actuator.speed_gain=0.4", "effects.contact_resistance.R_x_b=0.02",
        *entries(("voltage", "adc_step", {"step": 0.1}), ("angle", "lag", {"lag": 0.3})),
    ),
    "spikes, a gain, hum of the torque": (
        "actuator.position_gain=130", "effects.stribeck.a=0.03",
        *entries(
            ("speed", "spikes", {"share": 0.01, "level": 20}), ("voltage_a", "gain", {"gain": 0.01}),
            ("torque", "frequency", {"amplitude": 0.01, "frequency": 33}),
        ),
    ),
    "coarse output, held currents, filtered command": (
        "actuator.speed_integral_gain=14", "effects.friction_asymmetry.a=0.08",
        *entries(
            ("output", "adc_step", {"step": 2e-5}), ("current_a", "held", {"share": 0.03}),
            ("command", "command_filter", {"time_constant": 0.002}),
        ),
    ),
    "weak magnet, drifting voltage": (
        "actuator.position_gain=60", "effects.angle_offset.offset=0.6",
        *entries(
            ("emf_b", "bump", {"depth": -0.03, "centre": 2.0, "width": 0.3}), ("voltage_c", "drift", {"at_end": 0.4})
        ),
    ),
    "fan, filtered speed": (
        "actuator.current_limit=15", "effects.cogging.a=0.006", "effects.current_gain.g_b=1.01",
        *entries(("drag", "power", {"at_100_rad_s": 0.01, "exponent": 2}), ("speed", "low_pass", {"delay": 0.8})),
    ),
}  # fmt: skip


def simulate(folder: Path, overrides: tuple[str, ...], seed: int) -> None:
    """Write the recordings of a bench; ``seed`` : of the first one's noise."""
    for n, command in enumerate(COMMANDS):
        start = f"recording.theta_0={{low: {n}, high: {n}}}"
        composed = config.compose("paper", [*command, "recording.duration=1.0", start, *overrides])
        spec = config.dataset_spec(composed, "fresh") | {"seed": seed + n}
        write_recording(folder / f"recording_{n}.nc", simulate_recording(spec, np.zeros(6)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="+", choices=CASES, default=list(CASES))
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    for name in args.only:
        print(f"{name}: {'; '.join(CASES[name]) or '-'}", flush=True)
        with tempfile.TemporaryDirectory() as scratch:
            bench = Path(scratch) / "bench"
            bench.mkdir()
            simulate(bench, CASES[name], args.seed)
            command = [sys.executable, "-m", "emafault", "diagnose", str(bench), "--out", f"{scratch}/found"]
            said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        print("".join(f"    {line}\n" for line in said.splitlines()[:-1]), flush=True)


if __name__ == "__main__":
    main()

"""Time of each reconstruction method and its error beside the Cramer-Rao bound, on simulated runs with faults.

    python benchmarks/reconstruction.py [--runs N]

Prints a table in Markdown. Features are turned into faults by the closed form, with no network between, so that
the error is the reconstruction's own; of nine features, with R0, k0 and L0 known. The bound is that of the row's
samples: the plateaus', or the floating phase's too; of nine features that of all intervals. The ratio is the time over
that of the first weighted row, both in one run; each is the shortest of three.
"""

import argparse
import time

import numpy as np

from emafault.actuator.commands import command_positions
from emafault.actuator.parameters import ActuatorParameters, make_runs
from emafault.actuator.sensors import SensorNoise, measure
from emafault.actuator.simulate import simulate
from emafault.closed_form import inverse
from emafault.config import reference_actuator
from emafault.faults import sample_faults
from emafault.identification.posterior import Knowledge, posterior
from emafault.reconstruction import Features, reconstruct
from emafault.reconstruction.bounds import cramer_rao_bound
from emafault.study.calibrated_bound import coefficient_bound, least_of

NOISE = {"voltage": 0.05, "current": 0.005, "current_end": 0.02, "speed": 0.3}
METHODS = {
    "paper": ("paper", {}, {"floating": False}),
    "weighted, plateau": ("weighted", {"floating": False}, {"floating": False}),
    "weighted, plateau and floating": ("weighted", {"floating": True}, {"floating": True}),
    "nine features": ("nine", {}, {}),
    "angle-resolved": ("angle_resolved", {}, {"floating": True}),
}


REPEATS = 3
BESIDE = "weighted, plateau"  # whose time is one in the ratio


def identified(features: Features, actuator: ActuatorParameters) -> np.ndarray:
    """(run, 6) faults by the closed form."""
    if "nine_covariance" in features.extras:
        return posterior(features.nine, features.inputs_covariance, actuator, 0.0, Knowledge()).faults
    got = inverse(features.R, features.k, actuator)
    if "xi" in features.extras:
        got[:, 3:5] = features.extras["xi"]
    return got


def least_error(
    method: str, clean: dict, interval: float, actuator: ActuatorParameters, samples: dict, faults: np.ndarray
) -> np.ndarray:
    """(6,) mean absolute error at the bound."""
    if method != "nine":
        return cramer_rao_bound(clean, interval, actuator, NOISE, samples).mean_absolute_error.mean(0)
    covariance = coefficient_bound("recording", clean, interval, actuator, NOISE, 0.0)
    least = least_of(covariance, np.zeros((9, 9)), faults, actuator, 0.0, Knowledge(), faults[:, 5])
    return np.sqrt(2.0 / np.pi) * least.mean(0)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=100)
    count = parser.parse_args().runs
    actuator, interval = reference_actuator(), 2e-4
    command = command_positions("parabolic", {"acceleration": 0.3}, 1.0, actuator.control_period)
    noise = SensorNoise(**NOISE, angle=1e-4, position=1e-5, bus_voltage=0.05, ambient=0.5)
    xi = "\N{GREEK SMALL LETTER XI}"
    print(f"| method | eccentricity | ms a run | ratio | error of N (%) | of {xi} | of dT (K) | bounds |")
    print("|---|---|---|---|---|---|---|---|")
    beside = np.nan
    faults = sample_faults(count, shorted_turns=(0, 0.1), eccentricity=(0, 0.2), temperature=(-50, 70), seed=11)
    for law in ("stator_fixed", "rotor_angle"):
        runs = make_runs(actuator, faults, eccentricity_law=law)
        clean = simulate(runs, command, 1.0, interval)
        noisy = measure(clean, runs, noise, 12)
        for name, (method, settings, samples) in METHODS.items():
            if (law == "rotor_angle") != (method == "angle_resolved"):
                continue
            reconstruct(method, {k: v[:1] for k, v in noisy.items()}, interval, actuator, settings)
            spent = np.inf
            for _ in range(REPEATS):
                start = time.process_time()
                features = reconstruct(method, noisy, interval, actuator, settings)
                spent = min(spent, (time.process_time() - start) / count)
            beside = spent if name == BESIDE else beside
            ratio = f"{spent / beside:.2f}" if beside == beside else ""
            error = np.abs(identified(features, actuator) - faults)
            shown = [100.0 * error[:, :3].mean(), error[:, 3:5].mean(), error[:, 5].mean()]
            limit = "none of its own"
            if law == "stator_fixed":
                bound = least_error(method, clean, interval, actuator, samples, faults)
                limit = f"{100.0 * bound[:3].mean():.3f}, {bound[3:5].mean():.5f}, {bound[5]:.3f}"
            errors = f"{shown[0]:.3f} | {shown[1]:.5f} | {shown[2]:.3f}"
            print(f"| {name} | {law} | {1e3 * spent:.1f} | {ratio} | {errors} | {limit} |", flush=True)


if __name__ == "__main__":
    main()

"""Simulates, measures and writes blind cases: a folder of recordings each, and a key elsewhere.

``FOLDER/benches/NAME/recording_N.nc`` is what a diagnosis may see, ``FOLDER/keys/NAME.json`` what the scoring reads.
"""

import json
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path

import numpy as np

from ..actuator.fixed_step import quantise_by_truncation, simulate_fixed_step
from ..actuator.parameters import ActuatorParameters
from ..actuator.sensors import SensorNoise, measure
from ..actuator.simulate import time_axis
from ..effects import EFFECTS
from ..recording import Recording, replace_atomically, write_recording
from .cases import Case, case_from_dict, draw_case, without_effect
from .detectability import Detector
from .statistics import runs_of, simulate_plans

STEP = 2e-6  # s, of the other integrator


def make_cases(
    rung: str,
    seeds: Iterable[int],
    folder: str | Path,
    actuator: ActuatorParameters,
    noise: SensorNoise,
    rivals: bool = False,
) -> list[str]:
    """Make the benches and keys of a rung's seeds; what is there already is left alone.

    ``rivals`` adds the distance to the nearest effect of the same equations to each key, at twice the cost.

    Returns
    -------
    names of the cases

    Raises
    ------
    InputError : an unknown rung, or a folder that cannot be written
    """
    folder = Path(folder)
    names = []
    for seed in seeds:
        case = draw_case(rung, int(seed))
        names.append(case.name)
        key = folder / "keys" / f"{case.name}.json"
        if key.exists():
            continue
        signals = write_bench(case, folder / "benches" / case.name, actuator, noise)
        write_key(case, key, actuator, noise, signals, rivals)
    return names


def simulate_truth(
    case: Case, actuator: ActuatorParameters, step: float | None = None, sampled: bool = False
) -> list[dict[str, np.ndarray]]:
    """Noise-free signals of each recording; a case with other forms runs on the other integrator.

    ``step`` (s) lets every case run on it, ``sampled`` with events at the steps only (see ``simulate_fixed_step``).
    """
    if not case.forms and step is None:
        states = [(case.unit(), np.array(plan.fault)) for plan in case.recordings]
        return simulate_plans(actuator, case.recordings, states)
    out = []
    for plan in case.recordings:
        runs, command = runs_of(actuator, plan, [case.unit()], np.array([plan.fault]))
        timing = plan.duration, plan.interval, step or STEP
        out.append(simulate_fixed_step(runs, command, *timing, case.forms, sampled))
    return out


def write_bench(
    case: Case,
    folder: Path,
    actuator: ActuatorParameters,
    noise: SensorNoise,
    step: float | None = None,
    sampled: bool = False,
) -> list[dict[str, np.ndarray]]:
    """Write a case's recordings and return their noise-free signals; the last two as in ``simulate_truth``."""
    truth = simulate_truth(case, actuator, step, sampled)
    scaled = SensorNoise(**{k: v * case.noise_scale.get(k, 1.0) for k, v in asdict(noise).items()})
    for n, (plan, signals) in enumerate(zip(case.recordings, truth)):
        runs, _ = runs_of(actuator, plan, [case.unit()], np.array([plan.fault]))
        truncate = "speed_quantisation" in case.forms
        step = float(runs["speed_quantisation_step"][0])
        if truncate:
            runs["speed_quantisation_step"] = 0.0
        measured = measure(signals, runs, scaled, case.noise_seed, n)
        speed = measured["rotor_speed"][0]
        recording = Recording(
            time=time_axis(plan.duration, plan.interval),
            phase_voltage=measured["phase_voltage"][0],
            phase_current=measured["phase_current"][0],
            phase_current_end=measured["phase_current_end"][0] if case.end_current else None,
            rotor_speed=quantise_by_truncation(speed, step) if truncate else speed,
            rotor_angle=measured["rotor_angle"][0],
            output_position=measured["output_position"][0],
            commanded_position=measured["commanded_position"][0],
            bus_voltage=measured["bus_voltage"][0] if case.bus_voltage else None,
            ambient_temperature=float(measured["ambient_temperature"][0]),
            attributes={"command": plan.command, "health": plan.health, "unit": case.name},
        )
        write_recording(folder / f"recording_{n}.nc", recording)
    return truth


def write_key(
    case: Case, path: Path, actuator: ActuatorParameters, noise: SensorNoise, truth, rivals: bool = False
) -> None:
    """Write the truth of a case, with its detectability where it holds an effect."""
    key: dict = {"case": case.to_dict(), "detectability": None, "fault_sd": None, "nearest_rival": None}
    key["actuator"], key["noise"] = asdict(actuator), asdict(noise)
    if case.effects:
        detector = Detector(case, actuator, noise, truth)
        found = detector.detectability()
        key["detectability"] = {"nominal": found.nominal, "members": found.members}
        key["fault_sd"] = found.fault_sd
        if rivals and len(case.effects) == 1:
            distances = {r: detector.linear_rival(r) for r in near_rivals(next(iter(case.effects)))}
            nearest = min(distances, key=lambda r: distances[r])
            key["nearest_rival"] = {"effect": nearest, "distance": distances[nearest]}
    replace_atomically(path, lambda temporary: temporary.write_text(json.dumps(key, indent=1)))


def write_key_without(key: Path, path: Path) -> None:
    """Write the key of the case of T3 on the bench of one of T1, whose key it is but for what the library lacks."""
    written = json.loads(key.read_text())
    written["case"] = without_effect(case_from_dict(written["case"])).to_dict()
    replace_atomically(path, lambda temporary: temporary.write_text(json.dumps(written, indent=1)))


def near_rivals(effect: str) -> list[str]:
    """Effects that are to be found in one of the same equations."""
    mine = set(EFFECTS[effect].equations)
    return [e for e in EFFECTS if e != effect and mine & set(EFFECTS[e].equations)]


def rival_distances(key: dict, rivals: Iterable[str]) -> dict[str, float]:
    """Squared distances from a case's truth to the nearest point of other effects, simulated from the key alone.

    Where the truth holds several effects, each of the others takes the place of one of these.
    """
    wanted = list(rivals)
    if not wanted:
        return {}
    case = case_from_dict(key["case"])
    actuator, noise = ActuatorParameters(**key["actuator"]), SensorNoise(**key["noise"])
    detector = Detector(case, actuator, noise, simulate_truth(case, actuator))
    distance = detector.distance_to if len(case.effects) == 1 else detector.distance_in_place
    return {rival: distance(rival) for rival in wanted}

"""Simulates, measures and writes blind cases: a folder of recordings each, and a key elsewhere.

``FOLDER/benches/NAME/recording_N.nc`` is what a diagnosis may see, ``FOLDER/keys/NAME.json`` what the scoring reads.
"""

import json
from collections.abc import Iterable
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from ..actuator.fixed_step import quantise_by_truncation, simulate_fixed_step
from ..actuator.parameters import ActuatorParameters
from ..actuator.sensors import SensorNoise, measure
from ..actuator.simulate import time_axis
from ..effects import EFFECTS
from ..io.atomic import write_text
from ..io.recording import Recording, write_recording
from .cases import Case, case_from_dict, draw_case, is_disturbed, plain_twin, with_twin, without_effect
from .detectability import LATTICE, Detector
from .disturbances import FILTER, Unlisted, change, in_physics, terms_of, with_controller
from .population import REFERENCE, Population, population_of
from .statistics import runs_of, simulate_plans

STEP = 2e-6  # s, of the other integrator


def make_cases(
    rung: str,
    seeds: Iterable[int],
    folder: str | Path,
    actuator: ActuatorParameters,
    noise: SensorNoise,
    rivals: bool = False,
    population: Population = REFERENCE,
) -> list[str]:
    """Make the benches and keys of a rung's seeds; what is there already is left alone.

    A case of T7 or T9 comes with its plain twin. ``rivals`` adds the distance to the
    nearest effect of the same equations to each key, at twice the cost.

    Returns
    -------
    names of the cases, each followed by that of its plain twin

    Raises
    ------
    InputError : an unknown rung, or a folder that cannot be written
    """
    names = []
    for seed in seeds:
        case = draw_case(rung, int(seed), population)
        for one in with_twin(case):
            names.append(one.name)
            key = Path(folder) / "keys" / f"{one.name}.json"
            if not key.exists():
                signals = write_bench(one, Path(folder) / "benches" / one.bench, actuator, noise)
                write_key(one, key, actuator, noise, signals, rivals, population)
    return names


def simulate_truth(
    case: Case, actuator: ActuatorParameters, step: float | None = None, sampled: bool = False
) -> list[dict[str, np.ndarray]]:
    """Noise-free signals of each recording, before a measuring chain's disturbances.

    A case with other forms, or with what only the other integrator has, runs on that one. ``step`` (s) lets every case
    run on it, ``sampled`` with events at the steps only (see ``simulate_fixed_step``).
    """
    actuator = with_controller(actuator, case.controller)
    if not (case.forms or case.fixed_step) and step is None:
        states = [(case.unit(), np.array(plan.fault)) for plan in case.recordings]
        return simulate_plans(actuator, case.recordings, states)
    out = []
    for m, plan in enumerate(case.recordings):
        runs, command = runs_of(actuator, plan, [case.unit()], np.array([plan.fault]))
        timing = plan.duration, plan.interval, step or STEP
        rows, table = terms_of(case.unlisted, m, plan.duration)
        terms = np.array(rows) if rows else None
        slow = case.controller.get(FILTER, 0.0)
        out.append(simulate_fixed_step(runs, command, *timing, case.forms, sampled, terms, table, slow))
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
        ambient = float(measured.pop("ambient_temperature")[0])
        shown = {name: values[0] for name, values in measured.items()}
        if truncate:
            shown["rotor_speed"] = quantise_by_truncation(shown["rotor_speed"], step)
        shown["time"] = time_axis(plan.duration, plan.interval)
        if not case.end_current:
            del shown["phase_current_end"]
        if not case.bus_voltage:
            del shown["bus_voltage"]
        change(case.unlisted, n, shown)
        # not even a name of the unit: whatever it were, it could tell the case
        said = {"command": plan.command, "health": plan.health, "unit": "unknown"}
        recording = Recording(**shown, ambient_temperature=ambient, attributes=said)  # type: ignore[arg-type]
        write_recording(folder / f"recording_{n}.nc", recording)
    return truth


def write_key(
    case: Case, path: Path, actuator: ActuatorParameters, noise: SensorNoise, truth, rivals: bool = False,
    population: Population = REFERENCE,
) -> None:  # fmt: skip
    """Write the truth of a case, with its detectability where it holds an effect or something unlisted.

    Distances of effects are those of the plain bench; one of something unlisted is from that bench to the same one with
    it alone.
    """
    key: dict = {"case": case.to_dict(), "detectability": None, "fault_sd": None, "nearest_rival": None}
    key["actuator"], key["noise"] = asdict(actuator), asdict(noise)
    key["tolerances"] = population.tolerances
    if case.effects or case.unlisted:
        plain = plain_twin(case)
        signals = simulate_truth(plain, actuator) if is_disturbed(case) else truth
        detector = Detector(plain, actuator, noise, signals, population)
    if case.effects:
        found = detector.detectability()
        key["detectability"] = {"nominal": found.nominal, "members": found.members}
        key["fault_sd"] = found.fault_sd
        if rivals and len(case.effects) == 1:
            distances = {r: detector.linear_rival(r) for r in near_rivals(next(iter(case.effects)))}
            nearest = min(distances, key=lambda r: distances[r])
            key["nearest_rival"] = {"effect": nearest, "distance": distances[nearest]}
    if case.unlisted:
        key["unlisted"] = [u.told(_apart(detector, plain, u, signals, actuator)) for u in case.unlisted]
    write_text(path, json.dumps(key, indent=1))


def _apart(detector: Detector, plain: Case, one: Unlisted, signals, actuator: ActuatorParameters) -> float:
    """Squared distance from a plain bench, of noise-free ``signals``, to the same one with something unlisted."""
    if one.kind().at_sight:
        return LATTICE
    case = replace(plain, unlisted=(one,))
    shifted = []
    for m, values in enumerate(simulate_truth(case, actuator) if in_physics(case.unlisted) else signals):
        shown = {name: np.array(x[0]) for name, x in values.items()}
        shown["time"] = time_axis(plain.recordings[m].duration, plain.recordings[m].interval)
        change(case.unlisted, m, shown)
        shifted.append({name: shown[name][None] for name in values})
    return detector.apart(signals, shifted)


def write_key_without(key: Path, path: Path) -> None:
    """Write the key of the case of T3 on the bench of one of T1, whose key it is but for what the library lacks."""
    written = json.loads(key.read_text())
    written["case"] = without_effect(case_from_dict(written["case"])).to_dict()
    write_text(path, json.dumps(written, indent=1))


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
    case = plain_twin(case_from_dict(key["case"]))
    actuator, noise = ActuatorParameters(**key["actuator"]), SensorNoise(**key["noise"])
    population = population_of(actuator, key.get("tolerances"))
    detector = Detector(case, actuator, noise, simulate_truth(case, actuator), population)
    distance = detector.distance_to if len(case.effects) == 1 else detector.distance_in_place
    return {rival: distance(rival) for rival in wanted}

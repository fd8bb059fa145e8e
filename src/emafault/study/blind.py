"""Diagnoses of blind cases, for the withheld check.

The cases' generator and the diagnosers do not know each other; they meet here. A diagnosis sees a bench's folder and,
on the rung that leaves an effect out, which one the library lacks; one that is told has a library of the truth alone.
"""

import json
import shutil
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..actuator.sensors import SensorNoise
from ..effects import EFFECTS
from ..equations.diagnose import diagnose
from ..errors import InputError
from ..io.atomic import write_text
from ..io.bench import read_bench
from ..io.split import split_bench
from ..reporting.written import to_json
from ..withheld.benches import make_cases, write_key_without
from ..withheld.cases import Case, draw_case, with_twin, without_effect
from ..withheld.population import REFERENCE, Population, population_of

#: cases looked at while developing stand above this seed, those of the scoreboards below
DEVELOPMENT = 1_000_000
#: what a diagnosis may end with on data that it cannot digest
FAILURES = (InputError, ArithmeticError, LookupError, ValueError, np.linalg.LinAlgError)


def run_cases(
    rung: str,
    seeds: Iterable[int],
    folder: Path,
    actuator: ActuatorParameters,
    noise: SensorNoise,
    keep_benches: bool = False,
    again: Collection[int] = (),
    told: Collection[int] = (),
    rivals: Collection[int] = (),
    population: Population = REFERENCE,
) -> list[str]:
    """Make, diagnose and keep the verdicts of a rung's seeds; what is there already is left alone.

    ``FOLDER/keys`` and ``FOLDER/diagnoses/NAME/diagnosis.json`` stay; the recordings go once they are diagnosed.

    Parameters
    ----------
    again : seeds of T1 that are also diagnosed with the effect left out of the library: T3, on the same bench
    told : seeds that are also diagnosed with a library of the true effects alone: ``FOLDER/oracles/NAME``
    rivals : seeds whose keys hold the distance to the nearest rival
    population : units of the actuator

    Returns
    -------
    names of the cases
    """
    names = []
    for seed in seeds:
        cases = companions(rung, seed, seed in again, population)
        names += [c.name for c in cases]
        wanted: dict[Path, tuple[Case, Sequence[str]]] = {}
        for case in cases:
            wanted[folder / "diagnoses" / case.name / "diagnosis.json"] = case, case.left_out
        if seed in told and cases[0].effects:
            others = tuple(e for e in EFFECTS if e not in cases[0].effects)
            wanted[folder / "oracles" / cases[0].name / "diagnosis.json"] = cases[0], others
        keys = {c.name: folder / "keys" / f"{c.name}.json" for c in cases}
        missing = [path for path in wanted if not path.exists()]
        benches = {c.bench: folder / "benches" / c.bench for c in cases}
        if missing or not all(key.exists() for key in keys.values()):
            for case in cases:
                if not benches[case.bench].exists():
                    keys[case.name].unlink(missing_ok=True)
            make_cases(rung, [seed], folder, actuator, noise, seed in rivals, population)
            for case in cases:
                if case.left_out:
                    write_key_without(keys[cases[0].name], keys[case.name])
            for path in missing:
                case, exclude = wanted[path]
                try:
                    verdict = diagnose_bench(benches[case.bench], actuator, noise, exclude, population.tolerances)
                except FAILURES as error:  # counts as a wrong answer, and must not take the whole draw with it
                    verdict = {"verdict": "failed", "which": [], "error": f"{type(error).__name__}: {error}"}
                text = to_json(verdict | {"bench": case.name})
                write_text(path, text)
        if not keep_benches:  # those too that a killed job had diagnosed and not yet removed
            for bench in benches.values():
                shutil.rmtree(bench, ignore_errors=True)
    return names


def companions(rung: str, seed: int, again: bool = False, population: Population = REFERENCE) -> list[Case]:
    """The case of a seed and what is diagnosed with it: its case of T3, or its plain twin."""
    case = draw_case(rung, seed, population)
    return [case, without_effect(case)] if again else list(with_twin(case))


def folder_of(output: Path, code: str) -> Path:
    """Folder of the cases of a draw, beside what its jobs write."""
    return output.parent / f"cases_{code[:8]}"


def run_batch(output: Path, spec: Mapping[str, Any], code: str) -> None:
    """Run one job of a draw and write its cases: their names, and their keys and verdicts by path.

    Cases are kept beside it per version of the code: a killed job goes on where it was, one whose code changed starts
    anew.
    """
    seeds = spec["seeds"]
    folder = folder_of(output, code)
    actuator, noise = ActuatorParameters(**spec["actuator"]), SensorNoise(**spec["sensors"])
    population = population_of(actuator, spec["tolerances"])
    span = range(seeds["first"], seeds["last"])
    beside = {name: seeds[name] for name in ("again", "told", "rivals")}
    names = run_cases(seeds["rung"], span, folder, actuator, noise, **beside, population=population)
    files = [path for name in names for path in case_files(folder, name) if path.exists()]
    kept = {path.relative_to(folder).as_posix(): path.read_text(encoding="utf-8") for path in files}
    text = json.dumps({"folder": folder.name, "cases": names, "files": kept})
    write_text(output, text)


def case_files(folder: Path, name: str) -> list[Path]:
    """Key and verdicts of a case, which need not all be there."""
    verdicts = [folder / kind / name / "diagnosis.json" for kind in ("diagnoses", "oracles")]
    return [folder / "keys" / f"{name}.json", *verdicts]


def diagnose_bench(
    bench: Path,
    actuator: ActuatorParameters,
    noise: SensorNoise,
    exclude: Sequence[str] = (),
    tolerances: Mapping[str, Mapping[str, float]] | None = None,
) -> dict[str, Any]:
    """The verdict on a bench, without report or next experiment.

    Raises
    ------
    InputError : recordings that cannot be used
    """
    brought = read_bench(bench, actuator)
    split = split_bench(brought.recordings)
    found = diagnose(brought.name, brought.recordings, split, actuator, noise, exclude, tolerances=tolerances)
    return found.verdict

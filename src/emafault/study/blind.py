"""Diagnoses of blind cases, for the withheld check and for calibrating the probabilities.

The cases' generator and the diagnosers do not know each other; they meet here. A diagnosis sees a bench's folder and,
on the rung that leaves an effect out, which one the library lacks; one that is told has a library of the truth alone.
"""

import json
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..actuator.sensors import SensorNoise
from ..effects import EFFECTS
from ..equations.diagnose import diagnose
from ..errors import InputError
from ..gap.bench import read_bench, split_bench
from ..gap.decide import UNCALIBRATED, Calibration, Evidence
from ..gap.run import diagnose_recordings, to_json
from ..recording import replace_atomically
from ..withheld.benches import make_cases, write_key_without
from ..withheld.cases import Case, draw_case, with_twin, without_effect
from .curves import DETECTABLE, fit_gap, fit_right

FIELDS = [f.name for f in fields(Evidence)]
#: cases of the development draw stand above this seed, those of the scoreboard below
DEVELOPMENT = 1_000_000
PATHS = ("equations", "simulation")
#: what a diagnosis may end with on data that it cannot digest
FAILURES = (InputError, ArithmeticError, LookupError, ValueError, np.linalg.LinAlgError)


def run_cases(
    rung: str,
    seeds: Iterable[int],
    folder: Path,
    actuator: ActuatorParameters,
    noise: SensorNoise,
    by: str = "equations",
    keep_benches: bool = False,
    again: Collection[int] = (),
    told: Collection[int] = (),
    rivals: Collection[int] = (),
) -> list[str]:
    """Make, diagnose and keep the verdicts of a rung's seeds; what is there already is left alone.

    ``FOLDER/keys`` and ``FOLDER/diagnoses/NAME/diagnosis.json`` stay; the recordings go once they are diagnosed.

    Parameters
    ----------
    by : the path of the diagnosis, one of ``PATHS``
    again : seeds of T1 that are also diagnosed with the effect left out of the library: T3, on the same bench
    told : seeds that are also diagnosed with a library of the true effects alone: ``FOLDER/oracles/NAME``
    rivals : seeds whose keys hold the distance to the nearest rival

    Returns
    -------
    names of the cases
    """
    names = []
    for seed in seeds:
        cases = companions(rung, seed, seed in again)
        names += [c.name for c in cases]
        wanted: dict[Path, tuple[Case, Sequence[str]]] = {}
        for case in cases:
            wanted[folder / "diagnoses" / case.name / "diagnosis.json"] = case, case.left_out
        if seed in told and cases[0].effects:
            others = tuple(e for e in EFFECTS if e not in cases[0].effects)
            wanted[folder / "oracles" / cases[0].name / "diagnosis.json"] = cases[0], others
        keys = {c.name: folder / "keys" / f"{c.name}.json" for c in cases}
        missing = [path for path in wanted if not path.exists()]
        if not missing and all(key.exists() for key in keys.values()):
            continue
        benches = {c.bench: folder / "benches" / c.bench for c in cases}
        for case in cases:
            if not benches[case.bench].exists():
                keys[case.name].unlink(missing_ok=True)
        make_cases(rung, [seed], folder, actuator, noise, seed in rivals)
        for case in cases:
            if case.left_out:
                write_key_without(keys[cases[0].name], keys[case.name])
        for path in missing:
            case, exclude = wanted[path]
            try:
                verdict = diagnose_bench(benches[case.bench], actuator, noise, by, exclude)
            except FAILURES as error:  # counts as a wrong answer, and must not take the whole draw with it
                verdict = {"verdict": "failed", "which": [], "error": f"{type(error).__name__}: {error}"}
            text = to_json(verdict | {"bench": case.name})
            replace_atomically(path, lambda temporary, text=text: temporary.write_text(text))
        for bench in benches.values():
            if not keep_benches:
                for file in bench.glob("*.nc"):
                    file.unlink()
                bench.rmdir()
    return names


def companions(rung: str, seed: int, again: bool = False) -> list[Case]:
    """The case of a seed and what is diagnosed with it: its case of T3, or its plain twin."""
    case = draw_case(rung, seed)
    return [case, without_effect(case)] if again else list(with_twin(case))


def run_batch(output: Path, spec: Mapping[str, Any], code: str) -> None:
    """Run one job of a draw and write where its cases stand.

    Cases are kept per version of the code: a killed job goes on where it was, one whose code changed starts anew.
    """
    seeds = spec["seeds"]
    folder = output.parent / f"cases_{code[:8]}"
    actuator, noise = ActuatorParameters(**spec["actuator"]), SensorNoise(**spec["sensors"])
    span = range(seeds["first"], seeds["last"])
    beside = {name: seeds[name] for name in ("again", "told", "rivals")}
    names = run_cases(seeds["rung"], span, folder, actuator, noise, spec["by"], **beside)
    text = json.dumps({"folder": folder.name, "cases": names})
    replace_atomically(output, lambda temporary: temporary.write_text(text))


def calibrate_draw(batches: Sequence[Path], output: Path) -> None:
    """Calibrate on the cases of a draw and write the calibration."""
    folder = batches[0].parent / json.loads(batches[0].read_text())["folder"]
    fitted, shipped = calibrate(folder, Calibration.load(UNCALIBRATED)), Calibration.load()
    replace(fitted, addition=shipped.addition, remainder=shipped.remainder).save(output)


def diagnose_bench(
    bench: Path,
    actuator: ActuatorParameters,
    noise: SensorNoise,
    by: str = "equations",
    exclude: Sequence[str] = (),
) -> dict:
    """The verdict on a bench by one of ``PATHS``, without report or next experiment.

    Raises
    ------
    InputError : an unknown path, or recordings that cannot be used
    """
    brought = read_bench(bench, actuator)
    if by == "equations":
        recordings = brought.recordings
        return diagnose(brought.name, recordings, split_bench(recordings), actuator, noise, exclude).verdict
    if by == "simulation":
        calibration = Calibration.load()
        return diagnose_recordings(brought, actuator, noise, exclude, calibration, whole=False, threads=1).verdict
    raise InputError(f"by: got '{by}', accepted are {', '.join(PATHS)}")


def calibrate(folder: Path, start: Calibration) -> Calibration:
    """Fit the curves of probability to the verdicts of a folder of development cases and their keys.

    The first curve is fitted to whether a case held a detectable gap, the second to whether the best set was right
    among cases that did and in which the first curve sees it. What the library lacks counts as a gap where it leaves
    more than any effect-free case does: what it leaves within that is no gap that these statistics could tell.
    """
    gap_rows, gap_truth, lacking, seen, right_rows, right_truth = [], [], [], [], [], []
    for path in sorted((folder / "keys").glob("*.json")):
        verdict_path = folder / "diagnoses" / path.stem / "diagnosis.json"
        if not verdict_path.exists():
            continue
        key, verdict = json.loads(path.read_text()), json.loads(verdict_path.read_text())
        truth = set(key["case"]["effects"])
        distance = (key["detectability"] or {}).get("nominal", 0.0)
        evidence = Evidence(**{name: verdict["evidence"][name] for name in FIELDS})
        if truth and distance >= DETECTABLE and key["case"]["left_out"]:
            lacking.append(evidence)
        elif not truth or distance >= DETECTABLE:
            gap_rows.append(evidence)
            gap_truth.append(bool(truth))
        if not verdict["evidence"]["candidates"] or not truth or distance < DETECTABLE:
            continue
        best = set(verdict["evidence"]["candidates"][0][0])
        if key["case"]["left_out"] and _twins(best, truth):
            continue  # nothing tells them apart, so there is nothing to learn from
        right = not key["case"]["left_out"] and _names(verdict, best, truth, key["detectability"]["members"])
        seen.append(evidence.gap_features())
        right_rows.append(evidence.right_features())
        right_truth.append(right)
    noise = max((e.null_excess for e, truth in zip(gap_rows, gap_truth) if not truth), default=np.inf)
    beyond = [e for e in lacking if e.null_excess > noise]
    gap_rows, gap_truth = [*gap_rows, *beyond], [*gap_truth, *[True] * len(beyond)]
    gap = fit_gap(np.array([e.gap_features() for e in gap_rows]), np.array(gap_truth), start)
    asked = np.array(seen) @ np.array(gap) > 0.0
    rows, truths = np.array(right_rows)[asked], np.array(right_truth)[asked]
    curve, most = fit_right(rows, truths, start)
    source = f"{len(gap_rows)} development cases for the first curve, {len(rows)} for the second"
    return Calibration(gap, curve, start.addition, start.remainder, most, source)


def _twins(one: set[str], other: set[str]) -> bool:
    """Whether two sets are the pair of effects that are one and the same torque in any motion."""
    return one | other == {"load_constant", "friction_asymmetry"}


def _names(verdict: Mapping[str, Any], best: set[str], truth: set[str], members: Mapping[str, float]) -> bool:
    """Whether the best set, or one of its group, is the truth less what nobody could have seen of it."""
    seen = {e for e in truth if members.get(e, DETECTABLE) >= DETECTABLE}
    sets = [set(e["effects"]) for e in verdict["which"] if e.get("group")]
    return any(seen <= s <= truth for s in (sets or [best]))

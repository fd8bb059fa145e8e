"""A whole diagnosis: recordings in; verdict, report, experiment and tracking out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..actuator.sensors import SensorNoise
from ..effects import EFFECTS
from ..errors import InputError
from ..recording import Recording, replace_atomically
from ..written import EXPERIMENT, REPORT, VERDICT, file_name, log_diagnosis, results_folder, to_json
from .bench import Bench, read_bench, split_bench
from .decide import Calibration
from .diagnose import Diagnosis, diagnose
from .words import summary

THREADS = 2
RIVALS = 5  # sets that are put on the confirm recordings


@dataclass(frozen=True)
class Diagnosed:
    """One diagnosis with what its report needs: true faults where known, the fix as an experiment's text."""

    diagnosis: Diagnosis
    truths: Mapping[str, np.ndarray]
    region: Any = None
    experiment: str = ""
    labels: Mapping[str, str] = field(default_factory=dict)

    @property
    def verdict(self) -> dict:
        """The verdict as written."""
        return self.diagnosis.verdict


def diagnose_path(
    path: str | Path,
    spec: Mapping[str, Any],
    out: str | Path | None = None,
    twin: str = "actuator",
    exclude: Sequence[str] = (),
    experiment: str | Path | None = None,
    track: bool = True,
) -> dict[str, dict]:
    """Diagnose a bench and write what was found.

    Parameters
    ----------
    path : folder of recordings, or what the twin of a measured machine reads
    spec : ``actuator``, ``sensors`` and ``tracking`` of a composed configuration
    out : folder to write to; None takes ``results/diagnoses/<name of the bench>``
    twin : ``actuator`` or the name of a measured machine's twin
    exclude : effects that the library is to lack
    experiment : file that receives the fix as an experiment, besides the one among the results
    track : whether to log an MLflow run; one that fails is said so and breaks nothing

    Returns
    -------
    the verdict of each case; a bench of the actuator is one case

    Raises
    ------
    InputError : a bench, twin or effect that cannot be used, or results that cannot be written
    """
    path = Path(path)
    name = path.resolve().name if path.is_dir() else path.stem
    folder = Path(out) if out is not None else results_folder() / "diagnoses" / name
    if twin == "actuator":
        cases = {name: diagnose_bench(path, spec, exclude)}
    else:
        cases = diagnose_measured(path, twin, exclude)
    folders = {case: folder if len(cases) == 1 else folder / file_name(case) for case in cases}
    for case, found in cases.items():
        write_verdict(folders[case], found)
        if found.experiment and experiment is not None:
            _write(Path(experiment), found.experiment)
    if len(cases) > 1:
        _write(
            folder / VERDICT, to_json({"bench": name, "twin": twin, "cases": {c: f.verdict for c, f in cases.items()}})
        )
    # pictures and tracking take as long again: nobody need wait for them to read the verdict
    for found in cases.values():
        print(summary(found.verdict), flush=True)
    for case, found in cases.items():
        write_pages(folders[case], found)
    if len(cases) > 1:
        _write_contents(folder, name, list(cases))
    print(f"written to {folder}", flush=True)
    if track:
        for case, found in cases.items():
            log_diagnosis(spec["tracking"], folders[case], found.verdict)
    return {case: found.verdict for case, found in cases.items()}


# --- the two kinds of machine ----------------------------------------------------------------------------------------


def diagnose_bench(path: Path, spec: Mapping[str, Any], exclude: Sequence[str] = ()) -> Diagnosed:
    """Read, split and diagnose a bench of the reference actuator, without writing anything.

    Raises
    ------
    InputError : recordings or effects that cannot be used
    """
    actuator = ActuatorParameters(**spec["actuator"])
    return diagnose_recordings(read_bench(path, actuator), actuator, SensorNoise(**spec["sensors"]), exclude)


def diagnose_recordings(
    bench: Bench,
    actuator: ActuatorParameters,
    noise: SensorNoise,
    exclude: Sequence[str] = (),
    calibration: Calibration | None = None,
    whole: bool = True,
    threads: int = THREADS,
) -> Diagnosed:
    """Diagnose a bench that has been read and checked.

    Parameters
    ----------
    noise : of the sensors, where the recordings do not tell it
    calibration : frozen curves of probability; None takes those of the project
    threads : simulations run side by side
    whole : with the rivals on the confirm recordings even where none can win, the next experiments and the pictures; a
        withheld check needs none of them

    Raises
    ------
    InputError : an excluded effect that does not exist
    """
    from ..twins import actuator_experiments
    from ..twins.actuator import ActuatorTwin
    from ..twins.actuator_features import feature_ladder
    from ..twins.actuator_pictures import worst_region
    from .handover import experiment_text
    from .held_out import claim, contested, held_out
    from .next_experiment import next_experiments

    for effect in exclude:
        if effect not in EFFECTS:
            raise InputError(f"exclude: '{effect}' is not an effect, accepted are {', '.join(EFFECTS)}")
    recordings = bench.recordings
    explore, confirm = split_bench(recordings)
    truths = {n: r.fault for n, r in recordings.items() if r.fault is not None}
    twin: Any = ActuatorTwin(actuator, recordings, noise, tuple(exclude), threads)
    found = diagnose(twin, bench.name, explore, confirm, calibration or Calibration.load(), truths)
    verdict = found.verdict
    verdict["warnings"] = bench.warnings
    verdict["shrinks"]["features"] = feature_ladder(found)
    if whole or contested(found):
        verdict["held_out"] = held_out(found, RIVALS)
        claim(found, verdict["held_out"])
    if not whole:
        return Diagnosed(found, truths)
    verdict["next_experiment"] = next_experiments(found, actuator_experiments)
    named = verdict["verdict"] in ("explained", "group", "partly")
    best = found.found.candidates[0] if named else None
    null = found.found.null
    verdict["simulator"] = {"before": actuator_experiments.catalogue_effects(twin, null.values, ())}
    verdict["simulator"]["after"] = (
        actuator_experiments.catalogue_effects(twin, best.point.values, best.effects)
        if best is not None
        else verdict["simulator"]["before"]
    )
    text = experiment_text(verdict, verdict["simulator"]["after"], f"diagnosed_{file_name(bench.name)}")
    return Diagnosed(found, truths, worst_region(found), text, {n: _label(n, r) for n, r in recordings.items()})


def _label(name: str, recording: Recording) -> str:
    """How figures call a recording: file, command, temperature, health."""
    stem = name.removesuffix(".nc").removeprefix("recording_")
    command = recording.attributes.get("command", "")
    parts = [stem, command if command != "unknown" and command not in stem else ""]
    return " ".join(p for p in parts if p) + f", {recording.ambient_temperature:.0f} °C, {recording.health}"


def diagnose_measured(path: Path, twin: str, exclude: Sequence[str] = ()) -> dict[str, Diagnosed]:
    """Diagnose every case of a measured machine's file or folder.

    Raises
    ------
    InputError : a twin, file or effect that cannot be used
    """
    from ..twins.diagnosed import diagnose_cases
    from ..twins.library import calibration_of

    if exclude:
        raise InputError("--exclude: effects can be left out of the actuator's library only")
    cases = diagnose_cases(twin, path, calibration_of(twin))
    for found in cases.values():
        found.verdict.setdefault("warnings", [])
    return {case: Diagnosed(found, {}) for case, found in cases.items()}


# --- what is written -------------------------------------------------------------------------------------------------


def write_verdict(folder: Path, found: Diagnosed) -> None:
    """Write the verdict and, where there is one, the experiment of one diagnosis.

    Raises
    ------
    InputError : a file that cannot be written
    """
    _write(folder / VERDICT, to_json(found.verdict))
    if found.experiment:
        _write(folder / EXPERIMENT, found.experiment)


def write_pages(folder: Path, found: Diagnosed) -> None:
    """Write the report of one diagnosis.

    Raises
    ------
    InputError : a file that cannot be written
    """
    from .report import write_report
    from .retrained import section

    retrained = section(folder, found.verdict)
    write_report(found.diagnosis, folder / REPORT, found.truths, found.region, retrained, found.labels)


def _write(path: Path, text: str) -> None:
    replace_atomically(path, lambda temporary: temporary.write_text(text, encoding="utf-8"))


def _write_contents(folder: Path, name: str, cases: Sequence[str]) -> None:
    from ..figures.page import Page

    page = Page(f"Diagnoses of {name}")
    links = "".join(f'<li><a href="{file_name(c)}/{REPORT}">{c}</a></li>' for c in cases)
    page.parts.append(f"<ul>{links}</ul>")
    page.write(folder / REPORT)

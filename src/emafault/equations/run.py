"""A bench of the reference actuator diagnosed by equation errors: read, diagnosed, written with a page."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from ..actuator.parameters import ActuatorParameters
from ..actuator.sensors import SensorNoise
from ..diagnosis.forked import beside
from ..errors import InputError
from ..io.atomic import write_text
from ..io.bench import Bench, bench_name, new_folder, read_bench
from ..io.enough import SAMPLES, within
from ..io.split import split_bench
from ..paths import CONF, results_folder
from ..places import file_name
from ..plain import read_yaml
from ..reporting.written import EXPERIMENT, REPORT, VERDICT, aside, checked, refuse_foreign
from .corrected import write_corrected
from .curves import panels
from .diagnose import Diagnosed, diagnose
from .fitted import numbers
from .handover import experiment_text
from .probabilities import checked_on
from .sentences import finding

PROCESSES = 2
SAID = ("unconfirmed", "set aside", "samples")  # kinds of warnings that the command says: what was not told, or taken


def diagnose_folder(
    path: str | Path,
    spec: Mapping[str, Any],
    out: str | Path | None = None,
    exclude: Sequence[str] = (),
    experiment: str | Path | None = None,
    track: bool = True,
    corrected: str | Path | None = None,
    force: bool = True,
    calibration: str | Path | None = None,
    samples: int = SAMPLES,
) -> dict:
    """Diagnose a folder of recordings; write ``diagnosis.json``, ``report.html`` and ``experiment.yaml``.

    Parameters
    ----------
    spec : ``actuator``, ``tolerances``, ``sensors`` and ``tracking`` of a composed configuration
    out : folder to write to; None takes ``results/diagnoses/<name of the bench>``
    exclude : effects that the library is to lack
    experiment : file that receives the fix as an experiment, besides the one among the results
    corrected : new folder for the recordings with the faults of their measuring chain undone
    track : whether to log an MLflow run; one that fails is said so and breaks nothing
    force : whether files in ``out`` that are not of a diagnosis of this bench may be replaced
    calibration : check of the probabilities on this actuator, see ``probabilities``
    samples : of a bench that are taken at most, see ``io.enough``

    Raises
    ------
    InputError : recordings or effects that cannot be used, or results that cannot be written
    """
    name = bench_name(path)
    folder = Path(out) if out is not None else folder_of(name)
    refuse_foreign(folder, [name], ["actuator"], force)  # before the work, not after it
    if corrected is not None:
        new_folder(path, corrected, "--corrected")
    bench = read_within(path, spec, samples)
    if corrected is not None and (message := _warned(bench.warnings, "samples")):
        raise InputError(f"--corrected: {message[0]}, accepted is as many as there are")
    found = diagnosed(bench, spec, exclude, calibration)
    verdict = found.verdict
    with aside(track) as tracked:
        write(found, bench, folder, experiment)
        if corrected is not None:
            undone = write_corrected(found, bench.recordings, path, corrected)
            print(f"corrected recordings in {corrected}, undone: {'; '.join(undone) or 'nothing'}", flush=True)
        print(f"written to {folder}", flush=True)
        tracked(spec["tracking"], folder, verdict, finding(verdict), path)
    return verdict


def read_within(path: str | Path, spec: Mapping[str, Any], samples: int = SAMPLES) -> Bench:
    """A folder of recordings read and checked, of which no more samples are taken.

    Raises
    ------
    InputError : recordings that cannot be used
    """
    return within(read_bench(path, ActuatorParameters(**spec["actuator"])), samples)


def diagnosed(
    bench: Bench, spec: Mapping[str, Any], exclude: Sequence[str] = (), calibration: str | Path | None = None
) -> Diagnosed:
    """A bench diagnosed, what was found printed.

    Raises
    ------
    InputError : recordings or effects that cannot be used
    """
    found = diagnose_bench(bench, spec, exclude, calibration)
    said = [m for kind in SAID for m in _warned(found.verdict["warnings"], kind)]
    print("\n".join([*finding(found.verdict), *said]), flush=True)
    return found


def _warned(warnings: Sequence[Mapping[str, Any]], kind: str) -> list[str]:
    """Messages of warnings of a kind."""
    return [w["message"] for w in warnings if w["kind"] == kind]


def diagnose_bench(
    bench: Bench, spec: Mapping[str, Any], exclude: Sequence[str] = (), calibration: str | Path | None = None
) -> Diagnosed:
    """Diagnose recordings that have been read and checked.

    Parameters
    ----------
    spec : ``actuator``, ``sensors`` and ``tolerances`` of a composed configuration
    exclude : effects that the library is to lack
    calibration : check of the probabilities on this actuator, see ``probabilities``

    Raises
    ------
    InputError : an effect that does not exist, or a check of another actuator
    """
    actuator, noise = ActuatorParameters(**spec["actuator"]), SensorNoise(**spec["sensors"])
    checked_by = checked_on(actuator, calibration)  # before the work, not after it
    split = split_bench(bench.recordings)
    found = diagnose(bench.name, bench.recordings, split, actuator, noise, exclude, PROCESSES, spec["tolerances"])
    found.verdict["warnings"] = [*bench.warnings, *found.verdict["warnings"]]
    found.verdict["calibration"] = checked_by
    return found


def folder_of(bench: str) -> Path:
    """Folder that the diagnosis of a bench is written to unless another is named."""
    return results_folder() / "diagnoses" / file_name(bench)


def _differing(actuator: ActuatorParameters) -> dict[str, Any]:
    """Parameters that are not those of the reference actuator."""
    reference = read_yaml(CONF / "actuator" / "reference.yaml")
    return {name: value for name, value in asdict(actuator).items() if value != reference[name]}


def write(found: Diagnosed, bench: Bench, folder: Path, experiment: str | Path | None = None) -> None:
    """Write ``diagnosis.json``, ``report.html`` and ``experiment.yaml``, the last also to ``experiment``."""
    verdict = found.verdict
    with beside(found, "next_experiments") as following:  # takes as long as the pictures
        # what draws takes half a second to import, and the verdict does not wait
        from .page import Detail, draw

        truths = {n: r.fault for n, r in bench.recordings.items()}
        page = draw(verdict, truths, Detail(panels(found), numbers(found)), following)
        verdict["next_experiment"] = following()
    name = f"diagnosed_{file_name(bench.name)}"
    text = experiment_text(verdict, verdict["simulator"]["after"], name, _differing(found.bench.machine.actuator))
    last = checked(verdict)
    page.write(folder / REPORT)
    write_text(folder / EXPERIMENT, text)
    if experiment is not None:
        write_text(experiment, text)
    write_text(folder / VERDICT, last)  # the last of them: where a verdict is, its report is

"""A bench of the reference actuator diagnosed by equation errors: read, diagnosed, written with a page."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..actuator.parameters import ActuatorParameters
from ..actuator.sensors import SensorNoise
from ..io.atomic import write_text
from ..io.bench import Bench, bench_name, new_folder, read_bench
from ..io.split import split_bench
from ..paths import results_folder
from ..places import file_name
from ..reporting.retrained import section
from ..reporting.written import EXPERIMENT, REPORT, VERDICT, aside, checked, refuse_foreign
from .corrected import write_corrected
from .curves import panels
from .diagnose import Diagnosed, diagnose
from .fitted import numbers
from .handover import experiment_text
from .page import Detail, draw, finding

PROCESSES = 2


def diagnose_folder(
    path: str | Path,
    spec: Mapping[str, Any],
    out: str | Path | None = None,
    exclude: Sequence[str] = (),
    experiment: str | Path | None = None,
    track: bool = True,
    corrected: str | Path | None = None,
    force: bool = True,
) -> dict:
    """Diagnose a folder of recordings; write ``diagnosis.json``, ``report.html`` and ``experiment.yaml``.

    Parameters
    ----------
    spec : ``actuator``, ``sensors`` and ``tracking`` of a composed configuration
    out : folder to write to; None takes ``results/diagnoses/<name of the bench>``
    exclude : effects that the library is to lack
    experiment : file that receives the fix as an experiment, besides the one among the results
    corrected : new folder for the recordings with the faults of their measuring chain undone
    track : whether to log an MLflow run; one that fails is said so and breaks nothing
    force : whether files in ``out`` that are not of a diagnosis of this bench may be replaced

    Raises
    ------
    InputError : recordings or effects that cannot be used, or results that cannot be written
    """
    name = bench_name(path)
    folder = Path(out) if out is not None else results_folder() / "diagnoses" / file_name(name)
    refuse_foreign(folder, [name], ["actuator"], force)  # before the work, not after it
    if corrected is not None:
        new_folder(path, corrected, "--corrected")
    bench, found = diagnosed(path, spec, exclude)
    verdict = found.verdict
    with aside(track) as tracked:
        _write(found, bench, folder, experiment)
        if corrected is not None:
            undone = write_corrected(found, bench.recordings, path, corrected)
            print(f"corrected recordings in {corrected}, undone: {'; '.join(undone) or 'nothing'}", flush=True)
        print(f"written to {folder}", flush=True)
        tracked(spec["tracking"], folder, verdict)
    return verdict


def diagnosed(path: str | Path, spec: Mapping[str, Any], exclude: Sequence[str] = ()) -> tuple[Bench, Diagnosed]:
    """A folder of recordings read and diagnosed, what was found printed.

    Raises
    ------
    InputError : recordings or effects that cannot be used
    """
    actuator = ActuatorParameters(**spec["actuator"])
    bench = read_bench(path, actuator)
    split = split_bench(bench.recordings)
    found = diagnose(bench.name, bench.recordings, split, actuator, SensorNoise(**spec["sensors"]), exclude, PROCESSES)
    found.verdict["warnings"] = bench.warnings
    print("\n".join(finding(found.verdict)), flush=True)
    return bench, found


def _write(found: Diagnosed, bench: Bench, folder: Path, experiment: str | Path | None) -> None:
    verdict = found.verdict
    verdict["next_experiment"] = found.next_experiments()
    text = experiment_text(verdict, verdict["simulator"]["after"], f"diagnosed_{file_name(bench.name)}")
    write_text(folder / VERDICT, checked(verdict))
    write_text(folder / EXPERIMENT, text)
    if experiment is not None:
        write_text(experiment, text)
    truths = {n: r.fault for n, r in bench.recordings.items()}
    detail = Detail(panels(found), numbers(found))
    draw(verdict, truths, section(folder, verdict), detail).write(folder / REPORT)

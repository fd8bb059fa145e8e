"""An evaluated experiment as one MLflow run, the trials of its search nested below."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..plain import read_json
from ..tracking import Entry, ensure_experiment, log_run
from .networks import folders, write_json


def prepare_tracking(spec: Mapping[str, Any], output: str) -> None:
    """Create database and experiment once.

    Parameters
    ----------
    spec : ``uri`` and ``experiment``

    Raises
    ------
    InputError : an address that cannot be used
    """
    write_json(output, dict(spec) | {"experiment_id": ensure_experiment(spec["uri"], spec["experiment"])})


def track_evaluation(
    name: str,
    spec: Mapping[str, Any],
    where: str,
    metrics: str,
    histories: Sequence[str],
    search: Sequence[str],
    files: Mapping[str, str],
    output: str,
) -> None:
    """Log one evaluation: configuration, metrics, learning curves, figures, report and model; trials as nested runs.

    The metrics ``best.*`` are the mean absolute errors of the estimator that the tag ``best`` names.

    Parameters
    ----------
    spec : the whole resolved configuration
    where : what ``prepare_tracking`` wrote
    search : trials and choice of the search, or nothing
    files : file or folder -> folder among the run's artifacts

    Raises
    ------
    InputError : an address that cannot be used
    """
    table, server = read_json(metrics, "results", "bound"), read_json(where, "uri", "experiment")
    best = min(table["results"], key=lambda entry: entry["all"]["errors.mean.over_range"]["mean"])
    values = {f"best.{output}": best["all"][f"errors.{output}.mae"]["mean"] for output in ("dT", "N", "xi")}
    for entry in table["results"]:
        label = f"{entry['method']}.{entry['estimator']}"
        values[f"{label}.parameters"] = entry["parameters"]
        for kind in ("all", "few", "all_calibrated", "few_calibrated"):
            for key, summary in entry.get(kind, {}).items():
                if key.endswith((".mae", ".over_range", ".ratio", ".bias")) or key == "coverage.mean":
                    values[f"{label}.{kind}.{key.removeprefix('errors.')}"] = summary["mean"]
    for name_, bound in table["bound"].items():
        values |= {f"bound.{name_}.{key}": value for key, value in (bound or {}).items()}
    curves = {}
    for folder in folders(histories):
        for seed in read_json(folder / "history.json", "curves")["curves"][:1]:
            for kind in ("train", "validation"):
                curves[f"curve.{folder.parent.name}.{folder.name}.{kind}"] = seed[0][kind]
    children: list[Entry] = []
    if search:
        trials, chosen = (read_json(path) for path in search)
        for trial in trials:
            tags = {"pareto": str(trial["pareto"]), "chosen": str(trial["number"] == chosen["number"])}
            shown = {key: trial[key] for key in ("error", "parameters", "seconds")}
            settings = {"network": trial["network"], "training": trial["training"]}
            children.append(Entry(f"trial {trial['number']}", settings, shown, tags=tags))
    identifiers = {
        str(folder / "seed_0" / "identifier.json"): f"model/{folder.parent.name}/{folder.name}"
        for folder in folders(histories)
    }
    entry = Entry(
        name,
        parameters=spec,
        metrics=values,
        curves=curves,
        tags={"experiment": name, "stage": "evaluation", "best": f"{best['method']}/{best['estimator']}"},
        files={path: folder for path, folder in {**files, **identifiers}.items() if Path(path).exists()},
        children=tuple(children),
    )
    write_json(output, {"run_id": log_run(server["uri"], server["experiment"], entry), **server})

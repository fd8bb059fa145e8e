"""An evaluated experiment as one MLflow run, the trials of its search nested below."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..plain import read_json
from ..tracking import Data, Entry, Network, ensure_experiment, log_run
from .networks import folders, write_json

#: outputs with the units that their errors are logged in: MLflow compares runs by three decimals
OUTPUTS = {"dT": ("K", 1.0), "N": ("pct", 100.0), "xi": ("pct", 100.0)}


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
    network: tuple[str, str],
    data: Sequence[Mapping[str, Any]],
    output: str,
) -> None:
    """Log one evaluation: configuration, headline figures, tables, learning curves, data sets, network and report.

    Parameters
    ----------
    spec : the whole resolved configuration
    where : what ``prepare_tracking`` wrote
    search : trials and choice of the search, or nothing
    files : file or folder -> folder among the run's artifacts
    network : ONNX file of the exported network and the history of the estimator that it is
    data : ``name``, ``digest``, ``source``, ``context`` and ``rows`` of each data set

    Raises
    ------
    InputError : an address that cannot be used
    """
    table, server = read_json(metrics, "results", "bound"), read_json(where, "uri", "experiment")
    best = min(table["results"], key=lambda entry: entry["all"]["errors.mean.over_range"]["mean"])
    values = headline(table, best)
    every = _curves(histories)
    shown = _shown_curves(every, table["results"])
    identifiers = {
        str(folder / "seed_0" / "identifier.json"): f"model/{folder.parent.name}/{folder.name}"
        for folder in folders(histories)
    }
    entry = Entry(
        name,
        parameters=spec,
        metrics=values,
        curves=shown,
        tables={"tables/metrics.json": _every_metric(table), "tables/curves.json": _as_columns(every)},
        tags={"experiment": name, "stage": "evaluation", "best": f"{best['method']}/{best['estimator']}"},
        note=_note(spec["question"], best, values),
        data=[Data(**entry) for entry in data],
        network=_network(*network, table),
        files={path: folder for path, folder in {**files, **identifiers}.items() if Path(path).exists()},
        children=_trials(search),
    )
    write_json(output, {"run_id": log_run(server["uri"], server["experiment"], entry), **server})


def headline(table: Mapping[str, Any], best: Mapping[str, Any]) -> dict[str, float]:
    """The figures that experiments are compared by.

    Mean absolute errors (dT in K, N and xi in %) of the best estimator on fresh runs, ``calibrated`` once a unit is
    calibrated, at the ``bound`` beside it, and of the ``paper``'s method with its network; coverage of the intervals,
    error over range and number of weights of the best.
    """
    values = _errors("error", best["all"]) | {
        "coverage": best["all"]["coverage.mean"]["mean"],
        "over_range_pct": 100.0 * best["all"]["errors.mean.over_range"]["mean"],
        "weights": best["parameters"],
    }
    if "all_calibrated" in best:
        values |= _errors("calibrated", best["all_calibrated"])
    bound = table["bound"].get(best["bound"])
    values |= {f"bound_{output}_{unit}": scale * bound[output] for output, (unit, scale) in OUTPUTS.items() if bound}
    for entry in table["results"]:
        if (entry["method"], entry["estimator"]) == ("paper", "network"):
            values |= _errors("paper", entry["all"])
    return values


def _errors(name: str, results: Mapping[str, Any]) -> dict[str, float]:
    """Mean absolute errors by output, named with their unit."""
    return {
        f"{name}_{output}_{unit}": scale * results[f"errors.{output}.mae"]["mean"]
        for output, (unit, scale) in OUTPUTS.items()
    }


def _note(question: str, best: Mapping[str, Any], values: Mapping[str, float]) -> str:
    """Description of a run: the headline figures as a table."""
    rows = {"error": f"best: {best['method']}/{best['estimator']}", "calibrated": "the same, unit calibrated",
            "bound": "Cramér-Rao bound", "paper": "the paper's method"}  # fmt: skip
    lines = ["| mean absolute error | dT (K) | N (%) | xi (%) |", "|---|---|---|---|"]
    for name, words in rows.items():
        cells = [values.get(f"{name}_{output}_{unit}") for output, (unit, _) in OUTPUTS.items()]
        if None not in cells:
            lines.append(f"| {words} | {' | '.join(f'{cell:.3g}' for cell in cells)} |")
    return "\n".join([question, "", *lines, "", f"Its intervals cover {values['coverage']:.3f}."])


def _network(path: str, folder: str, table: Mapping[str, Any]) -> Network:
    """The exported network with its own errors; ``folder`` of its estimator."""
    method, estimator = Path(folder).parts[-2:]
    own = next(e["all"] for e in table["results"] if (e["method"], e["estimator"]) == (method, estimator))
    return Network(path, {"reconstruction": method, "estimator": estimator}, _errors("network", own))


def _every_metric(table: Mapping[str, Any]) -> dict[str, list]:
    """Every metric of every estimator, and the bounds, as columns."""
    rows = [
        (entry["method"], entry["estimator"], kind, key, summary["mean"], summary["std"])
        for entry in table["results"]
        for kind in ("all", "few", "all_calibrated", "few_calibrated")
        for key, summary in entry.get(kind, {}).items()
    ]
    rows += [
        ("bound", name, "all", key, value, 0.0)
        for name, b in table["bound"].items()
        for key, value in (b or {}).items()
    ]
    names = ("method", "estimator", "runs", "metric", "mean", "std")
    return {name: [row[n] for row in rows] for n, name in enumerate(names)}


def _curves(histories: Sequence[str]) -> dict[tuple[str, str, str], list[float]]:
    """(method, estimator, train or validation) -> error by epoch of the first seed's network."""
    return {
        (folder.parent.name, folder.name, kind): seed[0][kind]
        for folder in folders(histories)
        for seed in read_json(folder / "history.json", "curves")["curves"][:1]
        for kind in ("train", "validation")
    }


def _shown_curves(curves: Mapping[tuple[str, str, str], list[float]], results: Sequence[Mapping]) -> dict[str, list]:
    """Those of the best network."""
    error = {(e["method"], e["estimator"]): e["all"]["errors.mean.over_range"]["mean"] for e in results}
    best = min({key[:2] for key in curves}, key=lambda key: error.get(key, float("inf")), default=None)
    return {f"learning.{key[2]}": values for key, values in curves.items() if key[:2] == best}


def _as_columns(curves: Mapping[tuple[str, str, str], list[float]]) -> dict[str, list]:
    rows = [(*key, epoch, value) for key, values in curves.items() for epoch, value in enumerate(values)]
    names = ("method", "estimator", "part", "epoch", "error")
    return {name: [row[n] for row in rows] for n, name in enumerate(names)}


def _trials(search: Sequence[str]) -> tuple[Entry, ...]:
    if not search:
        return ()
    trials, chosen = (read_json(path) for path in search)
    children = []
    for trial in trials:
        tags = {"pareto": str(trial["pareto"]), "chosen": str(trial["number"] == chosen["number"])}
        shown = {key: trial[key] for key in ("error", "parameters", "seconds")}
        settings = {"network": trial["network"], "training": trial["training"]}
        children.append(Entry(f"trial {trial['number']}", settings, shown, tags=tags))
    return tuple(children)

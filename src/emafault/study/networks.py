"""Estimators of a study: the closed form, the configured network over several seeds, the searched one, its export."""

import json
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..dataset import unit_parameters
from ..errors import InputError
from ..identification.evaluation import fault_range
from ..identification.fitting import Prior, Recipe, fit_identifier
from ..identification.posterior import Knowledge
from ..identification.rows import BLOCK, MOST_AT_ONCE, Rows, TrainingRows, store
from ..identification.search import SearchSettings, Trial, choose, finished, ranked, run_worker
from ..io.atomic import whole_folder, write_text
from ..plain import read_json
from ..progress import progress, say
from .features import FeatureTable, read_features, read_features_in_blocks, runs_in

HISTORY = "history.json"
OFF = 0.01  # relative, of the unit for which an exported network is compared


def write_json(path: str | Path, value: Any) -> None:
    """Write plain values as readable JSON, whole or not at all."""
    text = json.dumps(value, indent=1, sort_keys=True)
    write_text(path, text + "\n")


def write_yaml(path: str | Path, value: Any) -> None:
    """Write plain values as YAML, whole or not at all."""
    from omegaconf import OmegaConf

    text = OmegaConf.to_yaml(OmegaConf.create(value))
    write_text(path, text)


def width_of(faults: Mapping[str, Any]) -> np.ndarray:
    """(6,) range of each fault component, what errors are divided by."""
    N, xi, dT = ((faults[key]["low"], faults[key]["high"]) for key in ("N", "xi", "dT"))
    return fault_range(N, xi, dT)


def seed_folder(folder: str | Path, seed: int) -> Path:
    """Where the identifier of one seed is kept."""
    return Path(folder) / f"seed_{seed}"


def train_identifier(
    estimator: str,
    features: str,
    spec: Mapping[str, Any],
    history: str | Path,
    chosen: str | None = None,
    seed: int | None = None,
) -> None:
    """Fit one estimator on one method's features, networks from several seeds, and save them beside ``history``.

    Parameters
    ----------
    estimator : ``closed_form``, ``network`` (as configured) or ``searched`` (as ``chosen`` by the search)
    history : learning curves of every seed; its folder is written whole, and what was in it is removed
    seed : the only one to train, of many runs; None for the ``seeds`` of the settings

    Raises
    ------
    InputError : features that cannot be used, or a folder that cannot be written
    """
    settings = dict(spec)
    if chosen:
        settings |= {key: read_json(chosen, "network", "training")[key] for key in ("network", "training")}
    prior = Prior(ActuatorParameters(**spec["actuator"]), spec["magnet_coefficient"], Knowledge(**spec["known"]))
    folder, curves = Path(history).parent, []
    learns = estimator != "closed_form"
    seeds = [seed] if seed is not None else range(settings["seeds"] if learns else 1)
    with tempfile.TemporaryDirectory() as scratch, whole_folder(folder) as part:
        rows = learning_rows(features, Path(scratch), spec.get("units")).identified()
        for number in progress(seeds, f"train {folder.parent.name} {estimator}", len(seeds)):
            recipe = Recipe(settings["network"], settings["training"], number) if learns else None
            fit = fit_identifier(rows, prior, recipe)
            fit.identifier.save(seed_folder(part, number))
            if fit.trained:
                curves.append([asdict(curve) for curve in fit.trained.curves])
        plain = {key: settings.get(key) for key in ("network", "training")}
        told = {"estimator": estimator, "seeds": len(seeds), "rows": len(rows.faults), "curves": curves, **plain}
        write_json(part / Path(history).name, told)


def join_seeds(folders: Sequence[str], history: str | Path) -> None:
    """Save the networks of several seeds, trained one by one, beside ``history`` as if trained together.

    Raises
    ------
    InputError : a folder that cannot be read or written
    """
    parts = [read_json(f"{folder}/{HISTORY}", "curves") for folder in folders]
    with whole_folder(Path(history).parent) as whole:
        for seed, folder in enumerate(folders):
            shutil.copytree(seed_folder(folder, seed), seed_folder(whole, seed))
        curves = [curve for part in parts for curve in part["curves"]]
        write_json(whole / Path(history).name, {**parts[0], "seeds": len(parts), "curves": curves})


def learning_rows(features: str, scratch: Path, units: Mapping[str, Any] | None = None) -> Rows:
    """Rows of a table of features, with what each run's unit is, where units differ; many of them in files.

    Parameters
    ----------
    scratch : folder for the files
    units : the sub-tree ``config.dataset_spec``; None where all units are alike, and nothing is to be taken out

    Raises
    ------
    InputError : no readable table of features
    """
    own = None if units is None else unit_parameters(units)

    def rows_of(table: FeatureTable, first: int) -> TrainingRows:
        unit = None if own is None else own[first : first + len(table.faults)]
        return TrainingRows(table.inputs, table.faults, table.features.inputs_covariance, unit)

    if runs_in(features) <= MOST_AT_ONCE:
        return rows_of(read_features(features), 0)

    def each() -> Iterator[TrainingRows]:
        first = 0
        for table in read_features_in_blocks(features, BLOCK):
            yield rows_of(table, first)
            first += len(table.faults)

    return store(scratch, each())


def search_settings(spec: Mapping[str, Any]) -> SearchSettings:
    """What is searched, from the sub-tree ``config.search_spec``."""
    search = spec["search"]
    space = {f"{section}.{key}": values for section, part in search["space"].items() for key, values in part.items()}
    picked = {key: search[key] for key in ("trials", "sampler", "repeats", "seed")}
    return SearchSettings(space=space, network=spec["network"], training=spec["training"], **picked)


def search_network(features: str, spec: Mapping[str, Any], storage: str, worker: int, output: str) -> None:
    """Run one worker of the search until the asked number of trials is finished.

    ``output`` gets every trial that has finished by then, the other workers' too: what follows need not reach the
    storage, which may be a journal on another node.

    Raises
    ------
    InputError : an unusable storage or space
    """
    last = [-1]

    def tell(done: int, asked: int) -> None:
        if done != last[0] and done % 5 == 0:
            last[0] = done
            say(f"search: {done} of {asked} trials")

    settings = search_settings(spec)
    with tempfile.TemporaryDirectory() as scratch:
        rows = learning_rows(features, Path(scratch)).identified()
        data = rows.features, rows.faults, width_of(spec["faults"])
        ran = run_worker(storage, settings, *data, worker, progress=tell)
        trials = [asdict(trial) for trial in finished(storage, settings, *data)]
    write_json(output, {"worker": worker, "ran": ran, "trials": trials})


def choose_network(workers: Sequence[str], spec: Mapping[str, Any], trials: str, chosen: str) -> None:
    """List the finished trials and choose the smallest network among the good ones.

    Parameters
    ----------
    workers : what ``search_network`` has written
    trials, chosen : JSON files to write

    Raises
    ------
    InputError : no finished trial, or workers that searched apart from each other
    """
    found: dict[int, Trial] = {}
    for path in workers:
        for trial in _trials(path):
            if found.setdefault(trial.number, trial) != trial:
                raise InputError(
                    f"search.storage: the workers of this search share none ({path} has another trial "
                    f"{trial.number}); accepted is the address of a database that all of them reach"
                )
    every = ranked(found.values(), spec["search"]["trials"])
    write_json(trials, [asdict(trial) for trial in every])
    write_json(chosen, asdict(choose(every, spec["search"]["tolerance"])))


def _trials(path: str) -> list[Trial]:
    """Trials that a worker of the search has written."""
    try:
        return [Trial(**entry) for entry in read_json(path, "trials")["trials"]]
    except TypeError as error:
        raise InputError(f"{path}: not what a worker of the search has written ({error})") from error


def export_network(folder: str | Path, features: str, model: str, calibrated: str, source: str, check: str) -> None:
    """Export a trained identifier's networks (of its first seed) to ONNX and to C99.

    Parameters
    ----------
    folder : of the identifier
    features : table on which the ONNX files are compared with torch, those of units with healthy recordings as if the
        unit were ``OFF`` above the nominal one in R, k and L
    model, calibrated : ONNX files to write, of a unit without and with healthy recordings
    source : C99 file to write, of both
    check : JSON file to write: the differences, and what one identification by the C99 takes

    Raises
    ------
    InputError : a folder without a network, or a file that cannot be written
    """
    from ..identification.c99 import write_c
    from ..identification.export import export_calibrated_onnx, export_onnx
    from ..identification.identifier import Identifier

    identifier = Identifier.load(seed_folder(folder, 0))
    if identifier.network is None:
        raise InputError(f"{folder}: holds no network to export")
    x = read_features(features).identified().inputs
    unit = (1.0 + OFF) * identifier.nominal_unit(x.shape[1])
    told = export_onnx(identifier, model, x)
    told_calibrated = export_calibrated_onnx(identifier, calibrated, x, unit)
    write_json(check, {**told, "calibrated": told_calibrated, "c99": write_c(identifier, source)})


def histories_in(estimators: Sequence[str]) -> list[str]:
    """History files of folders of estimators."""
    return [f"{folder}/{HISTORY}" for folder in estimators]


def folders(histories: Sequence[str]) -> list[Path]:
    """Folders of estimators from their history files."""
    return [Path(history).parent for history in histories]

"""Evaluation of every trained estimator on fresh rows: metrics in physical units beside the bound; the estimates."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..faults import FAULT_NAMES
from ..identification.evaluation import GROUPS, FeatureSet, evaluate, over_seeds
from ..identification.identifier import Identifier
from ..io.atomic import replace_atomically
from ..plain import read_json
from ..reconstruction.calibration import calibrate
from .bound import CALIBRATED, read_bound
from .features import FeatureTable, read_features
from .networks import HISTORY, folders, seed_folder, width_of, write_json

FEW = 10  # rows of the paper's external validation
_GAUSSIAN = np.sqrt(2.0 / np.pi)  # mean absolute value over standard deviation


def healthy_units(
    reference: FeatureTable, units: int, spec: Mapping[str, Any], identifier: Identifier
) -> tuple[np.ndarray, np.ndarray]:
    """(unit, 6) R (ohm) and k (V s/rad) of each unit at 20 degC from its healthy recordings, and their covariance.

    Of nine features (unit, 9), with L (H). The identifier tells what is known of any unit, and the noise of features
    whose reconstruction does not tell it.
    """
    actuator = ActuatorParameters(**spec["actuator"])
    options = {"ambient_error": spec["ambient_error"], "alpha_m": spec["magnet_coefficient"], "prior": identifier.prior}
    reference = replace(reference, features=identifier.with_noise(reference.features))
    width = reference.features.inputs_covariance.shape[1]
    found_unit, covariance = np.full((units, width), np.nan), np.full((units, width, width), np.nan)
    for unit, rows in enumerate(np.arange(len(reference.faults)).reshape(units, -1)):
        own = reference.rows(rows)
        if np.any(own.features.identified):
            found = calibrate(own.features, own.ambient_temperature, actuator, **options)
            found_unit[unit], covariance[unit] = found.unit, found.covariance
    return found_unit, covariance


def _identifiers(folder: Path) -> list[Identifier]:
    return [Identifier.load(seed_folder(folder, seed)) for seed in range(read_json(folder / HISTORY, "seeds")["seeds"])]


def evaluate_identification(
    histories: Sequence[str],
    fresh: Sequence[str],
    references: Sequence[str],
    bound_file: str,
    spec: Mapping[str, Any],
    metrics: str,
    estimates: str,
) -> None:
    """Evaluate all estimators of all methods.

    Parameters
    ----------
    histories : ``.../identifiers/<method>/<estimator>/history.json`` of every estimator
    fresh, references : feature tables ``<part>_<method>.nc``; references are empty unless units are calibrated
    bound_file : what ``bound.compute_bound`` wrote
    spec : the sub-tree ``config.evaluation_spec``
    metrics, estimates : files to write; estimates are those of each estimator's first seed
    """
    import xarray as xr

    tables = {Path(path).stem.removeprefix("fresh_"): read_features(path) for path in fresh}
    units = {Path(path).stem.removeprefix("reference_"): read_features(path) for path in references}
    bounds, width = read_bound(bound_file), width_of(spec["faults"])
    entries: list[dict[str, Any]] = []
    variables: dict[str, Any] = {}
    for folder in folders(histories):
        method, estimator = folder.parent.name, folder.name
        table = tables[method]
        data = FeatureSet(table.inputs, table.faults, table.covariance, bounds[spec["bounds"][method]])
        models = _identifiers(folder)
        entry: dict[str, Any] = {
            "method": method,
            "estimator": estimator,
            "seeds": len(models),
            "parameters": models[0].parameters,
            "intervals": models[0].intervals.method,
            "bound": spec["bounds"][method],
        }
        calibrations: dict[str, tuple] = {"": (None, None)}
        if method in units:
            calibrations[CALIBRATED] = healthy_units(units[method], len(table.faults), spec, models[0])
        for name, (unit, covariance) in calibrations.items():
            known = np.all(np.isfinite(data.features), axis=1)
            if unit is not None:
                known &= np.all(np.isfinite(unit), axis=1)
                unit, covariance = unit[known], _none_if_unknown(covariance[known])
            rows = replace(data, bound=bounds.get(spec["bounds"][method] + name)).rows(known)
            every = [evaluate(model, rows, width, spec["level"], unit, covariance) for model in models]
            entry[f"all{name}"] = over_seeds(every)
            entry[f"few{name}"] = over_seeds(
                _few(models[seed % len(models)], rows, width, spec["level"], unit, covariance, seed)
                for seed in range(spec["draws"])
            )
            entry["unidentified"] = int(np.sum(~known))
            value = models[0].predict(rows.features, rows.covariance, unit, covariance)
            low, high = models[0].interval(rows.features, spec["level"], rows.covariance, unit, covariance)
            for kind, values in {"value": value, "low": low, "high": high, "truth": rows.faults}.items():
                full = np.full((len(known), 6), np.nan)
                full[known] = values
                variables[f"{method}.{estimator}{name}.{kind}"] = (("run", "component"), full)
        entries.append(entry)
    shown = {name: None if b is None else _bound_means(b) for name, b in bounds.items()}
    write_json(
        metrics,
        {"level": spec["level"], "width": dict(zip(FAULT_NAMES, width.tolist())), "bound": shown, "results": entries},
    )
    data_set = xr.Dataset(variables, {"component": list(FAULT_NAMES)}, {"title": "estimates of fresh runs"})
    replace_atomically(Path(estimates), lambda temporary: data_set.to_netcdf(temporary, engine="netcdf4"))


def _none_if_unknown(covariance: np.ndarray) -> np.ndarray | None:
    return covariance if np.all(np.isfinite(covariance)) else None


def _few(model, data: FeatureSet, width: np.ndarray, level: float, unit, covariance, seed: int) -> dict[str, Any]:
    """The paper's terms: ten rows, other ones for each seed."""
    pick = np.random.default_rng([seed, 30]).choice(len(data.faults), min(FEW, len(data.faults)), replace=False)
    unit, covariance = (None if array is None else array[pick] for array in (unit, covariance))
    return evaluate(model, data.rows(pick), width, level, unit, covariance)


def _bound_means(bound: np.ndarray) -> dict[str, float]:
    """Mean absolute error at the bound by component and for N, xi and dT together."""
    means = {name: float(_GAUSSIAN * bound[j]) for j, name in enumerate(FAULT_NAMES)}
    return means | {name: float(_GAUSSIAN * np.mean(bound[list(columns)])) for name, columns in GROUPS.items()}


def summary(metrics: str | Path) -> dict[str, Any]:
    """What ``evaluate_identification`` wrote.

    Raises
    ------
    InputError : a file that cannot be read
    """
    return read_json(metrics)

"""Which estimator ``emafault identify`` uses: a trained experiment's, or the closed form where none was trained."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .. import checks, schema
from .. import config as configuration
from ..actuator.parameters import ActuatorParameters
from ..datasheet.override import override_of
from ..errors import InputError, shown
from ..identification.identifier import Identifier
from ..identification.intervals import ConformalIntervals
from ..identification.posterior import Knowledge
from ..identification.recordings import Model
from ..paths import results_folder
from ..places import kind
from ..plain import read_json, read_yaml


def load_model(
    experiment: str,
    choice: str | None = None,
    results: str | Path | None = None,
    actuator: str | None = None,
    closed_form: bool = False,
) -> Model:
    """The estimator of an experiment.

    Parameters
    ----------
    experiment : name of a trained experiment; of one that was not trained here only the closed form is had
    choice : ``reconstruction`` or ``reconstruction/estimator``; None takes the most accurate on fresh rows
    results : folder of results; None takes ``results`` here, else that of the project
    actuator : file of one's own actuator, for which only the closed form is had: it needs no training
    closed_form : where nothing is chosen take the best closed form

    Raises
    ------
    InputError : an unknown experiment, or an estimator that was not trained
    """
    if results is None:
        results = results_folder()
    elif kind(results, "--results") != "folder":
        raise InputError(f"--results: {shown(results)}: no such folder, accepted is one of results (results)")
    checks.check_name("experiment", experiment)
    folder = Path(results) / "experiments" / experiment
    trained = os.path.lexists(folder / "configuration.yaml") and actuator is None
    config = _read_configuration(folder / "configuration.yaml") if trained else _composed(experiment, actuator)
    if config.get("variants") and not trained:
        raise InputError(
            f"experiment: '{experiment}' is a study, accepted is one of its variants, {experiment}/<variant>"
        )
    methods = config["reconstruction"]
    saved = folder.glob("identifiers/*/*/history.json") if actuator is None else ()
    known = {f"{p.parent.parent.name}/{p.parent.name}" for p in saved}
    known |= {f"{name}/closed_form" for name in methods}
    name = choice or _most_accurate(None if closed_form or actuator is not None else folder, config, known)
    if "/" not in name:
        name = next((f"{name}/{e}" for e in ("searched", "network") if f"{name}/{e}" in known), f"{name}/closed_form")
    if name not in known:
        hint = (
            "" if trained else f"; '{experiment}' is not trained here, snakemake --config experiment={experiment} does"
        )
        raise InputError(f"--method: got '{shown(choice)}', accepted are {', '.join(sorted(known))}{hint}")
    reconstruction, estimator = name.split("/")
    settings = dict(methods[reconstruction])
    fitted = folder / "identifiers" / reconstruction / estimator / "seed_0"
    load = actuator is None and fitted.is_dir()
    if not load and settings["method"] == "paper":
        raise InputError(
            f"--method: '{name}' has no intervals before training; snakemake --config experiment={experiment}"
        )
    identifier = Identifier.load(fitted) if load else untrained_closed_form(config)
    return Model(name, settings.pop("method"), settings, identifier, config["sensors"]["ambient"])


def _composed(experiment: str, actuator: str | None) -> dict[str, Any]:
    """An experiment's configuration, of one's own actuator with its tolerance as what is known of R0, k0 and L0."""
    if actuator is None:
        return configuration.compose(experiment)
    config = configuration.compose(experiment, [override_of(actuator)])
    own = config["tolerances"]
    known = {**own["unit_calibration"], **own["inductance_tolerance"]}
    unit = config["unit"] | {"known": {q: known[f"{q}_scale"] for q in "RkL"}}
    return config | {"unit": unit}


def untrained_closed_form(config: Mapping[str, Any]) -> Identifier:
    """The closed form with intervals from the noise of the features alone, taken as Gaussian."""
    intervals = ConformalIntervals.gaussian("Gaussian noise of the features")
    spec = configuration.identification_spec(config)
    actuator = ActuatorParameters(**spec["actuator"])
    known = Knowledge(**spec["known"])
    return Identifier(actuator, spec["magnet_coefficient"], known.lag, intervals, known=known)


def _read_configuration(path: Path) -> dict[str, Any]:
    config = read_yaml(path)
    try:
        checks.check_trained(config)
    except InputError as error:
        raise InputError(f"{shown(path)}: {error}") from None
    return config


def _most_accurate(folder: Path | None, config: Mapping[str, Any], known: set[str]) -> str:
    """The trained estimator with the smallest error over range on fresh rows; without an evaluation the closed form."""
    path = folder / "evaluation" / "metrics.json" if folder is not None else None
    if path is None or not os.path.lexists(path):
        methods = list(config["reconstruction"])
        best = next((name for name in ("nine_heating", "nine", "weighted_floating") if name in methods), methods[-1])
        return f"{best}/closed_form"
    errors = _errors(path, read_json(path))
    return min((name for name in errors if name in known), key=lambda name: errors[name])


def _errors(path: Path, metrics: Any) -> dict[str, float]:
    """Mean error over range of each estimator, as an evaluation found it."""
    key = "results"
    try:
        schema.check(metrics, dict[str, Any], key)
        schema.check(metrics.get(key), list[dict[str, Any]], key)
        errors = {}
        for n, entry in enumerate(metrics[key]):
            for word in ("method", "estimator"):
                schema.check(entry.get(word), str, f"{key}[{n}].{word}")
            error = entry.get("all")
            for word in ("errors.mean.over_range", "mean"):
                schema.check(error, dict[str, Any], f"{key}[{n}].all")
                error = error.get(word)
            schema.check(error, float, f"{key}[{n}].all.errors.mean.over_range.mean", {"low": 0.0})
            errors[f"{entry['method']}/{entry['estimator']}"] = float(error)
        if not errors:
            schema.refuse(key, metrics[key], "a list of one estimator or more")
    except InputError as error:
        raise InputError(f"{shown(path)}: {error}") from None
    return errors

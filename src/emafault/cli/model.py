"""Which estimator ``emafault identify`` uses: a trained experiment's, or the closed form where none was trained."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .. import config as configuration
from ..actuator.parameters import ActuatorParameters
from ..errors import InputError
from ..identification.identifier import Identifier
from ..identification.intervals import ConformalIntervals
from ..identification.posterior import Knowledge
from ..identification.recordings import Model
from ..paths import results_folder


def load_model(experiment: str, choice: str | None = None, results: str | Path | None = None) -> Model:
    """The estimator of an experiment.

    Parameters
    ----------
    experiment : name of a trained experiment; of one that was not trained here only the closed form is had
    choice : ``reconstruction`` or ``reconstruction/estimator``; None takes the most accurate on fresh rows
    results : folder of results; None takes ``results`` here, else that of the project

    Raises
    ------
    InputError : an unknown experiment, or an estimator that was not trained
    """
    if results is None:
        results = results_folder()
    folder = Path(results) / "experiments" / experiment
    trained = (folder / "configuration.yaml").is_file()
    config = _read_configuration(folder / "configuration.yaml") if trained else configuration.compose(experiment)
    if config.get("variants") and not trained:
        raise InputError(
            f"experiment: '{experiment}' is a study, accepted is one of its variants, {experiment}/<variant>"
        )
    methods = config["reconstruction"]
    known = {f"{p.parent.parent.name}/{p.parent.name}" for p in folder.glob("identifiers/*/*/history.json")}
    known |= {f"{name}/closed_form" for name in methods}
    name = choice or _most_accurate(folder, config, known)
    if "/" not in name:
        name = next((f"{name}/{e}" for e in ("searched", "network") if f"{name}/{e}" in known), f"{name}/closed_form")
    if name not in known:
        hint = (
            "" if trained else f"; '{experiment}' is not trained here, snakemake --config experiment={experiment} does"
        )
        raise InputError(f"--method: got '{choice}', accepted are {', '.join(sorted(known))}{hint}")
    reconstruction, estimator = name.split("/")
    settings = dict(methods[reconstruction])
    saved = folder / "identifiers" / reconstruction / estimator / "seed_0"
    if not saved.is_dir() and settings["method"] == "paper":
        raise InputError(
            f"--method: '{name}' has no intervals before training; snakemake --config experiment={experiment}"
        )
    identifier = Identifier.load(saved) if saved.is_dir() else untrained_closed_form(config)
    return Model(name, settings.pop("method"), settings, identifier, config["sensors"]["ambient"])


def untrained_closed_form(config: Mapping[str, Any]) -> Identifier:
    """The closed form with intervals from the noise of the features alone, taken as Gaussian."""
    intervals = ConformalIntervals.gaussian("Gaussian noise of the features")
    spec = configuration.identification_spec(config)
    actuator = ActuatorParameters(**spec["actuator"])
    known = Knowledge(**spec["known"])
    return Identifier(actuator, spec["magnet_coefficient"], known.lag, intervals, known=known)


def _read_configuration(path: Path) -> dict[str, Any]:
    from omegaconf import OmegaConf

    try:
        config = OmegaConf.to_container(OmegaConf.load(path))
    except Exception as error:  # whatever the YAML reader raises
        raise InputError(f"{path}: not a readable configuration ({' '.join(str(error).split())})") from error
    if not isinstance(config, dict) or "reconstruction" not in config:
        raise InputError(f"{path}: not the configuration of an experiment")
    return {str(key): value for key, value in config.items()}


def _most_accurate(folder: Path, config: Mapping[str, Any], known: set[str]) -> str:
    """The trained estimator with the smallest error over range on fresh rows; without an evaluation the closed form."""
    try:
        results = json.loads((folder / "evaluation" / "metrics.json").read_text())["results"]
        errors = {f"{r['method']}/{r['estimator']}": r["all"]["errors.mean.over_range"]["mean"] for r in results}
        return min((name for name in errors if name in known), key=lambda name: errors[name])
    except (OSError, ValueError, KeyError):
        methods = list(config["reconstruction"])
        best = next((name for name in ("nine", "weighted_floating") if name in methods), methods[-1])
        return f"{best}/closed_form"

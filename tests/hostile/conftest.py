"""Whole things that the entries of the corpus damage (recordings, a bench, a trained experiment); how a line is run."""

import contextlib
import hashlib
import io
import os
import shutil
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from emafault import closed_form, config
from emafault.cli import main
from emafault.config import composition, draws, separate
from emafault.identification.fitting import Prior, Recipe, fit_identifier
from emafault.identification.posterior import Knowledge
from emafault.identification.rows import TrainingRows
from emafault.identification.settings import NetworkSettings, TrainingSettings
from emafault.paths import CONF
from emafault.study.networks import seed_folder, write_json, write_yaml

SHORT = ("recording.duration=0.3", "recording.discard=0.05")
TRAINED = Path("results") / "experiments" / "paper"


@dataclass(frozen=True)
class Said:
    """What a command line ended with; ``lines`` stood on the standard error stream."""

    code: int
    lines: list[str]
    printed: str


def say(words: list[str]) -> Said:
    """Run a command line in this process."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            code = main(words)
        except SystemExit as end:  # how argparse ends
            code = end.code if isinstance(end.code, int) else 1
    return Said(code, err.getvalue().splitlines(), out.getvalue())


def state(folder: Path) -> dict[str, str]:
    """Every path below a folder with what stands there, so that two states can be compared."""
    found = {}
    for path in sorted(folder.rglob("*")):
        name = str(path.relative_to(folder))
        if path.is_symlink():
            found[name] = f"link to {os.readlink(path)}"
        elif path.is_file():
            found[name] = hashlib.sha256(path.read_bytes()).hexdigest()
        else:
            found[name] = "folder" if path.is_dir() else "device"
    return found


@pytest.fixture(scope="session")
def whole(tmp_path_factory) -> Path:
    """A folder with ``good.nc``, ``healthy.nc``, the folder ``bench`` and results of a trained experiment ``paper``."""
    folder = tmp_path_factory.mktemp("whole")
    for name, fault in {"good": ["Na=0.05", "dT=30"], "healthy": ["dT=5"]}.items():
        assert say(["simulate", str(folder / f"{name}.nc"), *SHORT, "--fault", *fault]).code == 0
    (folder / "bench").mkdir()
    for name in ("good", "healthy"):
        shutil.copy(folder / f"{name}.nc", folder / "bench" / f"{name}.nc")
    shutil.copytree(CONF, folder / "conf")
    _train(folder / TRAINED)
    return folder


def _train(folder: Path) -> None:
    """An experiment with one trained network, as the workflow leaves it."""
    composed = config.compose()
    spec = config.identification_spec(composed)
    rng = np.random.default_rng(1)
    faults = np.concatenate([rng.uniform(0, 0.1, (60, 3)), rng.uniform(-0.1, 0.1, (60, 3))], axis=1)
    faults[:, 5] *= 300.0
    actuator = config.reference_actuator()
    features = np.concatenate(closed_form.forward(faults, actuator, 0.0, faults[:, 5]), axis=1)
    network = NetworkSettings.of({**composed["network"], "width": 3})
    training = TrainingSettings.of({**composed["training"], "epochs": 5})
    prior = Prior(actuator, spec["magnet_coefficient"], Knowledge(lag=spec["known"]["lag"]))
    fit = fit_identifier(TrainingRows(features, faults), prior, Recipe(network, training))
    estimator = folder / "identifiers" / "weighted" / "network"
    fit.identifier.save(seed_folder(estimator, 0))
    write_json(estimator / "history.json", {"seeds": 1, "curves": []})
    write_yaml(folder / "configuration.yaml", composed)
    of = {"errors.mean.over_range": {"mean": 0.01}}
    write_json(
        folder / "evaluation" / "metrics.json",
        {"results": [{"method": "weighted", "estimator": "network", "all": of}]},
    )


@pytest.fixture
def workshop(whole, tmp_path, monkeypatch) -> Path:
    """A copy of the whole things that a test may damage; the working folder."""
    folder = tmp_path / "workshop"
    shutil.copytree(whole, folder, ignore=shutil.ignore_patterns("conf"))
    monkeypatch.chdir(folder)
    for reads in (composition, draws, separate):
        monkeypatch.setattr(reads, "CONF", whole / "conf")  # what a test breaks here breaks no checkout
    return folder

"""A copy of the project of its own, to run the workflow and the command in."""

import os
import shutil
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
#: a study of every stage but the search, small; its results are the same bits in every run
SMALL = ("--config", "experiment=smoke", "overrides=search=none sampling.runs=60 evaluation.seeds=1 training.epochs=30")
PARTS = ("workflow", "profiles", "conf", "src", "data")
#: folders of what was said and when, and of runs, which have times and numbers of their own
NOT_RESULTS = ("logs", "benchmarks", "mlflow_artifacts", "diagnoses")


def build(folder: Path, root: Path = ROOT) -> Path:
    """Copy what the workflow needs, without results, of the project or of another copy."""
    for part in PARTS:
        shutil.copytree(root / part, folder / part, ignore=shutil.ignore_patterns("__pycache__", "*.egg-info"))
    shutil.copy(root / "Snakefile", folder)
    return folder


def environment(house: Path, **more: str) -> dict[str, str]:
    """The copy's own package, not the installed one; compiled code is cached beside it."""
    own = {"PYTHONPATH": str(house / "src"), "NUMBA_CACHE_DIR": str(house / "compiled"), "OMP_NUM_THREADS": "1"}
    return {**os.environ, **own, **more}


def snakemake(*arguments: str, cores: str = "2") -> list[str]:
    """The command that runs the workflow."""
    return [sys.executable, "-m", "snakemake", "--cores", cores, "--quiet=all", *arguments]

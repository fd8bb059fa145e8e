"""The table of methods by experiments: both bounds beside every error, and what is not as it should be told."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from emafault.errors import InputError
from emafault.study.methods import markdown, rows_of

ROOT = Path(__file__).resolve().parents[2]


def entry(method: str, bound: str, dT: float, cover: float, **kinds: float) -> dict:
    """An entry of an evaluation; ``kinds`` are further ones with their error of dT (K)."""

    def of(error: float) -> dict:
        values = {"rows": 1000.0, "coverage.mean": cover, "errors.N.mae": 1e-3, "errors.xi.mae": 2e-3}
        return {key: {"mean": value} for key, value in (values | {"errors.dT.mae": error}).items()}

    kept = {f"all_{kind}": of(error) for kind, error in kinds.items()}
    return {"method": method, "estimator": "closed_form", "bound": bound, "parameters": 0, "all": of(dT)} | kept


@pytest.fixture
def results(tmp_path) -> Path:
    bound = {
        "floating": {"dT": 0.25, "N": 1e-3, "xi": 2e-3},
        "recording": {"dT": 0.2, "N": 5e-4, "xi": 1e-3},
        "heating": {"dT": 0.4, "N": 5e-4, "xi": 1e-3},
        "floating_calibrated": {"dT": 0.5, "N": 1e-3, "xi": 2e-3},
        "recording_calibrated": {"dT": 0.4, "N": 1e-3, "xi": 2e-3},
    }
    entries = {
        "first": [entry("nine", "recording", 0.15, 0.9), entry("nine_heating", "heating", 0.4, 0.95)],
        "study/variant": [entry("weighted", "plateau", 0.5, 0.9, calibrated=0.6)],
        "study/turning": [entry("weighted", "plateau", 0.5, 0.9)],
    }
    for name, of in entries.items():
        own = {key: None for key in bound} if name == "study/turning" else bound
        path = tmp_path / "experiments" / name / "evaluation" / "metrics.json"
        path.parent.mkdir(parents=True)
        path.write_text(json.dumps({"results": of, "level": 0.9, "bound": own}))
    bounds = {"six": {"dT": 0.2, "N": 1e-3, "xi": 1e-3}, "nine": {"dT": 0.1, "N": 5e-4, "xi": 5e-4}}
    several = [
        {"experiment": "first", "features": features, "count": 4, "units": 10, "errors": bounds[features],
         "bound": bounds[features], "coverage": 0.9}
        for features in ("six", "nine")
    ]  # fmt: skip
    (tmp_path / "several_recordings").mkdir()
    (tmp_path / "several_recordings" / "errors.json").write_text(json.dumps(several))
    return tmp_path


def test_both_bounds_stand_beside_every_error(results):
    text = "\n".join(markdown(rows_of(results)))
    for row in (
        "| `first` | nine, closed form | 0 | 1000 | 0.150, 0.00100, 0.00200 | 0.75, 2.00, 2.00 | 0.60, 1.00, 1.00 |",
        "0.400, 0.00100, 0.00200 | 1.00, 2.00, 2.00 | 1.60, 1.00, 1.00 | 0.950 |",  # beside its own bound
        "calibrated | 0 | 1000 | 0.600, 0.00100, 0.00200 | 1.50, 1.00, 1.00 | 1.20, 1.00, 1.00 |",
        "`study/turning` | weighted, closed form | 0 | 1000 | 0.500, 0.00100, 0.00200 | none holds | none holds |",
        "first, 4` | six features, closed form together | 0 | 40 | 0.200, 0.00100, 0.00100 | 2.00, 2.00, 2.00 |",
        "6 of 7 rows cover as they should",
        "first: nine heating, closed form covers 0.950, by more than chance (0.028, 1000 runs)",
    ):
        assert row in text
    few = [replace(row, runs=200) for row in rows_of(results)]
    assert "covers 0.950, no more than by chance (0.064, 200 runs)" in "\n".join(markdown(few))
    below = [line.strip() for line in text.splitlines() if "below" in line]
    assert below == ["first: nine, closed form is below its bound in dT"]


def test_some_experiments_alone_and_those_that_there_are_not(results):
    assert {row.experiment for row in rows_of(results, ["study"])} == {"study/variant", "study/turning"}
    assert {row.experiment for row in rows_of(results, ["study/variant"])} == {"study/variant"}
    with pytest.raises(InputError, match=r"nowhere: was not evaluated in .*, accepted are first, several_recordings"):
        rows_of(results, ["nowhere"])
    command = [sys.executable, str(ROOT / "benchmarks/methods.py"), "--results", str(results / "none")]
    said = subprocess.run(command, capture_output=True, text=True)
    assert said.returncode == 1 and "holds no evaluated experiment" in said.stderr and "Traceback" not in said.stderr

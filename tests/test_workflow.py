"""The workflow run for real: the smoke study killed and resumed, a rerun that does nothing, overrides, bad input.

All of it happens in one copy of the repository, in the order of this file.
"""

import json
import os
import re
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
SMOKE = ["--config", "experiment=smoke"]
pytestmark = pytest.mark.workflow


@pytest.fixture(scope="module")
def house(tmp_path_factory):
    """A copy of what the workflow needs, without results."""
    folder = tmp_path_factory.mktemp("house")
    ignore = shutil.ignore_patterns("__pycache__", "*.egg-info")
    for name in ("workflow", "profiles", "conf", "src", "data"):
        shutil.copytree(ROOT / name, folder / name, ignore=ignore)
    shutil.copy(ROOT / "Snakefile", folder)
    return folder


def _environment(house):
    # the copy's own package, not the installed one; compiled code is cached beside it
    own = {"PYTHONPATH": str(house / "src"), "NUMBA_CACHE_DIR": str(house / "compiled"), "OMP_NUM_THREADS": "1"}
    return {**os.environ, **own}


def _command(*arguments):
    return [sys.executable, "-m", "snakemake", "--cores", "2", *arguments]


def _snakemake(house, *arguments):
    return subprocess.run(
        _command(*arguments), cwd=house, env=_environment(house), capture_output=True, text=True, timeout=400
    )


def _planned(house, *arguments):
    """Rules that a dry run would run, with how many jobs each."""
    run = _snakemake(house, "--dry-run", *arguments)
    assert run.returncode == 0, run.stderr
    text = run.stdout + run.stderr
    table = text.split("Job stats:")[1].split("total")[0] if "Job stats:" in text else ""
    counts = {name: int(count) for name, count in re.findall(r"^(\w+) +(\d+)$", table, re.M)}
    counts.pop("study", None)
    return counts


def _state(house):
    """Modification time of every result."""
    return {p: p.stat().st_mtime_ns for p in (house / "results").rglob("*") if p.is_file() and p.suffix == ".nc"}


def test_a_killed_run_leaves_no_half_file_and_resumes(house):
    log = open(house / "killed.log", "w")
    process = subprocess.Popen(
        _command(*SMOKE), cwd=house, env=_environment(house), stdout=log, stderr=log, start_new_session=True
    )
    deadline = time.monotonic() + 240.0
    while len(list((house / "results").rglob("shard_*.nc"))) < 3:
        assert process.poll() is None and time.monotonic() < deadline, (house / "killed.log").read_text()
        time.sleep(0.1)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    finished = {p: t for p, t in _state(house).items() if p.name.startswith("shard_")}
    for path in finished:
        with open(path, "rb") as file:
            assert file.read(4) == b"\x89HDF"

    run = _snakemake(house, *SMOKE)
    assert run.returncode == 0, run.stderr[-3000:]
    after = _state(house)
    # all but the ones that were being written when it was killed are taken over
    assert sum(after[path] == made for path, made in finished.items()) >= len(finished) - 2
    assert not list((house / "results").rglob(".*.part"))


def test_the_study_leaves_its_results_and_its_report(house):
    experiment = house / "results" / "experiments" / "smoke"
    report = (experiment / "report.html").read_text()
    for figure in ("figure_2", "figure_3", "figure_6", "figure_7", "figure_9", "errors", "learning_curves", "search"):
        assert f'id="{figure}' in report
    assert "http" not in re.sub(r"https?://[\w.:/]*(doi|localhost)", "", report.split("<h2>What this rests on")[0])
    metrics = json.loads((experiment / "evaluation" / "metrics.json").read_text())
    found = {(r["method"], r["estimator"]): r["all"] for r in metrics["results"]}
    assert found["weighted_floating", "closed_form"]["errors.dT.mae"]["mean"] < 0.5
    assert found["paper", "network"]["errors.dT.mae"]["mean"] > 1.0
    check = json.loads((experiment / "export" / "check.json").read_text())
    assert check["against_torch"] < 1e-4 and check["calibrated"]["against_torch"] < 1e-4
    assert "duration: 1.0" in (experiment / "configuration.yaml").read_text()


def test_the_evaluation_is_tracked_with_its_trials_below(house):
    tracked = json.loads((house / "results" / "experiments" / "smoke" / "tracked.json").read_text())
    with sqlite3.connect(house / "results" / "mlflow.db") as database:
        runs = dict(database.execute("select run_uuid, name from runs where status = 'FINISHED'").fetchall())
        children = database.execute(
            "select count(*) from tags where key = 'mlflow.parentRunId' and value = ?", (tracked["run_id"],)
        ).fetchone()[0]
        metrics = dict(
            database.execute(
                "select key, value from latest_metrics where run_uuid = ?", (tracked["run_id"],)
            ).fetchall()
        )
    assert runs[tracked["run_id"]] == "smoke" and children == 6
    assert metrics["error_dT_K"] < 0.5 < 1.0 < metrics["paper_dT_K"] and len(metrics) <= 20
    artifacts = house / "results" / "mlflow_artifacts" / tracked["run_id"] / "artifacts"
    assert (artifacts / "model" / "network_calibrated.onnx").is_file()
    assert (artifacts / "model" / "network.onnx").is_file() and (artifacts / "figures" / "figure_2.png").is_file()
    table = json.loads((artifacts / "tables" / "metrics.json").read_text())
    assert ["weighted_floating", "closed_form", "all", "errors.dT.mae"] in [row[:4] for row in table["data"]]
    assert list((artifacts.parents[1] / "models").rglob("MLmodel"))


def test_a_rerun_does_nothing(house):
    before = _state(house)
    run = _snakemake(house, *SMOKE)
    assert run.returncode == 0 and "Nothing to be done" in run.stdout + run.stderr
    assert _state(house) == before


@pytest.mark.parametrize(
    ("override", "must", "must_not"),
    [
        (
            "evaluation.level=0.8",
            {"evaluate_identification", "draw_report", "track_evaluation", "write_configuration"},
            {"simulate_shard", "reconstruct_features", "train_identifier", "search_network", "compute_bound"},
        ),
        (
            "network.width=8",
            {"train_identifier", "search_network", "evaluate_identification"},
            {"simulate_shard", "reconstruct_features", "compute_bound", "simulate_examples"},
        ),
        (
            "reconstruction.weighted.margin=4",
            {"reconstruct_features", "train_identifier"},
            {"simulate_shard", "search_network", "compute_bound"},
        ),
        ("sensors.voltage=0.1", {"simulate_shard", "reconstruct_features", "compute_bound"}, {"compile_simulation"}),
        ("tracking.experiment=other", {"prepare_tracking", "track_evaluation"}, {"evaluate_identification"}),
    ],
)
def test_an_override_reruns_only_what_reads_it(house, override, must, must_not):
    planned = _planned(house, *SMOKE, f"overrides={override}")
    assert must <= planned.keys() and not must_not & planned.keys(), planned
    if override.startswith("network"):
        assert planned["train_identifier"] == 4  # three networks and the searched one, no closed form
    if override.startswith("reconstruction"):
        assert planned["reconstruct_features"] == 2


def test_of_many_runs_each_seed_is_a_job(house):
    planned = _planned(house, *SMOKE, "overrides=sampling.shards=6")
    assert planned["train_seed"] == 8 and planned["train_identifier"] == 7  # two seeds of three networks and one more


def test_another_experiment_stands_beside_and_shares_what_is_equal(house):
    planned = _planned(house, "--config", "experiment=smoke", "overrides=name=mine dataset=smoke training.epochs=50")
    assert "simulate_shard" not in planned and planned["train_identifier"] == 7


@pytest.mark.parametrize(
    ("experiment", "folder", "exported"),
    [
        (["experiment=nine_features"], "nine_features", "nine/searched"),
        (["experiment=nine_features", "overrides=search=none"], "nine_features", "nine/network"),
        (["experiment=filters"], "filters/average_of_2", "nine/network"),
        (["experiment=paper", "overrides=search=none reconstruction=[paper,weighted]"], "paper", "weighted/network"),
    ],
)
def test_the_network_of_the_features_that_an_experiment_is_about_is_exported(house, experiment, folder, exported):
    target = f"results/experiments/{folder}/export/check.json"
    run = _snakemake(house, "--dry-run", "--config", *experiment, "--", target)
    rule = (run.stdout + run.stderr).split("rule export_network:")[1].split("output:")[0]
    assert run.returncode == 0 and f"results/experiments/{folder}/identifiers/{exported}" in rule


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["experiment=nothing"], "experiment: got 'nothing'"),
        (["experimnt=smoke"], "experimnt: there is no such key (did you mean experiment?)"),
        (["experiment=smoke", "overrides=faults.dT.hig=90"], "faults.dT.hig"),
        (["experiment=smoke", "overrides=faults.dT.high=900"], "faults.dT.high: got 900"),
    ],
)
def test_bad_configuration_is_refused_before_anything_runs(house, arguments, says):
    before = _state(house)
    run = _snakemake(house, "--config", *arguments)
    said = [line for line in run.stderr.splitlines() if line.startswith("emafault:")]
    assert run.returncode != 0 and len(said) == 1 and says in said[0]
    assert "Traceback" not in run.stderr and _state(house) == before


def test_a_damaged_shard_is_named_and_nothing_made_is_lost(house):
    shard = house / "results" / "datasets" / "smoke" / "fresh" / "shard_1.nc"
    whole = shard.read_bytes()
    before = _state(house)
    shard.write_bytes(whole[: len(whole) // 3])
    run = _snakemake(house, *SMOKE)
    assert run.returncode != 0
    said = [line for line in run.stderr.splitlines() if line.startswith("emafault:")]
    assert any(str(shard.relative_to(house)) in line for line in said) and "Traceback" not in run.stderr
    kept = _state(house)
    assert all(kept[path] == made for path, made in before.items() if "datasets" in path.parts and path != shard)
    shard.unlink()  # the remedy: what is missing is made again
    planned = _planned(house, *SMOKE)
    assert planned["simulate_shard"] == 1


def test_results_that_cannot_be_written_are_refused(house, tmp_path):
    shutil.copytree(house, tmp_path / "house", ignore=shutil.ignore_patterns("results", ".snakemake", "compiled"))
    (tmp_path / "house" / "results").write_text("a file")
    run = _snakemake(tmp_path / "house", *SMOKE)
    said = [line for line in run.stderr.splitlines() if line.startswith("emafault:")]
    assert run.returncode != 0 and len(said) == 1 and "results: is not a folder" in said[0]
    assert (tmp_path / "house" / "results").read_text() == "a file"


def test_the_withheld_check_makes_diagnoses_and_scores_blind_cases(house):
    run = _snakemake(house, "withheld_smallest", *SMOKE)
    assert run.returncode == 0, run.stderr[-2000:]
    folder = house / "results" / "withheld" / "smallest"
    scores = json.loads((folder / "scores.json").read_text())
    assert sorted(r["rung"] for r in scores["rows"]) == ["T1", "T3"] and scores["missing"] == []
    told = [r["fault_vector"] for r in scores["rows"] if r["rung"] == "T1" and r["fault_vector"]]
    assert all(f["oracle"] is not None for f in told) and list(folder.rglob("oracles/*/diagnosis.json"))
    assert (folder / "scoreboard.html").stat().st_size > 10_000
    # the recordings are gone once diagnosed, and the keys never stood beside them
    assert not list(folder.rglob("recording_*.nc"))


def test_the_probabilities_are_checked_on_ones_own_actuator_and_a_diagnosis_cites_that(house):
    shutil.copy(ROOT / "examples" / "actuators" / "hinge_28v.yaml", house / "mine.yaml")
    shutil.copytree(ROOT / "examples" / "bench", house / "bench")
    few = {"cases": {"T0": 1}, "first_seed": 40000, "batch": 1, "measured": False}
    (house / "conf" / "withheld" / "own.yaml").write_text(json.dumps(few))
    own = ["--config", "experiment=smoke", "overrides=actuator=mine.yaml"]
    run = _snakemake(house, "calibration", *own)
    assert run.returncode == 0, run.stderr[-2000:]
    said = run.stdout + run.stderr
    first, last = (said.index(f"calibration of hinge actuator, 28 V: {w}") for w in ("1 of T0 at", "stated"))
    assert first < last and "min on one core" in said
    path = house / "results" / "calibration" / "mine" / "calibration.json"
    found = json.loads(path.read_text())
    assert found["cases"] == 1 and found["actuator"]["parameters"]["gear_ratio"] == 120
    assert (path.parent / "calibration.html").stat().st_size > 10_000
    assert _planned(house, "calibration", *own) == {}
    # a diagnosis of another actuator refuses it
    run = _snakemake(house, "diagnose", "--config", "bench=bench", f"calibration={path}")
    assert run.returncode != 0 and "is the check of another actuator, pole_pairs 7; accepted is about 4" in run.stderr


def test_the_check_of_the_evidence_leaves_its_page(house):
    small = {"draws": 2, "samples": 19, "seed": 1, "benches": [2000000], "recordings": 2}
    (house / "conf" / "evidence.yaml").write_text(json.dumps(small))
    run = _snakemake(house, "evidence", *SMOKE)
    assert run.returncode == 0, run.stderr[-2000:]
    folder = house / "results" / "evidence"
    assert json.loads((folder / "scores.json").read_text())["library"]["draws"] == 2
    assert 'id="library_ranks"' in (folder / "report.html").read_text()

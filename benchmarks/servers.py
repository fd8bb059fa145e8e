"""Two studies at once that log to one MLflow server and keep their searches in one PostgreSQL database.

    python benchmarks/servers.py

PostgreSQL (Debian's package ``postgresql``) and ``mlflow server`` are started, empty, and gone at the end. Each study
runs in a working folder of its own; afterwards its results are compared with those of the same study alone with a
journal and SQLite, and the server is asked for its run. Needs ``pip install ".[postgres]"``.
"""

import contextlib
import json
import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from urllib.error import URLError
from urllib.request import urlopen

from house import ROOT, build, environment, snakemake
from kills import of_the_study, plain

sys.path.insert(0, str(ROOT))
from tests.databases.postgres import programs, server

TRIALS = 5
SMALL = f"sampling.runs=60 evaluation.seeds=1 training.epochs=30 search.workers=1 search.trials={TRIALS}"
#: name of a study -> what it has of its own, so that each has a search of its own
STUDIES = {"one": "", "two": "sampling.seed=7"}
LONGEST = 1200.0  # s


@contextlib.contextmanager
def mlflow_server(database: str, folder: Path) -> Iterator[str]:
    """An MLflow server that keeps its runs in a database and their artifacts in a folder; its address."""
    from emafault.databases import with_driver

    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    address = f"http://127.0.0.1:{port}"
    command = [sys.executable, "-m", "mlflow", "server", "--host", "127.0.0.1", "--port", str(port), "--workers", "2"]
    command += ["--backend-store-uri", with_driver(database), "--artifacts-destination", str(folder / "artifacts")]
    with open(folder / "mlflow.log", "w") as log:
        process = subprocess.Popen(
            command, stdout=log, stderr=log, cwd=folder, env=os.environ | {"MLFLOW_DISABLE_TELEMETRY": "true"}
        )
        try:
            deadline = time.monotonic() + 180.0
            while not _answers(address):
                assert process.poll() is None and time.monotonic() < deadline, (folder / "mlflow.log").read_text()
                time.sleep(0.5)
            yield address
        finally:
            process.terminate()
            process.wait(timeout=60)


def _answers(address: str) -> bool:
    try:
        return urlopen(f"{address}/health", timeout=5).status == 200
    except (URLError, OSError):
        return False


def start(top: Path, name: str, own: str, settings: str = "") -> subprocess.Popen:
    """Start a study in a folder of its own, on one core."""
    package = top / "package"  # one for all, so that the simulation is compiled once
    house = build(top / (name if settings else f"{name}_alone"), package)
    arguments = ("--config", "experiment=smoke", f"overrides={SMALL} {own} {settings}")
    log = open(house / "said.log", "w")
    command = snakemake(*arguments, cores="1")
    return subprocess.Popen(command, cwd=house, env=environment(package), stdout=log, stderr=log)


def ended(process: subprocess.Popen, house: Path) -> None:
    """Wait for a study, which must come to its end."""
    code = process.wait(timeout=LONGEST)
    said = (house / "said.log").read_text()
    assert code == 0, said[-4000:]


def results(house: Path) -> dict[str, bytes]:
    """What a study made, without times, numbers of runs and the addresses of servers."""
    files = [p for p in (house / "results").rglob("*") if p.is_file() and of_the_study(p)]
    return {str(p.relative_to(house)): plain(p) for p in files if p.name != "configuration.yaml"}


def same(alone: Path, together: Path) -> str:
    """How many results are the same bits."""
    expected, got = results(alone), results(together)
    different = [n for n in expected | got if expected.get(n) != got.get(n)]
    assert not different, f"differ: {different}"
    return f"{len(got)} results the same bits as alone"


def logged(address: str, house: Path) -> str:
    """What the server knows of the run of a study."""
    from mlflow import MlflowClient

    client = MlflowClient(address)
    written = json.loads((house / "results" / "experiments" / "smoke" / "tracked.json").read_text())
    run = client.get_run(written["run_id"])
    children = client.search_runs(
        [run.info.experiment_id], f"tags.`mlflow.parentRunId` = '{written['run_id']}'", max_results=100
    )
    artifacts = [entry.path for entry in client.list_artifacts(written["run_id"])]
    assert run.info.status == "FINISHED" and "report.html" in artifacts, (run.info.status, artifacts)
    metrics = json.loads((house / "results/experiments/smoke/evaluation/metrics.json").read_text())
    errors = [entry["all"]["errors.dT.mae"]["mean"] for entry in metrics["results"]]
    assert min(abs(run.data.metrics["error_dT_K"] - e) for e in errors) < 1e-9, run.data.metrics
    assert {child.info.status for child in children} == {"FINISHED"}, children
    return f"its run, {len(children)} trials below it, {len(artifacts)} kinds of artifacts"


def main() -> None:
    if programs() is None:
        raise SystemExit("PostgreSQL is not installed: apt-get install postgresql")
    with tempfile.TemporaryDirectory() as name, server() as postgresql:
        top = Path(name)
        build(top / "package")
        for study, own in STUDIES.items():  # one after the other, to compile once
            ended(start(top, study, own), top / f"{study}_alone")
            print(f"{study} alone, with a journal and SQLite", flush=True)
        # two databases that every server of PostgreSQL has from the start
        with mlflow_server(f"{postgresql}/postgres", top) as address:
            settings = f"tracking.uri={address} search.storage={postgresql}/template1"
            begun = time.monotonic()
            running = {study: start(top, study, own, settings) for study, own in STUDIES.items()}
            for study, process in running.items():
                ended(process, top / study)
            print(f"{' and '.join(STUDIES)} at once: {time.monotonic() - begun:.0f} s", flush=True)
            for study in STUDIES:
                print(
                    f"{study}: {same(top / f'{study}_alone', top / study)}; {logged(address, top / study)}", flush=True
                )


if __name__ == "__main__":
    main()

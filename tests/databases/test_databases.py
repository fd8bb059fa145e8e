"""Databases that several processes open at once while they do not exist yet: SQLite, and a real PostgreSQL."""

import os
import subprocess
import sys
import time

import pytest

from emafault.databases import with_driver, without_password

from .postgres import programs, server

TOGETHER = """
import os, sys, time
import optuna, sqlalchemy, optuna.storages
from emafault.identification.search import open_study
address, count = sys.argv[1], int(sys.argv[2])
if count < 0:
    from emafault.tracking import Entry, log_run
    import mlflow
begin, children = time.time() + 0.3, []
for n in range(abs(count)):
    if (pid := os.fork()) == 0:
        time.sleep(max(0.0, begin - time.time()))
        if count < 0:
            log_run(address, "together", Entry(f"run {n}", metrics={"error": 0.5}))
        else:
            study = open_study(address, "together")
            study.tell(study.ask(), (0.5, n))
        os._exit(0)
    children.append(pid)
print(sum(os.waitpid(pid, 0)[1] == 0 for pid in children))
"""


@pytest.fixture(scope="module")
def postgresql():
    if programs() is None:
        pytest.skip("PostgreSQL is not installed (Debian's package postgresql)")
    with server() as address:
        yield address


def together(address, count):
    """How many of so many processes did what they were to do; of minus so many with MLflow instead of Optuna."""
    ran = subprocess.run(
        [sys.executable, "-c", TOGETHER, address, str(count)],
        env=os.environ | {"OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert ran.stdout, ran.stderr[-3000:]
    return int(ran.stdout.split()[-1]), ran.stderr[-3000:]


def trials(address):
    from emafault.identification.search import open_study

    return [t.values[1] for t in open_study(address, "together").get_trials()]


def test_six_processes_open_a_fresh_search_database_at_once(tmp_path):
    address = f"sqlite:///{tmp_path}/search.db"
    done, said = together(address, 6)
    assert done == 6, said
    assert sorted(trials(address)) == [0, 1, 2, 3, 4, 5]


def test_six_processes_open_a_fresh_search_on_postgresql(postgresql):
    done, said = together(f"{postgresql}/postgres", 6)
    assert done == 6, said
    assert sorted(trials(f"{postgresql}/postgres")) == [0, 1, 2, 3, 4, 5]


def test_two_studies_log_to_fresh_databases_at_once(postgresql):
    address = f"{postgresql}/template1"
    done, said = together(address, -2)
    assert done == 2, said


def test_a_database_of_runs_whose_creation_is_killed_is_created_again(tmp_path):
    address = f"sqlite:///{tmp_path}/runs.db"
    code = "import sys; from emafault.tracking import ensure_experiment; ensure_experiment(sys.argv[1], 'one')"
    process = subprocess.Popen([sys.executable, "-c", code, address])
    deadline = time.monotonic() + 60.0
    while not list(tmp_path.glob(".runs.db.*.part")):  # its tables are being made
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.01)
    process.kill()
    process.wait()
    assert not (tmp_path / "runs.db").exists()
    subprocess.run([sys.executable, "-c", code, address], check=True)
    assert sorted(p.name for p in tmp_path.iterdir()) == [".runs.db.lock", "runs.db"]


def test_an_address_gets_the_driver_that_is_installed_and_loses_its_password():
    assert with_driver("postgresql://u:p@h/d") == "postgresql+psycopg://u:p@h/d"
    assert with_driver("postgresql+psycopg2://h/d") == "postgresql+psycopg2://h/d"
    assert with_driver("sqlite:///x.db") == "sqlite:///x.db"
    assert without_password("postgresql://u:secret@h/d") == "postgresql://u:***@h/d"
    assert without_password("sqlite:///x.db") == "sqlite:///x.db" and without_password("://") == "://"

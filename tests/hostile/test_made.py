"""What was made stays, what was found is told, and names stay names."""

import contextlib
import json
import resource
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from emafault import config
from emafault.equations.handover import experiment_text
from emafault.errors import InputError
from emafault.identification.search import open_study
from emafault.io.atomic import write_text
from emafault.plain import read_yaml
from emafault.tracking import ensure_experiment
from machines import line

from .conftest import say, state

MINE = Path(line.__file__)
ODD = 'a\nname: other ${oc.env:HOME} \\${x} <b>&"{case}'


@contextlib.contextmanager
def full_disk() -> Iterator[None]:
    """No file grows beyond a few bytes, as on a full disk."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (16, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.fixture
def machine(workshop):
    """A machine of one's own, and a table that it reads."""
    shutil.copy(MINE, workshop / "mine.py")
    arrays = line.recorded()
    line.write(workshop / "unit.csv", arrays | {"v": arrays["v"] + 0.8})
    return workshop


def diagnose(*more: str):
    return say(["diagnose", "unit.csv", "--twin", "mine.py", "--out", "out", "--no-tracking", *more])


def test_estimates_are_printed_though_they_cannot_be_written(workshop):
    before = state(workshop)
    identify = ["identify", "good.nc", "--experiment", "smoke"]
    say(identify)  # what is compiled is kept on a disk, too
    with full_disk():
        said = say([*identify, "--json", "a.json"])
    assert said.code == 2 and "good.nc" in said.printed and "dT" in said.printed
    assert len(said.lines) == 1 and "a.json: cannot be written" in said.lines[0]
    assert state(workshop) == before


def test_a_verdict_is_printed_though_it_cannot_be_written(machine):
    assert diagnose("--out", "compiled").code == 0  # on a disk that has room
    with full_disk():
        said = diagnose()
    assert said.code == 2 and "Constant drop" in said.printed
    assert len(said.lines) == 1 and "out/report.html: cannot be written" in said.lines[0]
    assert not list((machine / "out").glob("*"))


def test_a_diagnosis_updates_its_own_results_and_no_other_ones(machine):
    assert diagnose().code == 0 and diagnose().code == 0
    verdict = (machine / "out" / "diagnosis.json").read_text()
    (machine / "unit.csv").rename(machine / "other.csv")
    (machine / "unit.csv").mkdir()  # a name that is free to be anything
    other = ["diagnose", "other.csv", "--twin", "mine.py", "--out", "out", "--no-tracking"]
    said = say(other)
    assert said.code == 2 and "--force" in said.lines[0]
    assert (machine / "out" / "diagnosis.json").read_text() == verdict
    assert say([*other, "--force"]).code == 0
    assert json.loads((machine / "out" / "diagnosis.json").read_text())["bench"] == "other"


def test_cases_whose_names_are_alike_or_odd_have_a_folder_and_a_safe_line_each(machine):
    (machine / "bench").rename(machine / "aside")
    (machine / "bench").mkdir()
    for name in ("a b", "a_b", "<b>x", "${x}{y}"):
        shutil.copy(machine / "unit.csv", machine / "bench" / f"{name}.csv")
    said = say(["diagnose", "bench", "--twin", "mine.py", "--out", "out", "--no-tracking"])
    assert said.code == 0, said.lines
    assert len(list((machine / "out").glob("*/diagnosis.json"))) == 4
    page = (machine / "out" / "report.html").read_text()
    assert "<b>" not in page and "&lt;b&gt;x" in page


def test_a_bench_s_name_stays_text_in_the_experiment_that_hands_its_fix_over(tmp_path):
    which = [{"effects": ["stribeck"], "probability": 1.0}]
    verdict = {"bench": ODD, "verdict": "explained", "which": which, "discovered": [], "controller": {}}
    verdict["digest"] = "0" * 64
    path = tmp_path / "fix.yaml"
    path.write_text(experiment_text(verdict, {"stribeck": {"a": 0.01, "w_s": 5.0}}, "diagnosed_odd"))
    assert read_yaml(path)["name"] == "diagnosed_odd"
    composed = config.compose(str(path))
    assert composed["name"] == "diagnosed_odd" and " ".join(ODD.split()) in composed["question"]


@pytest.mark.parametrize("there", ["link", "folder"])
def test_nothing_takes_the_place_of_a_link_or_folder(tmp_path, there):
    path = tmp_path / "x"
    if there == "link":
        path.symlink_to("elsewhere")
    else:
        path.mkdir()
    before = state(tmp_path)
    with pytest.raises(InputError, match=f"x: is a {there}"):
        write_text(path, "text")
    assert state(tmp_path) == before


JOURNAL = b'{"op_code": 0, "worker_id": "a", "study_name": "s", "directions": [1]}\n'


@pytest.mark.parametrize(
    "garbage", [b"garbage\n", b"\xff\xfe\0\n", b"{}\n", b"[]\n", b'{"op_code": 0}\n', b'{"op_code": 99}\n']
)
def test_garbage_in_a_journal_is_told_and_left(tmp_path, garbage):
    path = tmp_path / "journal.log"
    path.write_bytes(JOURNAL + garbage + JOURNAL)
    with pytest.raises(InputError, match=r"journal\.log"):
        open_study(path, "s")
    assert path.read_bytes() == JOURNAL + garbage + JOURNAL


@pytest.mark.parametrize("content", [b"garbage" * 1000, b"SQLite format 3\0" + b"x" * 5000, None])
def test_a_corrupt_database_of_runs_is_told_and_left(tmp_path, content):
    path = tmp_path / "mlflow.db"
    if content is None:
        path.mkdir()
    else:
        path.write_bytes(content)
    with pytest.raises(InputError, match=r"tracking\.uri: .*mlflow\.db cannot be used"):
        ensure_experiment(f"sqlite:///{path}", "e")
    assert content is None or path.read_bytes() == content


def test_a_bench_s_braces_are_refused_by_the_workflow_alone(workshop):
    (workshop / "bench").rename(workshop / "a{b}c")
    with pytest.raises(InputError, match="no braces"):
        config.check_call({"bench": "a{b}c"})
    assert say(["identify", "a{b}c", "--experiment", "smoke"]).code == 0

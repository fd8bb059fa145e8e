"""Folders written whole or not at all."""

import os
import shutil
import signal
import subprocess
import sys
import time

import pytest

from emafault.errors import InputError
from emafault.io.atomic import replace_atomically, whole_folder, write_text
from emafault.places import LONGEST_NAME, TEMPORARY, refuse_output
from emafault.processes import started
from emafault.reporting.page import Page


def _held(folder):
    return {path.name: path.read_text() for path in folder.iterdir()}


def test_a_folder_that_was_removed_and_begun_by_another_process_is_whole_in_the_end(tmp_path):
    path = tmp_path / "figures"
    with whole_folder(path) as part:
        (part / "first.png").write_text("1")
        path.mkdir()  # the next run, which has removed what there was
        (path / "other.png").write_text("other")
        (part / "last.png").write_text("2")
    assert _held(path) == {"first.png": "1", "last.png": "2"} and list(tmp_path.iterdir()) == [path]


def test_a_page_shows_its_figures_all_at_once(tmp_path):
    import matplotlib.pyplot as plt

    page = Page("title", tmp_path / "figures")
    page.figure("one", plt.figure(), "a figure", "what it shows")
    shutil.rmtree(tmp_path / "figures", ignore_errors=True)  # by the next run
    page.figure("two", plt.figure(), "a figure", "what it shows")
    assert not (tmp_path / "figures").exists()
    page.write(tmp_path / "report.html")
    assert sorted(p.name for p in (tmp_path / "figures").iterdir()) == ["one.png", "two.png"]


def test_a_folder_that_cannot_be_finished_leaves_what_was_there(tmp_path):
    path = tmp_path / "figures"
    with whole_folder(path) as part:
        (part / "old.png").write_text("old")
    with pytest.raises(InputError, match=r"figures/new\.png/a: cannot be written") as told, whole_folder(path) as part:
        (part / "new.png").write_text("new")
        write_text(part / "new.png" / "a", "under a file")
    assert ".part" not in str(told.value)
    assert _held(path) == {"old.png": "old"} and list(tmp_path.iterdir()) == [path]


def _left_by(write, tmp_path):
    """What a process on the host of this test leaves that is killed while it writes."""
    code = (
        "import os, pathlib, signal, sys\n"
        "from emafault.io.atomic import replace_atomically, whole_folder\n"
        "path = pathlib.Path(sys.argv[1])\n"
        "def killed(part):\n"
        "    (part / 'half.png' if part.is_dir() else part).write_text('half')\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    before = set(tmp_path.iterdir())
    process = subprocess.run([sys.executable, "-c", code + write, tmp_path / "figures"])
    assert process.returncode == -signal.SIGKILL
    (left,) = set(tmp_path.iterdir()) - before
    return left


WRITES = ["with whole_folder(path) as part: killed(part)", "replace_atomically(path, killed)"]


@pytest.mark.parametrize("write", WRITES)
def test_what_a_killed_process_left_is_removed(write, tmp_path):
    left = _left_by(write, tmp_path)
    with whole_folder(tmp_path / "figures"):
        assert not left.exists()
    assert [p.name for p in tmp_path.iterdir()] == ["figures"]


@pytest.mark.parametrize("write", WRITES)
def test_what_a_process_of_another_host_writes_is_kept_for_a_day(write, tmp_path, monkeypatch):
    left = _left_by(write, tmp_path)
    monkeypatch.setattr("socket.gethostname", lambda: "another")  # the file is then of another host
    with whole_folder(tmp_path / "figures"):
        pass
    assert left.exists()
    os.utime(left, (time.time() - 25 * 3600.0,) * 2)
    with whole_folder(tmp_path / "figures"):
        pass
    assert not left.exists()


def test_what_another_process_writes_is_kept_and_a_dead_one_of_its_number_is_told_from_it(tmp_path):
    text = tmp_path / "a.json"

    def meanwhile(part):
        part.write_text("first")
        earlier = part.with_name(part.name.replace(f"-{started(os.getpid())}-", "-1-"))
        assert earlier != part
        earlier.write_text("half")
        code = "import sys; from emafault.io.atomic import write_text; write_text(sys.argv[1], 'second')"
        subprocess.run([sys.executable, "-c", code, text], check=True)
        assert part.exists() and not earlier.exists() and text.read_text() == "second"

    replace_atomically(text, meanwhile)
    assert _held(tmp_path) == {"a.json": "first"}


def test_the_name_of_a_half_file_is_as_long_as_is_reserved_for_it(tmp_path):
    path = tmp_path / ("x" * (LONGEST_NAME - TEMPORARY))
    refuse_output(path)
    write_text(path, "")
    with whole_folder(tmp_path / ("y" * (LONGEST_NAME - TEMPORARY))) as part:
        assert len(part.name) <= LONGEST_NAME - len(".old")
    with pytest.raises(InputError, match="too long"):
        refuse_output(path.with_name(f"{path.name}x"))


def test_a_file_in_the_place_of_a_folder_is_kept_and_refused(tmp_path):
    (tmp_path / "figures").write_text("mine")
    with pytest.raises(InputError, match="figures: is no folder"), whole_folder(tmp_path / "figures"):
        pass
    assert (tmp_path / "figures").read_text() == "mine"

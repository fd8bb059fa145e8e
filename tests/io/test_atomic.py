"""Folders written whole or not at all."""

import shutil

import pytest

from emafault.errors import InputError
from emafault.io.atomic import whole_folder, write_text
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
    page.figure("one", plt.figure(), "a figure")
    shutil.rmtree(tmp_path / "figures", ignore_errors=True)  # by the next run
    page.figure("two", plt.figure(), "a figure")
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


def test_what_a_killed_process_left_is_removed(tmp_path):
    left = tmp_path / ".figures.999999999.part"
    left.mkdir()
    (left / "half.png").write_text("")
    with whole_folder(tmp_path / "figures"):
        pass
    assert not left.exists()


def test_a_file_in_the_place_of_a_folder_is_kept_and_refused(tmp_path):
    (tmp_path / "figures").write_text("mine")
    with pytest.raises(InputError, match="figures: is no folder"), whole_folder(tmp_path / "figures"):
        pass
    assert (tmp_path / "figures").read_text() == "mine"

"""Pages of the documentation: links between files of the repository lead somewhere."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
MADE = {"gallery.md", "verdict.md", "index.md"}  # by docs/generated.py


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_links_lead_to_files(page):
    targets = re.findall(r"\]\((?!https?:|#)([^)#\s]+)", page.read_text())
    missing = [t for t in targets if t not in MADE and not (page.parent / t).exists()]
    assert not missing


def test_the_readme_is_one_screen():
    assert len((ROOT / "README.md").read_text().splitlines()) < 90

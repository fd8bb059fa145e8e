"""The wheel by itself: it brings what it reads and needs no clone; ``.ci/wheel`` installs and uses it."""

import ast
import json
import os
import re
import subprocess
import sys
import zipfile
from graphlib import TopologicalSorter
from pathlib import Path

import pytest
import yaml

import emafault
from emafault import provenance

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """Folder that the wheel was unpacked into."""
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "-w", str(folder)]
    subprocess.run([*command, str(ROOT)], check=True, capture_output=True)
    (wheel,) = folder.glob("*.whl")
    with zipfile.ZipFile(wheel) as packed:
        packed.extractall(folder / "site")
    return folder / "site"


def test_the_version_is_the_cited_and_the_last_one():
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert cited["version"] == emafault.__version__ and cited["license"] == "BSD-3-Clause"
    assert re.findall(r"^## (\S+)", (ROOT / "CHANGELOG.md").read_text(), re.M)[0] == emafault.__version__


def test_no_package_imports_one_that_imports_it():
    imported = {}
    for path in provenance.PACKAGE.rglob("*.py"):
        own, *below = path.relative_to(provenance.PACKAGE).with_suffix("").parts
        names = provenance._imports(ast.parse(path.read_text()), path)
        tops = {name.split(".")[1] for name in names if name.startswith("emafault.")}
        imported.setdefault(own if below or own != "__init__" else "", set()).update(tops - {own})
    assert "effects" in imported["actuator"]
    list(TopologicalSorter(imported).static_order())  # raises CycleError


def test_a_wheel_brings_what_it_reads(installed, tmp_path):
    package = installed / "emafault"
    for tree in ("conf", "examples/bench"):
        ours = package / ("example" if tree == "examples/bench" else tree)
        files = {p.relative_to(ROOT / tree) for p in (ROOT / tree).rglob("*") if p.is_file()}
        assert {p.relative_to(ours) for p in ours.rglob("*") if p.is_file()} == files and files
    assert (package / "py.typed").is_file() and (package / "__init__.pyi").is_file()

    def run(*arguments):
        command = [sys.executable, "-m", "emafault", *arguments]
        environment = os.environ | {"PYTHONPATH": str(installed)}
        return subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)

    assert run("--version").stdout.startswith("emafault 0.")
    assert json.loads(run("schema", "verdict").stdout)["title"].startswith("diagnosis.json")
    done = run("config", "--plain", "command=sine")
    assert done.returncode == 0 and "name: sine" in done.stdout, done.stderr
    done = run("plan", "nowhere")
    assert (done.returncode, done.stderr) == (2, "emafault plan: nowhere: no such file or folder\n")

"""The wheel by itself: it brings its configuration and needs no clone."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

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


def test_a_wheel_simulates_and_identifies_from_any_folder(installed, tmp_path):
    def run(*arguments):
        environment = os.environ | {"PYTHONPATH": str(installed)}
        command = [sys.executable, "-m", "emafault", *arguments]
        return subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)

    where = subprocess.run(
        [sys.executable, "-c", "import emafault.paths as p; print(p.CONF)"], cwd=tmp_path, text=True,
        env=os.environ | {"PYTHONPATH": str(installed)}, capture_output=True, check=True,
    )  # fmt: skip
    assert where.stdout.strip() == str(installed / "emafault" / "conf")
    done = run("simulate", "a.nc", "command=sine", "recording.duration=0.5", "--fault", "dT=30")
    assert done.returncode == 0, done.stderr
    done = run("identify", "a.nc")
    assert done.returncode == 0 and "dT" in done.stdout, done.stderr
    assert run("--version").stdout.startswith("emafault 0.")
    done = run("plan", "nowhere")
    assert (done.returncode, done.stderr) == (2, "emafault plan: nowhere: no such file or folder\n")

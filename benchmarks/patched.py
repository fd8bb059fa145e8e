"""Scripts run with a copy of the simulator whose lines were changed."""

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def run(script: str, file: str, changes: Iterable[tuple[str, str]], *arguments: object) -> None:
    """Run a Python script with arguments beside a copy of the package, one file of which has lines changed.

    Exits where lines that are to be changed do not stand in the file exactly once.
    """
    text = (ROOT / file).read_text()
    for old, new in changes:
        if text.count(old) != 1:
            raise SystemExit(f"{file}: has {old.strip()!r} {text.count(old)} times, expected is once")
        text = text.replace(old, new)
    with tempfile.TemporaryDirectory() as copy:
        folder = Path(copy)
        for name in ("src", "conf", "benchmarks"):
            shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
        (folder / file).write_text(text)
        paths = {"PYTHONPATH": str(folder / "src"), "NUMBA_CACHE_DIR": str(folder / "compiled")}
        command = [sys.executable, "-c", script, *map(str, arguments)]
        subprocess.run(command, cwd=folder, env=os.environ | paths, check=True)

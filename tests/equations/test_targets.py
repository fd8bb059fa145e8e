"""What Snakemake plans for a bench."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from emafault.io.recording import write_recording

from .conftest import recorded

ROOT = Path(__file__).resolve().parents[2]
pytestmark = pytest.mark.workflow


def _plan(folder, *arguments):
    command = [sys.executable, "-m", "snakemake", "-s", str(ROOT / "Snakefile"), "-d", str(folder), "--dry-run"]
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    return subprocess.run([*command, *arguments], capture_output=True, text=True, env=environment, timeout=120)


def test_a_bench_is_diagnosed_then_retrained_and_without_one_the_call_is_refused_in_a_line(tmp_path):
    write_recording(tmp_path / "mine" / "a.nc", recorded())
    planned = _plan(tmp_path, "retrain", "--config", f"bench={tmp_path / 'mine'}")
    assert planned.returncode == 0, planned.stderr
    text = planned.stdout + planned.stderr
    assert "diagnose_gap" in text and "retrain_network" in text and "simulate_shard" not in text
    assert "results/diagnoses/mine/retrained.json" in text
    for arguments, said in (([], "bench: none given"), (["--config", "bench=nowhere"], "nowhere: no such file")):
        refused = _plan(tmp_path, "diagnose", *arguments)
        assert refused.returncode != 0 and said in refused.stderr + refused.stdout

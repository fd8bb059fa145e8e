"""Ranks of true values within told intervals."""

import json

import pytest

from emafault.study.told_ranks import told_ranks


def test_ranks_of_what_is_named_exactly(tmp_path):
    told = {"value": 0.10, "low": 0.10 - 1.645 * 0.02, "high": 0.10 + 1.645 * 0.02, "units": "1"}
    for name, rung, effects, amplitude in (
        ("right", "T1", ["cogging"], 0.12), ("other", "T1", ["stribeck"], 0.12), ("later", "T2", ["cogging"], 0.1),
    ):  # fmt: skip
        key = {"case": {"rung": rung, "effects": {"cogging": {"amplitude": amplitude}}}}
        verdict = {"verdict": "explained", "which": [{"effects": effects, "parameters": {"amplitude": told}}]}
        for path, content in (("keys/{}.json", key), ("diagnoses/{}/diagnosis.json", verdict)):
            file = tmp_path / path.format(name)
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(json.dumps(content))
    found = told_ranks(tmp_path)
    assert found["cases"] == 1 and found["ranks"] == [pytest.approx(0.841, abs=1e-3)] and found["inside"] == 1.0

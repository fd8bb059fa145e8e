"""The page of measured machines."""

import json
import shutil
from pathlib import Path

import yaml

from emafault.study.machines import HEADER, KINDS, diagnose_machines, summary

DATA = Path(__file__).parents[2] / "data" / "measured"


def test_a_set_gets_its_verdict_its_check_and_its_place_on_the_page(tmp_path):
    shutil.copytree(DATA / "emps", tmp_path / "emps")
    listed, out = tmp_path / "sets.yaml", tmp_path / "out"
    listed.write_text(yaml.safe_dump([{"folder": "emps", "twin": "friction_axis", "files": ["emps_estimation.npz"]}]))
    shutil.copy(DATA / "nameplate.yaml", tmp_path)
    diagnose_machines(
        listed, tmp_path / "nameplate.yaml", out / "report.html", out / "figures", out / "verdicts.json",
        out / "withheld.json",
    )  # fmt: skip
    verdict = json.loads((out / "verdicts.json").read_text())["emps/emps_estimation.npz"]["emps_estimation"]
    line = summary("emps_estimation", verdict)
    assert len(line) == len(HEADER) and line[0] == "emps_estimation" and line[-1] == verdict["held_out"]["outcome"]
    rows = json.loads((out / "withheld.json").read_text())
    assert {r["kind"] for r in rows} == set(KINDS) and sum(r["right"] for r in rows) >= len(rows) - 1
    page = (out / "report.html").read_text()
    assert "<img" in page and page.count('class="panel"') >= 1
    for kind, title in KINDS.items():  # put in and left out stand apart
        mine = [r for r in rows if r["kind"] == kind]
        assert f"{title}: {sum(r['right'] for r in mine)} of {len(mine)} right" in page

"""One fault from several recordings: errors at their bound, which falls with their number."""

import json
import re

import pytest

from emafault import config
from emafault.study.several import draw_several, identify_several


def test_errors_stand_at_the_bound_that_falls_with_the_number_of_recordings(tmp_path):
    spec = config.several_spec()
    spec["settings"] |= {"units": 10, "counts": [1, 3]}
    for own in spec["experiments"]:
        own["dataset"]["recording"]["duration"] = 0.4
    identify_several(spec, tmp_path / "errors.json")
    entries = json.loads((tmp_path / "errors.json").read_text())
    assert len(entries) == 2 * 2 * 2
    by = {(e["experiment"], e["features"], e["count"]): e for e in entries}
    for entry in entries:
        for name in ("N", "xi", "dT"):
            assert 0.5 < entry["errors"][name] / entry["bound"][name] < 1.7
        assert entry["coverage"] > 0.7
    for features in ("six", "nine"):
        one, three = (by["nine_features", features, n]["bound"] for n in (1, 3))
        assert three["xi"] < 0.62 * one["xi"] and three["N"] < 0.75 * one["N"]
        one, three = (by["nine_tolerance", features, n]["bound"] for n in (1, 3))
        assert three["dT"] == pytest.approx(one["dT"], rel=0.15)  # what the unit is off by does not average out
    draw_several(spec, str(tmp_path / "errors.json"), tmp_path / "report.html", tmp_path / "figures")
    text = (tmp_path / "report.html").read_text()
    assert 'id="nine_tolerance"' in text
    last = by["nine_tolerance", "nine", 3]
    (said,) = re.findall(r'id="nine_tolerance".*?alt="(.*?)"', text)
    assert f"(bound {last['bound']['dT']:.2g})" in said and "nine features, 1 to 3 recordings" in said

"""The search for the command that identifies best: within its limits, never worse than the paper's command."""

import json

import numpy as np
import pytest

from emafault import config
from emafault.config import separate
from emafault.errors import InputError
from emafault.study import confirmed_command
from emafault.study.optimal_command import Design, Judge, best, demand, design_of, paper_design, search, search_command


@pytest.fixture(scope="module")
def spec():
    spec = config.design_spec()
    spec["design"] |= {"trials": 12, "faults": 2, "fresh": 25}
    return spec


@pytest.fixture(scope="module")
def judge(spec):
    return Judge(spec)


def test_the_bound_falls_with_the_length_of_recording(spec, judge):
    errors = [judge.least(judge.simulate(paper_design(spec, length))) for length in (0.3, 0.4, 0.6)]
    assert np.all(errors[0] > errors[1]) and np.all(errors[1] > errors[2])


def test_the_optimum_is_not_worse_than_the_papers_command_and_keeps_the_limits(spec, judge, tmp_path):
    path, page = tmp_path / "length_0.json", tmp_path / "report.html"
    search_command(spec, 0.3, path)
    found = json.loads(path.read_text())
    scale = judge(paper_design(spec, 1.0))
    paper = judge(paper_design(spec, 0.3))
    for role in ("free", "loaded"):
        judged = judge(design_of(found[role][0]))
        assert judged.score(scale) <= paper.score(scale) and judged.breaches(spec["design"]["limits"]) == []
        assert judged.score(scale) == pytest.approx(found[role][0]["score"], rel=1e-9)
        kept = [not trial["breaches"] for trial in found[role]]
        assert kept == sorted(kept, reverse=True) and not all(kept)
    assert found["loaded"][0]["score"] <= found["free"][0]["score"]
    assert all(trial["constant"] == trial["spring"] == 0.0 for trial in found["free"])
    confirmed = tmp_path / "confirmed.json"
    confirmed_command.confirm_commands(spec, [str(path)], confirmed)
    entries = json.loads(confirmed.read_text())
    assert [entry["role"] for entry in entries] == ["paper", "free", "loaded"]
    for entry in entries:
        for name, error in entry["errors"].items():
            # of 25 runs; components of a run err together
            assert 0.6 < error / entry["bound"][name] < 1.5
        assert entry["breaches"] == []
    confirmed_command.draw_commands(spec, [str(path)], str(confirmed), page, tmp_path / "figures")
    assert 'id="lengths"' in page.read_text() and (tmp_path / "figures" / "signals.png").is_file()


@pytest.mark.parametrize("limit", ["speed", "travel", "supply", "heating"])
def test_a_limit_that_is_broken_is_refused(spec, judge, limit):
    design = Design({"name": "step", "amplitude": 0.05, "time": 0.01}, 0.2)
    judged = judge(design)
    wide = dict.fromkeys(judged.demand, np.inf)
    assert judged.breaches(wide) == []
    assert judged.breaches({**wide, limit: 0.99 * judged.demand[limit]}) == [limit]


def test_limits_that_nothing_keeps_are_refused(spec, judge):
    tight = {**spec, "design": spec["design"] | {"trials": 2, "limits": spec["design"]["limits"] | {"travel": 1e-6}}}
    with pytest.raises(InputError, match=r"no design that was tried keeps them .*travel"):
        best(search(Judge(tight), paper_design(tight, 0.2), tight))


def test_demand_of_constant_signals(judge):
    n = 100
    current = np.tile([2.0, -2.0, 0.0], (1, n, 1))
    signals = {
        "phase_voltage": np.tile([10.0, -10.0, 0.0], (1, n, 1)),
        "phase_current": current,
        "rotor_speed": np.full((1, n), -30.0),
        "output_position": np.full((1, n), -0.1),
        "bus_voltage": np.full((1, n), 40.0),
    }
    asked = demand(signals, np.zeros((1, 6)), judge.actuator, 5.0, 2e-4)
    assert asked["supply"] == pytest.approx(0.5) and asked["speed"] == 30.0 and asked["travel"] == 0.1
    assert asked["heating"] == pytest.approx(2 * judge.actuator.resistance * 4.0 * n * 2e-4 / 5.0)


def test_settings_that_do_not_fit_are_refused(monkeypatch, tmp_path):
    text = (separate.CONF / "optimal_command.yaml").read_text()
    for old, new, says in (
        ("speed: {low: 0.02, high: 0.8}", "velocity: {low: 0.02, high: 0.8}", "velocity"),
        ("trials: 200", "trials: 1", "trials"),
        ("  ramp:", "  leap:", "leap"),
    ):
        (tmp_path / "optimal_command.yaml").write_text(text.replace(old, new))
        monkeypatch.setattr(separate, "CONF", tmp_path)
        with pytest.raises(InputError, match=says):
            separate.design()

"""What is made of recommended recordings."""

import numpy as np
import pytest

from emafault.actuator.parameters import ActuatorParameters
from emafault.actuator.sensors import SensorNoise
from emafault.config import compose, diagnosis_spec
from emafault.study import recommended
from emafault.study.recommended import Step, at_random, log_odds, recommended_first, sequence, with_recording
from emafault.withheld.cases import draw_case

ENTRY = {
    "motion": {"name": "ramp", "duration": 0.6, "settings": {"speed": -0.4}}, "ambient_temperature": -40.0,
    "separates": ["stribeck", "cogging+inertia"], "expected_odds": 30.0,
}  # fmt: skip


def test_a_recommended_recording_is_of_the_unit_in_its_present_state():
    case = next(
        c for c in map(lambda s: draw_case("T1", s), range(50)) if any(r.health == "unknown" for r in c.recordings)
    )
    more = with_recording(case, ENTRY)
    assert more.recordings[:-1] == case.recordings and more.unit() == case.unit()
    new = more.recordings[-1]
    state = next(r for r in case.recordings if r.health == "unknown")
    assert (new.command, new.health, new.fault[:5], new.fault[5]) == ("ramp", "unknown", state.fault[:5], -60.0)


def test_a_choice_at_random_is_of_the_menu():
    choose = at_random(np.random.default_rng(1))
    assert len({choose([ENTRY])["motion"]["name"] for _ in range(50)}) == len({m[0] for m in recommended.MENU})


def test_odds_of_sets_whatever_their_order():
    verdict = {"which": [{"effects": ["inertia", "cogging"], "probability": 0.6}, {"effects": [], "probability": 0.3}]}
    assert log_odds(verdict, ("cogging", "inertia"), ()) == pytest.approx(np.log(2.0))
    assert log_odds(verdict, (), ("stribeck",)) == pytest.approx(np.log(0.3 / recommended.LEAST))


def test_a_promise_is_kept_by_a_decision_that_is_not_wrong():
    assert Step("a", "b", 4.0, 0.0, 3.5, 1).kept and Step("a", "b", 4.0, 0.0, -3.5, 0).kept
    assert not Step("a", "b", 4.0, 0.0, 3.5, -1).kept and not Step("a", "b", 4.0, 0.0, 2.0, 1).kept
    assert Step("a", "b", 4.0, 0.5, -3.0, -1).achieved == 3.5 and Step("a", "b", 4.0, 0.5, -3.0, 0).achieved is None


def test_recordings_are_added_until_one_reading_is_left(monkeypatch):
    def told(case, actuator, noise):
        p = 0.5 if len(case.recordings) < start + 2 else 0.95
        which = [
            {"effects": ["cogging", "inertia"], "probability": p},
            {"effects": ["stribeck"], "probability": 1.0 - p},
        ]
        return {"which": which}, [ENTRY]

    case = draw_case("T1", 5)
    start = len(case.recordings)
    monkeypatch.setattr(recommended, "_diagnosed", told)
    spec = diagnosis_spec(compose())
    given = ActuatorParameters(**spec["actuator"]), SensorNoise(**spec["sensors"])
    found = sequence(case, recommended_first, *given)
    assert found.needed == 2 and len(found.steps) == 2
    assert found.steps[0].after == pytest.approx(0.0) and found.steps[1].after == pytest.approx(-np.log(19.0))
    assert sequence(case, at_random(np.random.default_rng(0)), *given).needed == 2

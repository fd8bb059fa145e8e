"""What a verdict of a measured machine rests on, with a small machine whose truth is known."""

import hashlib
import json
from dataclasses import replace

import numpy as np
import pytest

from emafault.machines.diagnose import diagnose
from emafault.machines.run import checked
from emafault.machines.statement import Machine

from . import line


def machine(**changed: np.ndarray) -> Machine:
    return line.build("bench", line.recorded() | changed)


def told(found: Machine) -> dict:
    verdict = diagnose(found).verdict
    checked(verdict)
    return verdict


def test_a_machine_without_gap_is_told_so_and_what_says_nothing_is_told_too():
    verdict = told(machine())
    assert verdict["verdict"] == "no_gap" and verdict["held_out"]["outcome"] == "holds"
    assert verdict["untold"] == ["speed_limit"]  # none of these speeds reaches it
    # an effect of which the recordings say nothing keeps its prior odds: it is not ruled out
    assert verdict["inclusion"]["speed_limit"] > 0.15 > 2.0 * verdict["inclusion"]["constant_drop"]
    assert sum(e["probability"] for e in verdict["which"]) == pytest.approx(1.0, abs=1e-4)


def test_a_cause_put_in_is_named_with_its_size():
    a = line.recorded()
    verdict = told(machine(v=a["v"] + 0.8))
    assert verdict["verdict"] == "explained" and verdict["which"][0]["effects"] == ["constant_drop"]
    fitted = verdict["which"][0]["parameters"]["V_drop"]
    assert fitted["low"] < 0.8 < fitted["high"] and fitted["units"] == "V"
    assert verdict["held_out"]["outcome"] == "holds" and verdict["shrinks"]["signal"]["closed"] > 0.9
    assert verdict["where"][0]["equation"] == "electrical"


def test_what_is_named_stays_named_beside_what_nothing_describes():
    a = line.recorded()
    verdict = told(machine(v=a["v"] + 0.8 + 0.3 * np.sin(a["w"] / 4.0)))
    assert verdict["verdict"] == "partly" and verdict["inclusion"]["constant_drop"] > 0.9
    assert [d["equation"] for d in verdict["discovered"]] == ["electrical"]


def test_a_wave_that_no_effect_has_is_unknown_in_its_equation():
    a = line.recorded()
    verdict = told(machine(v=a["v"] + 0.5 * np.sin(a["i"] * 2.0)))
    assert verdict["verdict"] == "unknown" and verdict["which"][0]["equation"] == "electrical"


@pytest.mark.parametrize("size", [2.5, 5.0])
def test_no_gap_is_not_claimed_where_what_was_set_aside_is_off_by_more_than_noise(size):
    a = line.recorded()
    rng = np.random.default_rng(1)
    aside = a["recording"] >= 2
    verdict = told(machine(v=a["v"] + aside * size * line.ACCURACY * rng.standard_normal(a["v"].size)))
    assert verdict["sealed"]["verdict"] == "no_gap" and verdict["verdict"] == "unknown"
    assert verdict["held_out"]["outcome"] == "contradicted"


def test_a_single_condition_that_alone_shows_a_gap_is_not_hidden_by_the_split():
    a = line.recorded()
    fast = (a["recording"] == 3) & (a["i"] > 17.0)
    verdict = told(machine(v=a["v"] + 10.0 * line.ACCURACY * fast))
    assert fast.sum() <= 4 and verdict["verdict"] != "no_gap"


def test_the_seal_can_be_recomputed_and_knows_nothing_of_what_is_set_aside():
    a = line.recorded()
    one = told(machine(v=a["v"] + 0.8))["sealed"]
    text = json.dumps({k: v for k, v in one.items() if k != "digest"}, sort_keys=True, separators=(",", ":"))
    assert hashlib.sha256(text.encode()).hexdigest() == one["digest"]
    changed = told(machine(v=a["v"] + 0.8 + 5.0 * (a["recording"] >= 2)))
    assert changed["sealed"] == one and changed["verdict"] != "explained"


def test_names_and_order_of_recordings_do_not_matter():
    a = line.recorded()
    usual = machine(v=a["v"] + 0.1 * a["i"] + 0.3)
    names = dict(zip([r.recording for r in usual.rows], ("z", "m", "b", "a"), strict=True))
    renamed = replace(
        usual,
        rows=[replace(r, recording=names[r.recording]) for r in usual.rows][::-1],
        explore=tuple(names[n] for n in usual.explore)[::-1],
        confirm=tuple(names[n] for n in usual.confirm)[::-1],
    )
    one, two = told(usual), told(renamed)
    assert one["verdict"] == two["verdict"] and one["sealed"]["verdict"] == two["sealed"]["verdict"]
    for p, q in zip(one["which"], two["which"], strict=True):
        assert p["effects"] == q["effects"] and p["probability"] == pytest.approx(q["probability"], abs=1e-4)
    assert one["shrinks"]["signal"]["after"] == pytest.approx(two["shrinks"]["signal"]["after"], rel=1e-4)


def test_an_effect_left_out_is_not_named():
    a = line.recorded()
    verdict = told(machine(v=a["v"] + 0.8).without("constant_drop"))
    assert "constant_drop" not in verdict["inclusion"] and verdict["verdict"] in ("unknown", "partly")


def test_shared_errors_are_no_gap():
    """An offset common to a recording, within what its instrument is trusted for, is not taken for a cause."""
    a = line.recorded()
    usual = machine(v=a["v"] + np.array([0.3, -0.2, 0.25, -0.35])[a["recording"].astype(int)])
    trusted = replace(usual, rows=[replace(r, shared=np.full((r.size, 1), 0.3)) for r in usual.rows])
    assert told(usual)["verdict"] != "no_gap" and told(trusted)["verdict"] == "no_gap"

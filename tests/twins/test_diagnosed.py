"""Measured machines through the whole diagnosis, and what survives the held-out recordings."""

from functools import cache

import numpy as np
import pytest

from emafault.gap.held_out import shared
from emafault.twins.diagnosed import check_file, diagnose_cases
from emafault.twins.library import MEASURED, calibration_of

from .test_measured import DATA, FILES


@cache
def diagnosed(name: str, number: int = 0):
    return diagnose_cases(name, DATA / FILES[name][number], calibration_of(name))


@pytest.mark.parametrize("name", MEASURED)
def test_every_set_gets_a_whole_verdict(name):
    for number in range(len(FILES[name])):
        for case, found in diagnosed(name, number).items():
            verdict = found.verdict
            assert verdict["bench"] == case and verdict["twin"] == name
            assert sum(e["probability"] for e in verdict["which"]) == pytest.approx(1.0, abs=1e-3)
            signal = verdict["shrinks"]["signal"]
            assert all(np.isfinite(signal[rung]) for rung in ("nominal", "recalibrated", "placebo", "after"))
            assert set(verdict["held_out"]["claimed"]) <= {e for h in found.twin.hypotheses for e in [h.effect]}


def test_what_fits_early_and_fails_later_is_not_claimed():
    held = diagnosed("dq_machine")["profile24_first60"].verdict["held_out"]
    assert held["outcome"] != "holds" or "iron_loss" not in held["claimed"]
    assert "iron_loss" not in held["rivals"][0]["effects"] and "magnet_temperature" in held["rivals"][0]["effects"]


def test_contradicting_repetitions_leave_no_claim():
    cases = diagnosed("induction_currents")
    assert cases["ITSC_B20"].verdict["held_out"]["claimed"] == []
    assert cases["ITSC_B40"].verdict["held_out"]["claimed"] == ["shorted_turns_b"]
    assert cases["ITSC_HLT"].verdict["verdict"] == "no_gap"


def test_the_gap_closes_on_recordings_that_took_no_part():
    for name, case in (
        ("back_emf", "backemf"),
        ("friction_axis", "emps_estimation"),
        ("slow_rotation", "cogging_maps"),
    ):
        signal = diagnosed(name)[case].verdict["shrinks"]["signal"]
        assert signal["closed"] > 0.95 and signal["placebo"] > 3 * signal["after"]


def test_what_sets_share():
    assert shared([["a", "b", "c"], ["c", "a"], ["a", "c", "d"]]) == ["a", "c"]
    assert shared([["a"]]) == ["a"]


def test_the_withheld_check_names_distortions_and_refuses_what_it_lacks():
    rows = [row for name in MEASURED for row in check_file(name, DATA / FILES[name][0], calibration_of(name))]
    named = [row for row in rows if row.expected]
    refused = [row for row in rows if not row.expected]
    assert len(named) >= 12 and len(refused) >= 10
    assert np.mean([row.right for row in named]) > 0.85
    assert np.mean([row.right for row in refused]) > 0.6

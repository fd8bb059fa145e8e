"""What is believed of measured machines is calibrated on such as were redrawn with a known effect."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from emafault.gap.decide import UNCALIBRATED, Calibration
from emafault.study.calibrate_measured import counts, fit, machines, redrawings
from emafault.twins.diagnosed import diagnose_twin, same_trace
from emafault.twins.library import calibration_of, measured_twins
from emafault.twins.redrawn import redraw

DATA = Path(__file__).parents[2] / "data" / "measured"
START = Calibration.load(UNCALIBRATED)


@cache
def machine(name: str, file: str):
    twin = next(iter(measured_twins(name, DATA / file).values()))
    return diagnose_twin(twin, START)


def axis():
    return machine("friction_axis", "emps/emps_estimation.npz")


@cache
def fresh():
    """Redrawn axes of a draw that nothing was fitted to."""
    return redrawings("friction_axis", [axis()], 25, 7)


def test_a_redrawn_machine_leaves_its_own_residual_around_a_known_effect():
    found = axis()
    drawn = redraw(found, np.random.default_rng(3), 400.0)
    assert drawn is not None
    base = np.array([p.off if p.effect else v for p, v in zip(drawn.twin.parameters, drawn.truth, strict=True)])
    shift = np.subtract(*found.explore.predict(np.array([drawn.truth, base])))
    assert found.explore.squared_distance(found.found.null, found.explore.whiten(shift)) >= 400.0
    moved = [p.effect for p, v in zip(drawn.twin.parameters, drawn.truth, strict=True) if p.effect and v != p.off]
    assert set(moved) == {drawn.effect}
    signs = set()
    for name, block in drawn.twin.blocks.items():
        before, known = found.twin.predict(np.array([found.ladder.after.values, drawn.truth]), [name])
        rest, left = found.twin.blocks[name].observed - before, block.observed - known
        signs.add(float(np.sign(rest @ left)))
        assert np.allclose(np.abs(left), np.abs(rest), atol=1e-9 * np.abs(known).max())
    assert len(signs) == 1
    alike = same_trace(diagnose_twin(drawn.twin, START), drawn.effect)
    assert alike & set(diagnose_twin(drawn.twin, START).found.candidates[0].effects)


def test_what_no_draw_can_show_is_given_up():
    assert redraw(axis(), np.random.default_rng(0), 1e12) is None


def test_the_frozen_curve_refuses_stand_ins_that_the_prior_believes_and_keeps_what_is_right():
    before, after = counts(fresh(), START), counts(fresh(), calibration_of("friction_axis"))
    assert before["wrong, believed"] >= 8
    assert after["wrong, believed"] <= 0.6 * before["wrong, believed"]
    assert after["right, believed"] >= 0.9 * before["right, believed"]


def test_a_curve_fitted_to_one_draw_helps_on_another():
    fitted = fit(fresh(), START)
    other = redrawings("friction_axis", [axis()], 15, 8)
    assert counts(other, fitted)["wrong, believed"] < counts(other, START)["wrong, believed"]
    assert fitted.gap == START.gap and 0.5 < fitted.most < 1.0


def test_without_redrawn_machines_a_calibration_stays_as_it_is():
    assert fit([], START) == START


def test_only_machines_whose_residual_is_known_are_redrawn(tmp_path):
    (tmp_path / "bldc_sixstep_esc").symlink_to(DATA / "bldc_sixstep_esc")
    listed = tmp_path / "sets.yaml"
    files = "[f40_merged.csv.gz, f60_kotleta_bench_log.csv.gz]"
    listed.write_text(f"- {{folder: bldc_sixstep_esc, twin: six_step_bus, files: {files}}}\n")
    found = machines(listed, START)
    assert {name: [d.verdict["bench"] for d in usable] for name, usable in found.items()} == {
        "six_step_bus": ["f40_merged"]
    }


@pytest.mark.parametrize(
    ("name", "file", "effect", "alike"),
    [
        ("friction_axis", "emps/emps_estimation.npz", "viscous_asymmetry", {"viscous_asymmetry"}),
        ("friction_axis", "emps/emps_estimation.npz", "offset", {"offset", "coulomb_asymmetry"}),
        (
            "back_emf",
            "bldc_backemf_scope/backemf.npz",
            "channel_gain_c",
            {"channel_gain_a", "channel_gain_b", "channel_gain_c", "phase_gain"},
        ),
    ],
)
def test_what_leaves_the_same_trace_alone_or_together(name, file, effect, alike):
    assert same_trace(machine(name, file), effect) == alike


def test_a_twin_without_a_calibration_of_its_own_takes_the_shared_one():
    assert calibration_of("a twin of one's own") == calibration_of("shared") != calibration_of("friction_axis")

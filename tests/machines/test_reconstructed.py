"""The paper's R and k on measured machines."""

from pathlib import Path

import numpy as np
import pytest

from emafault.machines.library import read_cases, stated
from emafault.machines.reconstructed import paper, reconstruct_measured

DATA = Path(__file__).parents[2] / "data" / "measured"


def test_the_recipe_returns_what_an_ideal_machine_was_made_with():
    i = np.linspace(2.0, 20.0, 30)
    w = np.linspace(500.0, 1500.0, 30) ** 0.9
    found = paper("made", 0.006 * w + 0.2 * i, i, w, {"nameplate": 0.005})
    assert found.R == pytest.approx(0.2, rel=1e-9) and found.k == pytest.approx(0.006, rel=1e-9)
    assert found.bias("nameplate") == pytest.approx(0.2)


def test_commutation_is_read_as_resistance_and_a_low_k_by_the_recipe():
    """A drop that grows with w i, as the sweeps show, goes into R and lowers k where load ties i to w."""
    w = np.linspace(600.0, 1700.0, 20)
    i = 25.0 * (w / 1700.0) ** 2
    found = paper("made", 0.006 * w + 0.1 * i + 5e-5 * w * i, i, w, {"truth": 0.006})
    assert found.R > 0.13 and found.bias("truth") < -0.02


def test_the_six_step_drive_disagrees_with_its_plate_and_its_torque():
    cases = read_cases(stated("six_step_bus"), DATA / "bldc_sixstep_esc" / "f40_merged.csv.gz")
    first, second = reconstruct_measured("six_step_bus", cases["f40_merged"], 1600)
    for found in (first, second):
        assert found.bias("nameplate") < -0.15 and found.bias("torque") < -0.15
    # the two instruments' currents put the torque constant on either side of the plate
    assert second.references["torque"] < first.references["nameplate"] < first.references["torque"]


def test_sets_without_what_the_recipe_needs_give_nothing():
    cases = read_cases(stated("six_step_bus"), DATA / "bldc_sixstep_esc" / "f60_kotleta_bench_log.csv.gz")
    assert reconstruct_measured("six_step_bus", next(iter(cases.values()))) == []
    assert reconstruct_measured("back_emf", {}) == []


def test_each_motor_of_the_sweeps_has_an_r_and_k_near_its_plate():
    cases = read_cases(stated("propeller_sweep"), DATA / "bldc_thruststand_sweeps" / "sweeps.csv.gz")
    plate = dict(zip("abdefghjl", (2600, 2500, 2300, 2400, 2350, 2000, 2400, 2400, 2800)))
    bias = [
        reconstruct_measured("propeller_sweep", cases[f"motor {m}"], kv)[0].bias("nameplate") for m, kv in plate.items()
    ]
    assert len(bias) == 9 and np.max(np.abs(bias)) < 0.15

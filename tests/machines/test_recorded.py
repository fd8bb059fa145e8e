"""Recordings of measured machines: what is read, and what is refused in one line; noise of what rows are means of."""

import gzip
from pathlib import Path

import numpy as np
import pytest

from emafault.errors import InputError
from emafault.machines.library import Stated, build, read_cases, stated
from emafault.machines.recorded.slow_rotation import find_pole_pairs_and_slots
from emafault.machines.statistics import mean_variance, smooth_error

DATA = Path(__file__).parents[2] / "data" / "measured"


def cases(name: str, path: Path) -> dict:
    return read_cases(stated(name), path)


def _rewrite(source: Path, target: Path, change) -> Path:
    lines = gzip.decompress(source.read_bytes()).decode("utf-8-sig").splitlines()
    target.write_text("\n".join(change(lines)))
    return target


def test_bad_tables_are_refused_in_one_line(tmp_path):
    source = DATA / "lea_pmsm_temperature/profile24_first60.csv.gz"
    changes = {
        "'u_q' is missing": lambda x: [x[0].replace("u_q", "uq"), *x[1:]],
        "at least 100": lambda x: x[:50],
        "row 200": lambda x: [*x[:200], x[200].replace(x[200].split(",")[1], "x", 1), *x[201:]],
        "line 11": lambda x: [*x[:10], "1,2", *x[10:]],
    }
    for n, (said, change) in enumerate(changes.items()):
        with pytest.raises(InputError, match=said) as refusal:
            cases("dq_machine", _rewrite(source, tmp_path / f"{n}.csv", change))
        assert "\n" not in str(refusal.value)
    with pytest.raises(InputError, match="no known log"):
        cases("six_step_bus", source)
    with pytest.raises(InputError, match="'motor' is missing"):
        cases("propeller_sweep", source)
    with pytest.raises(InputError, match="no such file"):
        cases("dq_machine", tmp_path / "absent.csv")


def test_bad_arrays_are_refused(tmp_path):
    target = tmp_path / "x.npz"
    (tmp_path / "text.npz").write_text("no zip")
    for name in ("back_emf", "slow_rotation", "friction_axis", "induction_currents"):
        with pytest.raises(InputError, match=r"cannot be read as an \.npz"):
            cases(name, tmp_path / "text.npz")
    values = np.ones((3, 1000, 3))
    values[1, 5, 2] = np.nan
    dead = np.random.default_rng(0).standard_normal((400, 3)) * [1, 1, 0]
    for name, said, arrays in (
        ("back_emf", "shape", {"t_a": np.arange(300.0), "v_a": np.ones((300, 2))}),
        ("back_emf", "constant", {"t_a": np.arange(400.0), "v_a": dead}),
        ("friction_axis", "'gtau' is missing", {"t": np.arange(3e3), "qm": np.ones(3000), "vir": np.ones(3000)}),
        ("slow_rotation", "visits 37% of the turn", {"m": np.r_[np.ones(3000), np.zeros(5192)]}),
        ("induction_currents", "finite", {"ITSC_X": values}),
        ("induction_currents", "cannot be read", {"a": np.array([{}], dtype=object)}),
    ):
        np.savez(target, **arrays)
        with pytest.raises(InputError, match=said):
            cases(name, target)


def test_a_folder_gives_the_files_that_the_machine_reads(tmp_path):
    assert set(cases("slow_rotation", DATA / "odrive_cogging")) == {"cogging_maps", "slow_moves"}
    with pytest.raises(InputError, match="no file that twin"):
        cases("friction_axis", tmp_path)
    with pytest.raises(InputError, match="is missing"):
        cases("friction_axis", DATA / "odrive_cogging")


@pytest.mark.parametrize("file", ["f40_merged.csv.gz", "f40_esc32_log.csv.gz", "f60_kotleta_bench_log.csv.gz"])
def test_each_log_of_the_six_step_drive_is_told_by_its_columns(file):
    machine: Stated = stated("six_step_bus")
    for case, arrays in cases("six_step_bus", DATA / "bldc_sixstep_esc" / file).items():
        found = build(machine, case, arrays)
        assert found.explore and found.confirm and not set(found.explore) & set(found.confirm)


def test_one_recording_leaves_nothing_to_hold_out():
    case, arrays = next(iter(cases("back_emf", DATA / "bldc_backemf_scope/backemf.npz").items()))
    name = next(key for key in arrays if key.startswith("t_"))[2:]
    with pytest.raises(InputError, match="hold out"):
        build(stated("back_emf"), case, {key: v for key, v in arrays.items() if key[2:] == name})


def test_pole_pairs_slots_and_the_turned_zero_are_found():
    case, arrays = next(iter(cases("slow_rotation", DATA / "odrive_cogging/cogging_maps.npz").items()))
    notes = build(stated("slow_rotation"), case, arrays).notes
    assert "7 pole pairs, 12 slots" in notes[0] and any("turned by 180" in note for note in notes)
    rng = np.random.default_rng(8)  # noise has neither poles nor slots
    assert all(find_pole_pairs_and_slots(rng.standard_normal(128)) == (7, 12) for _ in range(20))


def test_noise_of_a_mean_counts_autocorrelation():
    rng = np.random.default_rng(5)
    assert mean_variance(rng.standard_normal((4000, 200))).mean() == pytest.approx(1 / 4000, rel=0.15)
    slow, state = np.empty((4000, 200)), np.zeros(200)
    for k in range(4000):
        state = 0.9 * state + rng.standard_normal(200)
        slow[k] = state
    assert mean_variance(slow).mean() == pytest.approx(1 / (4000 * 0.1**2), rel=0.25)


def test_a_smooth_error_has_the_size_that_was_asked_for():
    x, sd = np.linspace(0, 1, 30), np.linspace(1, 2, 30)
    own, shared = smooth_error(x, sd, 0.3)
    covariance = np.diag(own) + shared @ shared.T
    assert np.linalg.eigvalsh(covariance).min() > 0
    np.testing.assert_allclose(np.diag(covariance), sd**2, rtol=1e-4)

"""The bounds that a study writes: that of the recordings lies below that of six features, as far as L0 is known."""

import numpy as np
import pytest

from emafault import config
from emafault.dataset import sample_runs, unit_parameters
from emafault.study.bound import compute_bound, read_bound

FEW = ["sampling.fresh=12", "sampling.shards=1", "evaluation.bound_runs=12"]


def test_the_recordings_tell_more_than_six_features_and_less_where_less_is_known(tmp_path):
    means = {}
    for L in (0.0, 0.03, 0.3):
        spec = config.bound_spec(config.compose("nine_features", [*FEW, f"unit.known.L={L}"]))
        compute_bound(spec, tmp_path / "bound.nc")
        bounds = read_bound(tmp_path / "bound.nc")
        means[L] = bounds["recording"]
    six = bounds["floating"]
    for L, bound in means.items():
        assert np.all(bound[:5] < 0.65 * six[:5]) and bound[5] < six[5], L
    assert np.all(means[0.0] < means[0.03]) and np.all(means[0.03] < means[0.3])
    # L0 counts for the mean of N, which the temperature takes up; a phase against another is told by L alone
    assert means[0.0][5] < 0.95 * means[0.03][5]
    assert means[0.0][3] > 0.95 * means[0.3][3]


def test_only_the_effects_asked_for_spread():
    spec = config.dataset_spec(config.compose("nine_features", FEW), "fresh")
    records = sample_runs(spec).records(slice(None))
    assert np.std(records["inductance_tolerance_L_scale"]) == pytest.approx(0.03, rel=0.6)
    assert np.all(records["unit_calibration_R_scale"] == 1.0) and np.ptp(records["viscous_friction_scale"]) == 0.0
    own = unit_parameters(spec)
    for phase in range(3):
        np.testing.assert_allclose(own[:, 6 + phase], records["inductance"] * records["inductance_tolerance_L_scale"])
    assert np.all(own[:, :3] == spec["actuator"]["resistance"]) and np.all(own[:, 3:6] == spec["actuator"]["back_emf"])


def test_a_unit_that_is_calibrated_has_the_bound_of_both_recordings(tmp_path):
    few = [text.replace("12", "10") for text in FEW]
    means = {}
    for given in ("reference_recordings=1", "reference_recordings=4"):
        spec = config.bound_spec(config.compose("nine_tolerance", [*few, f"unit.{given}"]))
        compute_bound(spec, tmp_path / "bound.nc")
        means[given] = read_bound(tmp_path / "bound.nc")
    one, four = means.values()
    for name in ("floating", "recording"):
        alone, calibrated = one[name], one[f"{name}_calibrated"]
        assert np.all(four[f"{name}_calibrated"] <= calibrated * (1.0 + 1e-9))
        assert calibrated[5] < 0.3 * alone[5] and np.all(calibrated[:3] < 0.4 * alone[:3])
        # what the phases have in common tells no eccentricity
        assert calibrated[3:5] == pytest.approx(alone[3:5], rel=0.01)
        # the ambient temperature's own error stands behind that of a healthy recording
        assert calibrated[5] > 0.5 > four[f"{name}_calibrated"][5]

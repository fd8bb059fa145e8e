"""The bounds that a study writes: that of the recordings lies below that of six features, as far as L0 is known."""

import numpy as np
import pytest

from emafault import config
from emafault.dataset import sample_runs
from emafault.study.evaluation import read_bound
from emafault.study.features import compute_bound

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

"""The Cramer-Rao bound against dense algebra and simple scaling laws."""

import numpy as np
import pytest

from emafault.closed_form import inverse
from emafault.errors import InputError
from emafault.reconstruction.bounds import cramer_rao_bound, feature_covariance
from emafault.reconstruction.features import read_signals
from emafault.reconstruction.noise import NoiseLevels
from emafault.reconstruction.rows import phase_rows
from emafault.reconstruction.weighted import WeightedSettings, sample_choice

from .conftest import ACTUATOR, LEVELS, recordings


@pytest.mark.parametrize("floating", [False, True])
def test_against_the_dense_covariance_of_all_equations(floating):
    signals = {name: values[:1, 1000:1600] for name, values in recordings(2)[2].items()}
    data = read_signals(signals, 2e-4)
    levels = NoiseLevels(0.05, 0.005, 0.02, 0.8)
    choice = sample_choice(WeightedSettings(floating=floating), 2e-4, ACTUATOR)
    rows = [phase_rows(data, data.current_end, 0, j, choice) for j in range(3)]
    beta = np.array([[1.0, 0.037, 3.4e-4, 0.0], [1.1, 0.038, 3.5e-4, 0.0], [1.2, 0.036, 3.6e-4, 0.0]])
    # sensitivity of every equation to every noisy value, one column a value
    total = sum(len(r.V) for r in rows)
    X, M, at = np.zeros((total, 12)), np.zeros((total, 600 * 10)), 0
    for j, r in enumerate(rows):
        for n in range(len(r.V)):
            conducting = not r.floating[n]
            X[at, 4 * j : 4 * j + 4] = r.i[n], r.f[n] * r.w[n], r.didt[n], conducting
            sample = r.index[n]
            M[at, 600 * j + sample] = levels.voltage
            M[at, 600 * 9 + sample] = beta[j, 1] * r.f[n] * levels.speed
            if conducting:
                M[at, 600 * (3 + j) + sample] = beta[j, 0] * levels.current
                M[at, 600 * (6 + j) + sample] = beta[j, 2] / 2e-4 * levels.current_end
                M[at, 600 * (6 + j) + sample - 1] = -beta[j, 2] / 2e-4 * levels.current_end
            at += 1
    dense = np.linalg.inv(X.T @ np.linalg.solve(M @ M.T, X))
    keep = [0, 4, 8, 1, 5, 9]
    got = feature_covariance(data, rows, beta, levels)
    np.testing.assert_allclose(got, dense[np.ix_(keep, keep)], rtol=1e-6, atol=1e-12)


def test_scales_with_noise_and_shrinks_with_samples():
    clean = recordings(2)[2]
    base = cramer_rao_bound(clean, 2e-4, ACTUATOR, LEVELS, {})
    double = cramer_rao_bound(clean, 2e-4, ACTUATOR, {name: 2.0 * value for name, value in LEVELS.items()}, {})
    np.testing.assert_allclose(double.standard_error, 2.0 * base.standard_error, rtol=1e-8)
    more = cramer_rao_bound(clean, 2e-4, ACTUATOR, LEVELS, {"floating": True})
    assert np.all(more.standard_error < base.standard_error)
    np.testing.assert_allclose(base.mean_absolute_error, np.sqrt(2.0 / np.pi) * base.standard_error)


def test_faults_follow_from_features_by_the_inverse():
    """Propagation by derivatives agrees with a sample drawn from the features' covariance."""
    faults, _, clean = recordings(2)
    bound = cramer_rao_bound(clean, 2e-4, ACTUATOR, LEVELS, {})
    from emafault.closed_form import forward

    six = np.concatenate(forward(faults, ACTUATOR), axis=1)[0]
    drawn = np.random.default_rng(0).multivariate_normal(six, bound.features[0], 20000)
    scatter = np.std(inverse(drawn[:, :3], drawn[:, 3:], ACTUATOR), axis=0)
    np.testing.assert_allclose(scatter, bound.standard_error[0], rtol=0.03)


def test_end_currents_and_voltage_noise_are_needed():
    clean = recordings(2)[2]
    with pytest.raises(InputError, match="phase_current_end"):
        cramer_rao_bound({k: v for k, v in clean.items() if k != "phase_current_end"}, 2e-4, ACTUATOR, LEVELS, {})
    with pytest.raises(InputError, match=r"noise.voltage.*0"):
        cramer_rao_bound(clean, 2e-4, ACTUATOR, LEVELS | {"voltage": 0.0}, {})

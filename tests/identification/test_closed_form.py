"""The closed form undoes the fault laws, whatever the magnets, and its derivative is that of finite differences."""

import numpy as np
import pytest

from emafault import closed_form
from emafault.faults import WORKED_EXAMPLE, sample_faults

from .conftest import RANGES

FAULTS = np.vstack([WORKED_EXAMPLE, np.zeros(6), sample_faults(200, seed=3, **RANGES)])


@pytest.mark.parametrize("alpha_m", [0.0, -4e-4, -1.1e-3])
def test_inverse_undoes_forward(actuator, alpha_m):
    R, k = closed_form.forward(FAULTS, actuator, alpha_m)
    np.testing.assert_allclose(closed_form.inverse(R, k, actuator, alpha_m), FAULTS, atol=1e-11)


def test_worked_example_by_hand(actuator):
    R, k = closed_form.forward(np.array([WORKED_EXAMPLE]), actuator)
    assert R[0, 0] == pytest.approx(1.065 * (1 - 0.0375) * (1 + 0.00404 * 4))
    assert k[0, 1] == pytest.approx(0.0376 * (1 - 0.0504) * (1 - 0.0059 / 2 + 2.8e-5 * np.sqrt(3) / 2))


def test_magnets_that_lag_bias_an_inverse_that_assumes_they_do_not(actuator):
    R, k = closed_form.forward(FAULTS, actuator, -1.1e-3, FAULTS[:, 5] - 20.0)
    error = closed_form.inverse(R, k, actuator, -1.1e-3) - FAULTS
    assert np.all(np.abs(error[:, 5]) > 2.0)
    np.testing.assert_allclose(closed_form.inverse(R, k, actuator, -1.1e-3, lag=20.0), FAULTS, atol=1e-11)
    R, k = closed_form.forward(FAULTS, actuator, -1.1e-3, FAULTS[:, 5] - 20.0, "rotor_angle")
    got = closed_form.inverse_rotor_angle(R, k, FAULTS[:, 3:5], actuator, -1.1e-3, lag=20.0)
    np.testing.assert_allclose(got, FAULTS, atol=1e-9)


def test_permuting_phases_permutes_the_turns_and_turns_the_eccentricity(actuator):
    R, k = closed_form.forward(FAULTS, actuator)
    order = [1, 2, 0]
    turned = closed_form.inverse(R[:, order], k[:, order], actuator)
    np.testing.assert_allclose(turned[:, :3], FAULTS[:, order], atol=1e-12)
    np.testing.assert_allclose(turned[:, 5], FAULTS[:, 5], atol=1e-10)
    angle = 2.0 * np.pi / 3.0
    expected = FAULTS[:, 3:5] @ np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    np.testing.assert_allclose(turned[:, 3:5], expected, atol=1e-12)


def test_one_percent_common_error_costs_what_the_sensitivity_says(actuator):
    R, k = closed_form.forward(np.zeros((1, 6)), actuator)
    assert closed_form.inverse(1.01 * R, k, actuator)[0, 5] == pytest.approx(2.5, abs=0.05)
    in_k = closed_form.inverse(R, 1.01 * k, actuator)[0]
    np.testing.assert_allclose(in_k[:3], -0.010, atol=2e-4)
    assert in_k[5] == pytest.approx(-2.5, abs=0.05)


def test_jacobian_is_that_of_central_differences(actuator):
    R, k = closed_form.forward(FAULTS[:5], actuator, -4e-4)
    six = np.hstack([R, k])

    def estimate(x):
        return closed_form.inverse(x[:, :3], x[:, 3:], actuator, -4e-4)

    exact = closed_form.jacobian(estimate, six)
    for j in range(6):
        step = np.zeros(6)
        step[j] = 1e-6 * six[0, j]
        slope = (estimate(six + step) - estimate(six - step)) / (2 * step[j])
        np.testing.assert_allclose(exact[:, :, j], slope, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("alpha_m", [0.0, -4e-4])
def test_rotor_angle_inverse_recovers_faults_and_beats_the_six_feature_form_in_noise(actuator, make_set, alpha_m):
    R, k = closed_form.forward(FAULTS, actuator, alpha_m, eccentricity_law="rotor_angle")
    got = closed_form.inverse_rotor_angle(R, k, FAULTS[:, 3:5], actuator, alpha_m)
    np.testing.assert_allclose(got, FAULTS, atol=1e-9)
    rng = np.random.default_rng(0)
    noise = rng.normal(size=(len(R), 6)) * np.repeat([2e-3, 5e-4], 3)
    six = np.hstack([R, k]) * (1 + noise)
    covariance = np.diag(np.repeat([2e-3, 5e-4], 3) ** 2) * six[:, :, None] * six[:, None, :]
    weighted = closed_form.inverse_rotor_angle(six[:, :3], six[:, 3:], FAULTS[:, 3:5], actuator, alpha_m, covariance)
    plain = closed_form.inverse(six[:, :3], six[:, 3:], actuator, alpha_m)
    assert np.abs(weighted - FAULTS)[:, :3].mean() < 0.8 * np.abs(plain - FAULTS)[:, :3].mean()

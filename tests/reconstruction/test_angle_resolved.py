"""R and k by rotor angle: xi under both rotor-angle laws, exact means of products, the 6n variables."""

import numpy as np
import pytest
from scipy.integrate import quad

from emafault.closed_form import forward
from emafault.errors import InputError
from emafault.reconstruction import reconstruct
from emafault.reconstruction.angle_resolved import harmonic_shapes, overlaps, stretch_centres
from emafault.reconstruction.rows import Rows

from .conftest import ACTUATOR, LEVELS, noisy, recordings

LAWS = ("rotor_angle", "rotor_angle_per_phase")


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("command", ["parabolic", "step", "sine", "reversal"])
@pytest.mark.parametrize("floating", [False, True])
def test_recovers_eccentricity_without_noise(law, command, floating):
    faults, _, signals = recordings(3, command, law=law)
    settings = {"eccentricity_law": law, "floating": floating, "subdivisions": 0}
    features = reconstruct("angle_resolved", signals, 2e-4, ACTUATOR, settings)
    R, k = forward(faults, ACTUATOR, eccentricity_law=law)
    np.testing.assert_allclose(features.extras["xi"], faults[:, 3:5], atol=1e-5)
    np.testing.assert_allclose(features.R, R, rtol=1e-5)
    np.testing.assert_allclose(features.k, k, rtol=1e-5)


def test_errors_of_xi_match_their_covariance():
    batch = recordings(60, seed=7, law="rotor_angle")
    settings = {"noise": LEVELS, "floating": True, "subdivisions": 0}
    features = reconstruct("angle_resolved", noisy(batch), 2e-4, ACTUATOR, settings)
    error = features.extras["xi"] - batch[0][:, 3:5]
    chi2 = np.einsum("ri,rij,rj->r", error, np.linalg.inv(features.extras["xi_covariance"]), error)
    assert 0.7 < np.mean(chi2) / 2.0 < 1.4  # 120 degrees of freedom: 1 +- 0.13
    R, _ = forward(batch[0], ACTUATOR, eccentricity_law="rotor_angle")
    pull = (features.R - R) / features.standard_error[:, :3]
    assert 0.8 < np.sqrt(np.mean(pull**2)) < 1.2


def some_rows(theta, delta, f, df):
    empty = np.zeros(len(theta))
    return Rows(empty.astype(int), empty > 0, empty > 0, empty, empty, empty, empty, f, df, theta, delta)


def test_means_of_products_against_quadrature():
    theta, delta = np.array([0.3, 2.0, -4.0, 1.0]), np.array([0.2, 1e-3, -0.4, 1e-9])
    f, df = np.array([0.5, 1.0, -0.2, 0.7]), np.array([3.0, 0.0, -7.0, 2.0])
    got = harmonic_shapes(some_rows(theta, delta, f, df), 2)
    for row in range(4):
        for n in (1, 2):
            for column, wave in ((2 * n - 1, np.cos), (2 * n, np.sin)):
                half = max(abs(delta[row]), 1e-6)

                def product(u, row=row, n=n, wave=wave):
                    return (f[row] + df[row] * u) * wave(n * (theta[row] + u))

                mean = quad(product, -half, half)[0] / (2 * half)
                assert got[row, column] == pytest.approx(mean, abs=1e-9)


def test_overlaps_share_out_every_interval():
    theta, delta = np.array([0.1, 3.0, -0.05, 6.2]), np.array([0.02, -1.0, 0.1, 0.0])
    share = overlaps(some_rows(theta, delta, theta, theta), 6)
    np.testing.assert_allclose(share.sum(axis=1), 1.0)
    np.testing.assert_allclose(share[0], [1, 0, 0, 0, 0, 0])
    np.testing.assert_allclose(share[2, [0, 5]], [0.25, 0.75])
    np.testing.assert_allclose(share[1, 1:4], [(np.pi * 2 / 3 - 2.0) / 2.0, np.pi / 6, (4.0 - np.pi) / 2.0])
    np.testing.assert_allclose(share[3], [0, 0, 0, 0, 0, 1])


def test_six_n_variables_follow_the_angle():
    n = 12
    faults, _, signals = recordings(3, law="rotor_angle")
    settings = {"subdivisions": n, "noise": LEVELS}
    extras = reconstruct("angle_resolved", signals, 2e-4, ACTUATOR, settings).extras
    R, k = forward(faults, ACTUATOR, eccentricity_law="rotor_angle")
    assert extras["R_theta"].shape == extras["k_theta_error"].shape == (3, 3, n)
    centres = stretch_centres(n)
    g = 1.0 + faults[:, 3:4] * np.cos(centres) + faults[:, 4:5] * np.sin(centres)
    # k_j varies within a stretch of 30 degrees, of which each phase sees a part only: xi times a quarter rad at most
    np.testing.assert_allclose(extras["k_theta"], k[:, :, None] * g[:, None, :], rtol=0.06)
    # and what k_j varies there is in part read as resistance
    np.testing.assert_allclose(extras["R_theta"], np.repeat(R[:, :, None], n, axis=2), rtol=0.12)
    np.testing.assert_allclose(extras["R_theta"].mean(axis=2), R, rtol=0.015)
    healthy = recordings(2)
    extras = reconstruct("angle_resolved", healthy[2], 2e-4, ACTUATOR, settings).extras
    R, k = forward(healthy[0], ACTUATOR)
    np.testing.assert_allclose(extras["k_theta"], np.repeat(k[:, :, None], n, axis=2), rtol=1e-8)
    np.testing.assert_allclose(extras["R_theta"], np.repeat(R[:, :, None], n, axis=2), rtol=1e-7)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"eccentricity_law": "stator_fixed"}, "got 'stator_fixed', 'angle_resolved' accepts rotor_angle"),
        ({"order": 0}, "order: got 0"),
        ({"subdivisions": -1}, "subdivisions: got -1"),
    ],
)
def test_bad_settings_are_refused(settings, said):
    with pytest.raises(InputError) as caught:
        reconstruct("angle_resolved", recordings(3, law="rotor_angle")[2], 2e-4, ACTUATOR, settings)
    assert said in str(caught.value)

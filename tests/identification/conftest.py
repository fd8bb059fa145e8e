"""Features as a reconstruction gives them: the forward laws of sampled faults with correlated Gaussian noise."""

from collections.abc import Callable

import numpy as np
import pytest

from emafault import closed_form
from emafault.actuator.parameters import ActuatorParameters
from emafault.config import reference_actuator
from emafault.faults import sample_faults
from emafault.identification.evaluation import FeatureSet, fault_range

RANGES = {"shorted_turns": (0.0, 0.1), "eccentricity": (0.0, 0.2), "temperature": (-50.0, 70.0)}
#: relative noise of R and k of one phase and their correlation, about that of a plateau fit of one second
NOISE = np.array([[2e-3**2, -0.8 * 2e-3 * 1e-3], [-0.8 * 2e-3 * 1e-3, 1e-3**2]])


@pytest.fixture(scope="session")
def actuator() -> ActuatorParameters:
    return reference_actuator()


@pytest.fixture(scope="session")
def width() -> np.ndarray:
    return fault_range(**RANGES)


@pytest.fixture(scope="session")
def make_set(actuator) -> Callable[..., FeatureSet]:
    """Function of (runs, seed) giving features, truth, covariance and the bound of the closed form's propagation."""

    def make(runs: int, seed: int, noise: float = 1.0, alpha_m: float = 0.0, lag: float = 0.0) -> FeatureSet:
        faults = sample_faults(runs, seed=seed, **RANGES)
        rng = np.random.default_rng([seed, 5])
        dT_magnet = faults[:, 5] - lag * rng.random(runs)
        R, k = closed_form.forward(faults, actuator, alpha_m, dT_magnet)
        draws = noise * rng.normal(size=(runs, 3, 2)) @ np.linalg.cholesky(NOISE).T
        six = np.hstack([R * (1.0 + draws[..., 0]), k * (1.0 + draws[..., 1])])
        relative = np.kron(NOISE, np.eye(3)) * noise**2
        covariance = relative * six[:, :, None] * six[:, None, :]

        def estimate(x: np.ndarray) -> np.ndarray:
            return closed_form.inverse(x[:, :3], x[:, 3:], actuator, alpha_m)

        spread = closed_form.propagate(covariance, closed_form.jacobian(estimate, six))
        return FeatureSet(six, faults, covariance, np.sqrt(np.diagonal(spread, axis1=1, axis2=2)))

    return make


@pytest.fixture(scope="session")
def training(make_set) -> FeatureSet:
    return make_set(600, 1)


@pytest.fixture(scope="session")
def fresh(make_set) -> FeatureSet:
    return make_set(1000, 2)

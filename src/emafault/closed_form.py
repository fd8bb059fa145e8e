"""Closed-form identification: the inverse of the fault laws, the baseline that any network must beat.

Symbols: R_j (ohm) and k_j (V s/rad) are the generalised features, r_j = R_j/R0, q_j = k_j/k0, c = 1 + alpha dT
(copper), m = 1 + alpha_m dT (magnets at the winding's temperature), alpha_j the phase axes (rad, electrical).
"""

from collections.abc import Callable

import numpy as np

from .actuator.parameters import ActuatorParameters

PHASE_AXIS = 2.0 * np.pi / 3.0 * np.arange(3)
#: columns of (xi_x, xi_y) -> g_j - 1 of the ``stator_fixed`` law, (phase, 2)
ECCENTRICITY_AXES = np.stack([np.cos(PHASE_AXIS), np.sin(PHASE_AXIS)], axis=-1)


def forward(
    faults: np.ndarray,
    actuator: ActuatorParameters,
    alpha_m: float = 0.0,
    dT_magnet: np.ndarray | None = None,
    eccentricity_law: str = "stator_fixed",
) -> tuple[np.ndarray, np.ndarray]:
    """Resistances and back-EMF coefficients of given faults (seed paper eq. 8 and the fault laws of docs/study.md).

    Parameters
    ----------
    faults : (run, 6) fault vectors; any leading shape is accepted
    alpha_m : temperature coefficient of the magnets (1/K)
    dT_magnet : (run,) the magnets' deviation from 20 degC (K); None puts them at the winding's temperature
    eccentricity_law : under the rotor-angle laws k_j is the part that does not turn with the rotor, so without xi

    Returns
    -------
    R (run, 3) in ohm, k (run, 3) in V s/rad
    """
    faults = np.asarray(faults)
    N, xi, dT = faults[..., :3], faults[..., 3:5], faults[..., 5]
    magnets = 1.0 + alpha_m * (dT if dT_magnet is None else np.asarray(dT_magnet))
    g = 1.0 + xi @ ECCENTRICITY_AXES.T if eccentricity_law == "stator_fixed" else 1.0
    R = actuator.resistance * (1.0 - N) * (1.0 + actuator.copper_coefficient * dT)[..., None]
    k = actuator.back_emf * (1.0 - N) * g * magnets[..., None]
    return R, k


def inductance(faults: np.ndarray, actuator: ActuatorParameters) -> np.ndarray:
    """Inductances of given faults, L0 (1 - N_j)^2: (run, 6) -> (run, 3) in H."""
    return actuator.inductance * (1.0 - np.asarray(faults)[..., :3]) ** 2


def inverse(
    R: np.ndarray, k: np.ndarray, actuator: ActuatorParameters, alpha_m: float = 0.0, lag: float = 0.0
) -> np.ndarray:
    """Faults from resistances and back-EMF coefficients under ``stator_fixed``, magnets at dT - lag.

    The mean of g_j over the phases is 1, so s = c/m = 3/sum(q_j/r_j); the rest follows phase by phase.

    Parameters
    ----------
    R, k : (run, 3) ohm, V s/rad; any leading shape is accepted
    alpha_m : temperature coefficient of the magnets (1/K)
    lag : by how much the magnets are colder than the winding (K); six features do not tell it, so it is prior
        knowledge

    Returns
    -------
    (run, 6) fault vectors
    """
    r, q = np.asarray(R) / actuator.resistance, np.asarray(k) / actuator.back_emf
    alpha = actuator.copper_coefficient
    s = 3.0 / np.sum(q / r, axis=-1)
    dT = (s * (1.0 - alpha_m * lag) - 1.0) / (alpha - s * alpha_m)
    N = 1.0 - r / (1.0 + alpha * dT)[..., None]
    z = q / ((1.0 - N) * (1.0 + alpha_m * (dT - lag))[..., None])
    xi = 2.0 / 3.0 * (z - 1.0) @ ECCENTRICITY_AXES
    return np.concatenate([N, xi, dT[..., None]], axis=-1)


def inverse_rotor_angle(
    R: np.ndarray,
    k: np.ndarray,
    xi: np.ndarray,
    actuator: ActuatorParameters,
    alpha_m: float = 0.0,
    covariance: np.ndarray | None = None,
    lag: float = 0.0,
) -> np.ndarray:
    """Faults from angle-resolved features, where xi is measured by itself and k_j = k0 (1 - N_j) m carries none of it.

    Six features then fix four unknowns; generalised least squares in log R, log k about the closed-form start.

    Parameters
    ----------
    R, k : (run, 3) ohm, V s/rad, k the part of the coefficient that does not turn with the rotor
    xi : (run, 2) static eccentricity (1)
    covariance : (run, 6, 6) of [R, k] (SI); without it equal relative errors are assumed
    lag : as in :func:`inverse`

    Returns
    -------
    (run, 6) fault vectors
    """
    R, k, alpha = np.asarray(R, float), np.asarray(k, float), actuator.copper_coefficient
    six = np.concatenate([R, k], axis=-1)
    y = np.log(six / np.repeat([actuator.resistance, actuator.back_emf], 3))
    if covariance is None or not np.all(np.isfinite(covariance)):
        weight = np.broadcast_to(np.eye(6), (*six.shape, 6))
    else:
        weight = np.linalg.inv(covariance / (six[..., :, None] * six[..., None, :]))
    start = inverse(R, k, actuator, alpha_m, lag)
    n, dT = np.log1p(-start[..., :3]), start[..., 5]
    design = np.zeros((*six.shape, 4))
    design[..., :3] = np.tile(np.eye(3), (2, 1))
    for _ in range(3):  # linear but for log c and log m in dT
        c, m = 1.0 + alpha * dT, 1.0 + alpha_m * (dT - lag)
        design[..., :3, 3], design[..., 3:, 3] = (alpha / c)[..., None], (alpha_m / m)[..., None]
        residual = y - np.concatenate([n + np.log(c)[..., None], n + np.log(m)[..., None]], axis=-1)
        normal = np.swapaxes(design, -1, -2) @ weight
        step = np.linalg.solve(normal @ design, normal @ residual[..., None])[..., 0]
        n, dT = n + step[..., :3], dT + step[..., 3]
    return np.concatenate([-np.expm1(n), np.asarray(xi, float), dT[..., None]], axis=-1)


def jacobian(function: Callable[[np.ndarray], np.ndarray], x: np.ndarray) -> np.ndarray:
    """Derivative of a vectorised analytic function by the complex step, exact to rounding.

    Parameters
    ----------
    function : (run, input) -> (run, output), written without taking real parts or absolute values
    x : (run, input)

    Returns
    -------
    (run, output, input)
    """
    columns = []
    for j in range(x.shape[-1]):
        shifted = x.astype(complex)
        shifted[..., j] += 1e-30j
        columns.append(function(shifted).imag / 1e-30)
    return np.stack(columns, axis=-1)


def propagate(covariance: np.ndarray, derivative: np.ndarray) -> np.ndarray:
    """Covariance of the estimates, (run, output, output), from that of the features and the estimator's derivative."""
    return derivative @ covariance @ np.swapaxes(derivative, -1, -2)

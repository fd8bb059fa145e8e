"""Faults from nine coefficients: Gauss-Newton on the fault laws with what is known beforehand as a likelihood.

In logarithms the laws are sums, r_j = R_j/R0, q_j = k_j/k0, l_j = L_j/L0 (symbols as in ``closed_form``):

    log r_j = log(1 - N_j) + log(1 + alpha dT)
    log q_j = log(1 - N_j) + log(1 + xi . axis_j) + log(1 + alpha_m (dT - lag))
    log l_j = 2 log(1 - N_j)

Nothing is known beforehand of N, xi and dT. R0, k0 and L0 of the unit are known to a covariance, which is added to the
noise's; the magnets' lag is a seventh unknown with a Gaussian prior. Nine data and, with the prior of the lag, one more
leave three degrees of freedom, whose misfit tells whether any fault of the unit explains the coefficients. Where none
does, every coefficient is given a relative error of one size beside its noise, such that the misfit is what it should
be (Paule and Mandel, J. Res. Natl. Bur. Stand. 87, 1982, 377).
"""

from dataclasses import dataclass

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..closed_form import ECCENTRICITY_AXES, forward, inductance, inverse
from ..errors import InputError

STEPS = 6  # of Gauss-Newton; from the closed form two change nothing but the last digits
FREEDOM = 3  # degrees of freedom of the misfit
CHANCE = 1e-4  # of a misfit, or of a phase's lack of fit, that is still taken for noise
LARGEST_ERROR = 1.0  # of a coefficient, that is looked for
HALVINGS = 40
LEAST_SHARE = 0.02  # of its turns that a phase keeps, and of its nominal value that resistance or flux keeps


@dataclass(frozen=True)
class Knowledge:
    """What is known of a unit and its magnets beforehand; standard deviations, 0 where it is exactly known."""

    R: float = 0.0  # relative, of R0, which the phases have in common
    k: float = 0.0
    L: float = 0.0
    lag: float = 0.0  # K, expected, of the magnets behind the winding
    lag_deviation: float = 0.0  # K

    def covariance(self) -> np.ndarray:
        """(9, 9) relative covariance of R0, k0 and L0 of phases a, b, c."""
        return np.kron(np.diag([self.R, self.k, self.L]) ** 2, np.ones((3, 3)))


@dataclass(frozen=True)
class Posterior:
    """Estimates of a batch of runs."""

    faults: np.ndarray  # (run, 6)
    covariance: np.ndarray  # (run, 6, 6)
    misfit: np.ndarray  # (run,) chi-squared with FREEDOM degrees of freedom where the laws hold


def nominal_nine(actuator: ActuatorParameters) -> np.ndarray:
    """(9,) R0, k0 and L0 of phases a, b, c of the nominal actuator."""
    return np.repeat([actuator.resistance, actuator.back_emf, actuator.inductance], 3)


def nine_forward(
    faults: np.ndarray, actuator: ActuatorParameters, alpha_m: float = 0.0, dT_magnet: np.ndarray | None = None
) -> np.ndarray:
    """(run, 9) R, k and L of given faults (run, 6); arguments as of ``closed_form.forward``."""
    return np.concatenate([*forward(faults, actuator, alpha_m, dT_magnet), inductance(faults, actuator)], axis=-1)


def laws(x: np.ndarray, alpha: float, alpha_m: float) -> tuple[np.ndarray, np.ndarray]:
    """(run, 9) logarithms over nominal and their derivatives (run, 9, 7) at N, xi, dT, lag (run, 7)."""
    left = np.maximum(1.0 - x[:, :3], LEAST_SHARE)
    c = np.maximum(1.0 + alpha * x[:, 5], LEAST_SHARE)
    m = np.maximum(1.0 + alpha_m * (x[:, 5] - x[:, 6]), LEAST_SHARE)
    g = np.maximum(1.0 + x[:, 3:5] @ ECCENTRICITY_AXES.T, LEAST_SHARE)
    n = np.log(left)
    value = np.concatenate([n + np.log(c)[:, None], n + np.log(g) + np.log(m)[:, None], 2.0 * n], axis=1)
    J = np.zeros((len(x), 9, 7))
    for j in range(3):
        J[:, j, j] = J[:, 3 + j, j] = -1.0 / left[:, j]
        J[:, 6 + j, j] = -2.0 / left[:, j]
        J[:, 3 + j, 3:5] = ECCENTRICITY_AXES[j] / g[:, j, None]
    J[:, :3, 5], J[:, 3:6, 5], J[:, 3:6, 6] = (alpha / c)[:, None], (alpha_m / m)[:, None], (-alpha_m / m)[:, None]
    return value, J


def posterior(
    nine: np.ndarray, covariance: np.ndarray, actuator: ActuatorParameters, alpha_m: float, known: Knowledge
) -> Posterior:
    """Faults of runs from their nine coefficients.

    Parameters
    ----------
    nine : (run, 9) R (ohm), k (V s/rad) and L (H) of phases a, b, c
    covariance : (run, 9, 9) of them (SI), with what is not known of R0, k0 and L0 added
    alpha_m : temperature coefficient of the magnets (1/K)
    known : of which the lag's expectation and standard deviation are read

    Raises
    ------
    InputError : a coefficient that is not positive
    """
    if np.any(nine <= 0.0):
        row, column = np.argwhere(nine <= 0.0)[0]
        name = [f"{quantity}_{phase}" for quantity in "RkL" for phase in "abc"][column]
        raise InputError(f"features: {name} of run {row} is {nine[row, column]:.4g}, accepted are values above 0")
    y = np.log(nine / nominal_nine(actuator))
    weight = np.linalg.inv(covariance / (nine[:, :, None] * nine[:, None, :]))
    x = np.zeros((len(nine), 7))
    x[:, :6] = inverse(nine[:, :3], nine[:, 3:6], actuator, alpha_m, known.lag)
    x[:, 6] = known.lag
    free = 7 if alpha_m and known.lag_deviation else 6
    prior = np.zeros(free)
    if free == 7:
        prior[6] = known.lag_deviation**-2
    for _ in range(STEPS):
        value, J = laws(x, actuator.copper_coefficient, alpha_m)
        J = J[:, :, :free]
        left, score = y - value, np.swapaxes(J, 1, 2) @ weight
        normal = score @ J + np.diag(prior)
        pull = (score @ left[:, :, None])[:, :, 0] - prior * (x[:, :free] - known.lag * (np.arange(free) == 6))
        scale = np.sqrt(np.diagonal(normal, axis1=1, axis2=2))
        inverse_normal = np.linalg.inv(normal / (scale[:, :, None] * scale[:, None, :]))
        spread = inverse_normal / (scale[:, :, None] * scale[:, None, :])
        x[:, :free] += (spread @ pull[:, :, None])[:, :, 0]
    value, _ = laws(x, actuator.copper_coefficient, alpha_m)
    left = y - value
    misfit = np.einsum("ni,nij,nj->n", left, weight, left)
    if free == 7:
        misfit += prior[6] * (x[:, 6] - known.lag) ** 2
    return Posterior(x[:, :6], spread[:, :6, :6], misfit)


def model_error(
    nine: np.ndarray, covariance: np.ndarray, actuator: ActuatorParameters, alpha_m: float, known: Knowledge
) -> np.ndarray:
    """(run,) relative error of each coefficient that brings the misfit down to its mean, 0 where noise explains it.

    Arguments are those of :func:`posterior`.
    """
    from scipy.special import chdtri

    found = posterior(nine, covariance, actuator, alpha_m, known)
    out = np.zeros(len(nine))
    off = np.flatnonzero(found.misfit > chdtri(FREEDOM, CHANCE))
    y, noise = nine[off], covariance[off]
    low, high = np.zeros(len(off)), np.full(len(off), LARGEST_ERROR)
    for _ in range(HALVINGS if len(off) else 0):
        middle = 0.5 * (low + high)
        wider = noise + np.eye(9) * ((middle[:, None] * y) ** 2)[:, None, :]
        too_small = posterior(y, wider, actuator, alpha_m, known).misfit > FREEDOM
        low, high = np.where(too_small, middle, low), np.where(too_small, high, middle)
    out[off] = high
    return out

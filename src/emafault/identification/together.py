"""One fault from several recordings of one unit: the product of their likelihoods, what the unit is off by shared.

N and xi are those of the unit, each recording has a winding temperature of its own (and a lag of the magnets, where
they have a temperature coefficient). With the laws of ``posterior`` in logarithms,

    log (coefficients of recording r / nominal) = laws(N, xi, dT_r, lag_r) + B u + noise_r

where B B' is the relative covariance to which the unit is known, by its tolerance or by its healthy recordings, and u
has a standard Gaussian prior: what is not known of the unit does not average out over its recordings.
"""

from dataclasses import dataclass

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..closed_form import inverse
from ..errors import InputError
from .posterior import STEPS, Knowledge, laws, nominal_nine

SHARED = 5  # unknowns that the recordings have in common: N and xi


@dataclass(frozen=True)
class Joint:
    """Estimate of several recordings of one unit; N and xi are the same in every row."""

    faults: np.ndarray  # (recording, 6)
    covariance: np.ndarray  # (recording, 6, 6)
    misfit: float  # chi-squared with ``freedom`` degrees of freedom where one fault explains all recordings
    freedom: int
    shares: np.ndarray  # (recording,) of the misfit


def together(
    features: np.ndarray,
    covariance: np.ndarray,
    actuator: ActuatorParameters,
    alpha_m: float,
    known: Knowledge,
    unit: np.ndarray | None = None,
    unit_covariance: np.ndarray | None = None,
) -> Joint:
    """The fault of one unit from the coefficients of its recordings.

    Parameters
    ----------
    features : (recording, 6) R (ohm) and k (V s/rad) of phases a, b, c, or (recording, 9) with L (H) behind them
    covariance : (recording, width, width) of their noise alone (SI)
    alpha_m : temperature coefficient of the magnets (1/K)
    known : what is known of the unit and the lag beforehand
    unit, unit_covariance : (width,) and (width, width) of the healthy unit at the reference temperature, as of
        ``calibrate``; None takes what is ``known`` about the nominal one

    Raises
    ------
    InputError : a coefficient that is not positive
    """
    n, width = features.shape
    if np.any(features <= 0.0):
        row = int(np.argwhere(features <= 0.0)[0, 0])
        raise InputError(f"features: recording {row} has a coefficient below 0, accepted are values above 0")
    healthy = nominal_nine(actuator)[:width] if unit is None else np.asarray(unit, float)
    if unit is None:
        shared = known.covariance()[:width, :width]
    else:
        shared = np.zeros((width, width)) if unit_covariance is None else unit_covariance / np.outer(healthy, healthy)
    y = np.log(features / healthy)
    weight = np.linalg.inv(covariance / (features[:, :, None] * features[:, None, :]))
    B = _root(shared)
    lags = bool(alpha_m and known.lag_deviation)
    x = np.full((n, 7), known.lag)
    at_nominal = features * nominal_nine(actuator)[:width] / healthy
    x[:, :6] = inverse(at_nominal[:, :3], at_nominal[:, 3:6], actuator, alpha_m, known.lag)
    x[:, :SHARED] = np.mean(x[:, :SHARED], axis=0)
    u, k = np.zeros(B.shape[1]), B.shape[1]
    first = SHARED + k  # of the unknowns of recordings
    size = first + n * (2 if lags else 1)
    prior = np.zeros(size)
    prior[SHARED:first] = 1.0
    prior[first + n :] = known.lag_deviation**-2 if lags else 0.0
    for _ in range(STEPS):
        value, J = laws(x, actuator.copper_coefficient, alpha_m)
        left = y - value[:, :width] - B @ u
        common = np.concatenate([J[:, :width, :SHARED], np.broadcast_to(B, (n, width, k))], axis=2)
        own = J[:, :width, 5 : 7 if lags else 6]
        normal, pull = np.diag(prior), np.zeros(size)
        score = np.swapaxes(common, 1, 2) @ weight
        normal[:first, :first] += np.sum(score @ common, axis=0)
        pull[:first] = np.sum(score @ left[..., None], axis=0)[:, 0]
        cross, inner = score @ own, np.swapaxes(own, 1, 2) @ weight
        for r in range(n):
            at = first + r + n * np.arange(own.shape[2])
            normal[:first, at] += cross[r]
            normal[at, :first] += cross[r].T
            normal[np.ix_(at, at)] += inner[r] @ own[r]
            pull[at] += inner[r] @ left[r]
        pull[SHARED:first] -= u
        if lags:
            pull[first + n :] -= prior[first + n :] * (x[:, 6] - known.lag)
        scale = np.sqrt(np.diagonal(normal))
        spread = np.linalg.inv(normal / np.outer(scale, scale)) / np.outer(scale, scale)
        step = spread @ pull
        x[:, :SHARED] += step[:SHARED]
        u = u + step[SHARED:first]
        x[:, 5] += step[first : first + n]
        if lags:
            x[:, 6] += step[first + n :]
    value, _ = laws(x, actuator.copper_coefficient, alpha_m)
    left = y - value[:, :width] - B @ u
    shares = np.einsum("ni,nij,nj->n", left, weight, left)
    if lags:
        shares = shares + ((x[:, 6] - known.lag) / known.lag_deviation) ** 2
    kept = [np.r_[0:SHARED, first + r] for r in range(n)]
    own_spread = np.stack([spread[np.ix_(rows, rows)] for rows in kept])
    return Joint(x[:, :6], own_spread, float(np.sum(shares) + u @ u), n * (width - 1) - SHARED, shares)


def _root(covariance: np.ndarray) -> np.ndarray:
    """(width, rank) B with B B' the covariance, which may be singular."""
    values, vectors = np.linalg.eigh(covariance)
    kept = values > 1e-12 * max(float(values[-1]), 1e-300)
    return vectors[:, kept] * np.sqrt(values[kept])

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
    at_nominal = features * nominal_nine(actuator)[:width] / healthy
    alone = inverse(at_nominal[:, :3], at_nominal[:, 3:6], actuator, alpha_m, known.lag)

    lags = bool(alpha_m and known.lag_deviation)
    k = B.shape[1]
    first = SHARED + k  # of the unknowns that each recording has of its own
    of_u = slice(SHARED, first)
    unknown = np.concatenate(
        [np.mean(alone[:, :SHARED], axis=0), np.zeros(k), alone[:, 5], np.full(n if lags else 0, known.lag)]
    )
    mean, precision = np.zeros(len(unknown)), np.zeros(len(unknown))
    precision[of_u] = 1.0
    if lags:
        mean[first + n :], precision[first + n :] = known.lag, known.lag_deviation**-2
    for _ in range(STEPS):
        value, J = laws(_by_recording(unknown, first, n, known.lag), actuator.copper_coefficient, alpha_m)
        left = y - value[:, :width] - B @ unknown[of_u]
        common = np.concatenate([J[:, :width, :SHARED], np.broadcast_to(B, (n, width, k))], axis=2)
        information, score = _normal_equations(common, J[:, :width, 5 : 7 if lags else 6], weight, left)
        information += np.diag(precision)
        scale = np.sqrt(np.diagonal(information))
        spread = np.linalg.inv(information / np.outer(scale, scale)) / np.outer(scale, scale)
        unknown = unknown + spread @ (score - precision * (unknown - mean))
    x, u = _by_recording(unknown, first, n, known.lag), unknown[of_u]
    value, _ = laws(x, actuator.copper_coefficient, alpha_m)
    left = y - value[:, :width] - B @ u
    shares = np.einsum("ni,nij,nj->n", left, weight, left)
    if lags:
        shares = shares + ((x[:, 6] - known.lag) / known.lag_deviation) ** 2
    kept = [np.r_[0:SHARED, first + r] for r in range(n)]
    own_spread = np.stack([spread[np.ix_(rows, rows)] for rows in kept])
    return Joint(x[:, :6], own_spread, float(np.sum(shares) + u @ u), n * (width - 1) - SHARED, shares)


def _by_recording(unknown: np.ndarray, first: int, n: int, lag: float) -> np.ndarray:
    """(recording, 7) N, xi, dT and lag; the lag is a given one where it is not among the unknowns."""
    x = np.full((n, 7), lag)
    x[:, :SHARED] = unknown[:SHARED]
    x[:, 5] = unknown[first : first + n]
    if len(unknown) > first + n:
        x[:, 6] = unknown[first + n :]
    return x


def _normal_equations(
    common: np.ndarray, own: np.ndarray, weight: np.ndarray, left: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Information and score of the unknowns that recordings have in common and, behind them, of each one's own.

    Parameters
    ----------
    common, own : (recording, width, unknown) derivatives of the data; of the own unknowns the first of all recordings
        comes before the second of all
    weight : (recording, width, width) inverse covariance of the data
    left : (recording, width) residual
    """
    n, first, each = len(own), common.shape[2], own.shape[2]
    size = first + n * each
    information, score = np.zeros((size, size)), np.zeros(size)
    weighted, own_weighted = np.swapaxes(common, 1, 2) @ weight, np.swapaxes(own, 1, 2) @ weight
    information[:first, :first] = np.sum(weighted @ common, axis=0)
    score[:first] = np.sum(weighted @ left[..., None], axis=0)[:, 0]
    cross = weighted @ own
    for r in range(n):
        at = first + r + n * np.arange(each)
        information[:first, at] = cross[r]
        information[at, :first] = cross[r].T
        information[np.ix_(at, at)] = own_weighted[r] @ own[r]
        score[at] = own_weighted[r] @ left[r]
    return information, score


def _root(covariance: np.ndarray) -> np.ndarray:
    """(width, rank) B with B B' the covariance, which may be singular."""
    values, vectors = np.linalg.eigh(covariance)
    kept = values > 1e-12 * max(float(values[-1]), 1e-300)
    return vectors[:, kept] * np.sqrt(values[kept])

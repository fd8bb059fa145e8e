"""Cramer-Rao bounds: the physical limits beside the errors of any reconstruction and estimator.

That of six features leaves L free a phase: it bounds what R and k of chosen samples tell of the faults. That of the
recordings themselves is the information of all their intervals about R, k and L together.

The first follows from the voltage-current-speed equations alone, with R, k, L and offset of each phase free: twelve
unknowns, the noise-free samples as regressors, and the whole noise covariance of the equations: end currents shared by
neighbouring samples of a phase, and speed shared by the phases. (True currents and speeds as unknowns of their own,
measured with their noise, give the same information.) Knowledge of the temperature or of how faults are distributed
is not in it; that the currents sum to zero would change it by less than 1 %.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solveh_banded

from ..actuator.parameters import ActuatorParameters
from ..closed_form import inverse, jacobian, propagate
from ..errors import InputError
from .features import Signals, check_number, read_settings, read_signals
from .least_squares import CURRENT, EMF, design, row_variance
from .nine import NineSettings, information, nine_of, read_record, reconstruct_nine
from .noise import NoiseLevels, stated_noise
from .rows import Rows, phase_rows
from .weighted import WeightedSettings, check_settings, reconstruct_weighted, sample_choice

BAND = 3  # rows that share noise are at most so far apart when ordered by time and phase


@dataclass(frozen=True)
class Bound:
    """Smallest covariance that an unbiased estimate can have."""

    features: np.ndarray  # (run, 6, 6) of [R_a, R_b, R_c, k_a, k_b, k_c]
    faults: np.ndarray  # (run, 6, 6)

    @property
    def standard_error(self) -> np.ndarray:
        """(run, 6) of the faults."""
        return np.sqrt(np.diagonal(self.faults, axis1=1, axis2=2))

    @property
    def mean_absolute_error(self) -> np.ndarray:
        """(run, 6) mean absolute error of a Gaussian estimate at the bound, sqrt(2/pi) standard errors."""
        return np.sqrt(2.0 / np.pi) * self.standard_error


def cramer_rao_bound(
    signals: Mapping[str, np.ndarray],
    interval: float,
    actuator: ActuatorParameters,
    noise: Mapping[str, float],
    settings: Mapping,
    alpha_m: float = 0.0,
) -> Bound:
    """Bound for recordings as they are without noise.

    Parameters
    ----------
    signals : noise-free recorded signals, as from ``simulate``
    noise : standard deviations ``voltage``, ``current``, ``current_end``, ``speed`` (SI)
    settings : those of ``weighted``, which choose the samples (``floating`` among them)
    alpha_m : temperature coefficient of magnets at the winding's temperature (1/K)

    Raises
    ------
    InputError : signals without end currents, or an impossible setting
    """
    data, levels = _noise_free(signals, interval, noise)
    assert data.current_end is not None
    s = read_settings(WeightedSettings, {**settings, "noise": noise}, "bound")
    check_settings(s, "bound")
    choice = sample_choice(s, interval, actuator)
    truth = reconstruct_weighted(data, actuator, settings={**settings, "noise": noise})
    covariance = np.full((data.runs, 6, 6), np.nan)
    for run in np.flatnonzero(truth.identified).tolist():
        rows = [phase_rows(data, data.current_end, run, j, choice) for j in range(3)]
        beta = np.stack([truth.R[run], truth.k[run], truth.L[run], truth.offset[run]], axis=1)
        covariance[run] = feature_covariance(data, rows, beta, levels)
    derivative = jacobian(lambda x: inverse(x[..., :3], x[..., 3:], actuator, alpha_m), truth.six)
    return Bound(covariance, propagate(covariance, derivative))


def _noise_free(
    signals: Mapping[str, np.ndarray], interval: float, noise: Mapping[str, float]
) -> tuple[Signals, NoiseLevels]:
    """Signals with end currents, and the levels of the noise that a bound is told of.

    Raises
    ------
    InputError : signals without end currents, or an impossible level
    """
    data = read_signals(signals, interval)
    if data.current_end is None:
        raise InputError("phase_current_end: missing among the signals, the bound needs it")
    check_number("bound", "noise.voltage", float(noise["voltage"]), 1e-9)
    return data, stated_noise(noise)


def feature_covariance(data: Signals, rows: list[Rows], beta: np.ndarray, noise: NoiseLevels) -> np.ndarray:
    """(6, 6) inverse information of [R, k] of one run; ``beta`` (phase, 4) true R, k, L, offset."""
    counts = [len(r.V) for r in rows]
    order = np.argsort(np.concatenate([3 * r.index + j for j, r in enumerate(rows)]))
    total = sum(counts)
    X, emf = np.zeros((total, 12)), np.empty(total)
    variance, linked, coupling = np.empty(total), np.zeros(total, bool), np.empty(total)
    start = 0
    for j, r in enumerate(rows):
        part = slice(start, start + counts[j])
        X[part, 4 * j : 4 * j + 4], D = design(r, r.f[:, None])
        emf[part] = D @ beta[j]
        variance[part], coupling[part] = row_variance(r, emf[part], beta[j], noise, data.interval)
        linked[part] = r.linked
        start += counts[j]
    time = np.concatenate([r.index for r in rows])[order]
    phase = np.repeat(np.arange(3), counts)[order]
    emf, linked, coupling = emf[order], linked[order], coupling[order]
    band = np.zeros((BAND + 1, total))
    band[0] = variance[order]
    for distance in range(1, BAND + 1):
        a, b = slice(None, -distance), slice(distance, None)
        together = time[a] == time[b]
        shared_end = (time[b] - time[a] == 1) & (phase[a] == phase[b]) & linked[b]
        band[distance, :-distance] = np.where(together, emf[a] * emf[b] * noise.speed**2, 0.0)
        band[distance, :-distance] += np.where(shared_end, coupling[b], 0.0)
    information = X[order].T @ solveh_banded(band, X[order], lower=True, check_finite=False)
    keep = [4 * j + CURRENT for j in range(3)] + [4 * j + EMF for j in range(3)]
    scale = np.sqrt(np.diagonal(information))
    covariance = np.linalg.inv(information / np.outer(scale, scale)) / np.outer(scale, scale)
    return covariance[np.ix_(keep, keep)]


def nine_bound(
    signals: Mapping[str, np.ndarray],
    interval: float,
    actuator: ActuatorParameters,
    noise: Mapping[str, float],
    settings: Mapping,
) -> np.ndarray:
    """Smallest covariance of [R, k, L] that an unbiased estimate from all intervals of a recording can have.

    It follows from the mean voltage equations of every interval, the sum of currents and the zero current of floating
    phases, with the noise-free signals as regressors and c_j free. Speeds count as exactly known, which lowers the
    standard errors by at most 2.5 %; the torque's equation, in which k stands too, is not in it.

    Parameters
    ----------
    signals : noise-free recorded signals, as from ``simulate``
    noise : standard deviations ``voltage``, ``current``, ``current_end``, ``speed`` (SI)
    settings : those of ``nine``

    Returns
    -------
    (run, 9, 9), NaN where a run leaves an unknown undetermined

    Raises
    ------
    InputError : signals without end currents, or an impossible setting
    """
    data, levels = _noise_free(signals, interval, noise)
    s = read_settings(NineSettings, settings, "bound")
    truth = reconstruct_nine(data, actuator, {**settings, "noise": noise})
    covariance = np.full((data.runs, 9, 9), np.nan)
    for run in np.flatnonzero(truth.identified).tolist():
        record = read_record(data, run, actuator, s)
        if record is not None:
            beta = np.stack([truth.R[run], truth.k[run], truth.L[run], truth.offset[run]])
            rate = float(truth.extras["heating_rate"][run]) if s.heating else 0.0
            covariance[run] = nine_of(information(record, beta, rate, levels))
    return covariance

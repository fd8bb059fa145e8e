"""Back-EMF coefficients and resistances that depend on the rotor angle.

Harmonic form, per phase: V = R i + k f (1 + sum_n c_n cos n theta + s_n sin n theta) w + L di/dt + offset, the means
of the products over each interval's angle being exact. Under the laws ``rotor_angle`` and ``rotor_angle_per_phase`` the
first harmonic is the static eccentricity, turned by the phase axis under the latter.

By rotor angle: the seed paper's 6n variables, R_j and k_j constant in each of n equal stretches of mechanical angle.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..closed_form import PHASE_AXIS
from ..errors import InputError
from .features import Features, Signals, check_number, read_settings
from .least_squares import EMF, PhaseFit, is_singular, row_variance, whiten
from .noise import NoiseLevels
from .rows import Rows
from .weighted import WeightedSettings, check_settings, fit_runs

LAWS = ("rotor_angle", "rotor_angle_per_phase")
FEWEST_SAMPLES = 10  # in a stretch of angle, for its two variables to be estimated


@dataclass(frozen=True)
class AngleResolvedSettings(WeightedSettings):
    """Settings of ``angle_resolved``: those of ``weighted`` and three more."""

    eccentricity_law: str = "rotor_angle"  # how the first harmonic is read as xi
    order: int = 1  # highest harmonic of k_j(theta)
    subdivisions: int = 12  # n of the 6n variables; 0 leaves them out


def harmonic_shapes(rows: Rows, order: int) -> np.ndarray:
    """(row, 1 + 2 order) means over each interval's angle of f, f cos theta, f sin theta, f cos 2 theta, ..."""
    out = np.empty((len(rows.f), 1 + 2 * order))
    out[:, 0] = rows.f
    for n in range(1, order + 1):
        u = n * rows.delta
        small = np.abs(u) < 1e-2
        safe = np.where(small, 1.0, u)
        level = np.where(small, 1.0 - u * u / 6.0 + u**4 / 120.0, np.sin(safe) / safe)
        lever = np.where(small, u * u / 3.0 - u**4 / 30.0, np.sin(safe) / safe - np.cos(safe)) / n * rows.df
        c, s = np.cos(n * rows.theta), np.sin(n * rows.theta)
        out[:, 2 * n - 1] = rows.f * c * level - lever * s
        out[:, 2 * n] = rows.f * s * level + lever * c
    return out


def eccentricity(fits: list[PhaseFit], law: str) -> tuple[np.ndarray, np.ndarray]:
    """xi (2,) and its covariance (2, 2): weighted mean of the phases' first harmonics, turned to a common axis."""
    information, total = np.zeros((2, 2)), np.zeros(2)
    for j, fit in enumerate(fits):
        k, harmonic = fit.beta[EMF], fit.beta[4:6]
        J = np.zeros((2, len(fit.beta)))
        J[:, EMF], J[:, 4:6] = -harmonic / k**2, np.eye(2) / k
        axis = PHASE_AXIS[j] if law == "rotor_angle_per_phase" else 0.0
        # cos(theta - axis), sin(theta - axis) in terms of cos theta, sin theta
        turn = np.array([[np.cos(axis), np.sin(axis)], [-np.sin(axis), np.cos(axis)]])
        J = turn @ J
        weight = np.linalg.inv(J @ fit.covariance @ J.T)
        information += weight
        total += weight @ (turn @ harmonic / k)
    covariance = np.linalg.inv(information)
    return covariance @ total, covariance


def overlaps(rows: Rows, n: int) -> np.ndarray:
    """(row, n) share of each interval's angle that lies in each of n equal stretches of a turn."""
    edges = 2.0 * np.pi / n
    low, high = (rows.theta - np.abs(rows.delta)) / edges, (rows.theta + np.abs(rows.delta)) / edges
    high = np.maximum(high, low + 1e-9)  # at standstill the whole sample counts where the rotor stands
    out = np.zeros((len(low), n))
    every = np.arange(len(low))
    first = np.floor(low).astype(int)
    for step in range(int(np.max(np.floor(high) - first, initial=0)) + 1):
        stretch = first + step
        share = np.clip(np.minimum(high, stretch + 1) - np.maximum(low, stretch), 0.0, None) / (high - low)
        np.add.at(out, (every, stretch % n), share)
    return out


def by_stretch(rows: Rows, fit: PhaseFit, noise: NoiseLevels, interval: float, n: int) -> np.ndarray:
    """(4, n) R (ohm), k (V s/rad) and their standard errors in each stretch; NaN in one without samples."""
    share = overlaps(rows, n)
    known = np.flatnonzero(np.sum(share[~rows.floating], axis=0) >= FEWEST_SAMPLES)
    share = share[:, known]
    m = len(known)
    emf = fit.beta[EMF] * rows.f
    variance, coupling = row_variance(rows, emf, fit.beta, noise, interval)
    x_R, x_k = share * rows.i[:, None], share * (rows.w * rows.f)[:, None]
    X = np.column_stack([x_R, x_k, rows.didt, ~rows.floating, rows.V])
    whitened, d, _ = whiten(np.ascontiguousarray(X, float), variance, rows.linked, coupling)
    scaled = whitened / np.sqrt(d)[:, None]
    gram = scaled.T @ scaled
    out = np.full((4, n), np.nan)
    if m and not is_singular(gram[:-1, :-1]):
        covariance = np.linalg.inv(gram[:-1, :-1])
        beta, error = covariance @ gram[:-1, -1], np.sqrt(np.diagonal(covariance))
        out[:2, known], out[2:, known] = beta[: 2 * m].reshape(2, m), error[: 2 * m].reshape(2, m)
    return out


def stretch_centres(subdivisions: int) -> np.ndarray:
    """(n,) mechanical angles (rad) at the middle of the stretches."""
    return 2.0 * np.pi / subdivisions * (np.arange(subdivisions) + 0.5)


def reconstruct_angle_resolved(signals: Signals, actuator: ActuatorParameters, settings: Mapping) -> Features:
    """R_j, k_j (its mean over the angle) and the harmonics of k_j(theta), and R and k by stretches of rotor angle.

    ``extras``: ``xi`` (run, 2) and ``xi_covariance`` (run, 2, 2); ``harmonics`` (run, phase, 2 order), which are c_1,
    s_1, c_2, ... relative to k_j; ``R_theta``, ``k_theta``, ``R_theta_error``, ``k_theta_error`` (run, phase, n);
    ``chi2``, ``samples``, ``fit`` and ``freedom`` (run, phase), as of ``weighted``.
    """
    s = read_settings(AngleResolvedSettings, settings, "angle_resolved")
    check_settings(s, "angle_resolved")
    check_number("angle_resolved", "order", s.order, 1, 6)
    check_number("angle_resolved", "subdivisions", s.subdivisions, 0, 360)
    if s.eccentricity_law not in LAWS:
        raise InputError(
            f"reconstruction.eccentricity_law: got '{s.eccentricity_law}', 'angle_resolved' accepts {', '.join(LAWS)}"
        )
    order, n = int(s.order), int(s.subdivisions)
    features, fits = fit_runs(signals, actuator, s, lambda rows: harmonic_shapes(rows, order), 2 * order)
    extras = features.extras
    extras["xi"], extras["xi_covariance"] = np.full((signals.runs, 2), np.nan), np.full((signals.runs, 2, 2), np.nan)
    extras["harmonics"] = np.full((signals.runs, 3, 2 * order), np.nan)
    by_angle = np.full((4, signals.runs, 3, n), np.nan)
    for fit in fits:
        extras["harmonics"][fit.run] = [phase.beta[4:] / phase.beta[EMF] for phase in fit.phases]
        extras["xi"][fit.run], extras["xi_covariance"][fit.run] = eccentricity(fit.phases, s.eccentricity_law)
        if n:
            for j in range(3):
                by_angle[:, fit.run, j] = by_stretch(fit.rows[j], fit.phases[j], fit.noise, signals.interval, n)
    for name, values in zip(("R_theta", "k_theta", "R_theta_error", "k_theta_error"), by_angle):
        extras[name] = values
    return features

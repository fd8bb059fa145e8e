"""R_j, k_j and L_j of the three phases together, from every interval of a record.

Over an interval of length h the mean voltage equation is exact, through commutations and standstill too:

    V_j = R_j i_j + L_j (i_end - i_start)/h + k_j (F(end) - F(start))/(p h) + c_j

with F the integral of the trapezoid over the electrical angle; c_j stands where the phase carries current. Beside
``weighted`` this uses the intervals in which a phase commutates, where its current falls by all of its value, and that
the currents sum to zero: of two conducting phases each sees the other's current, which halves the variance of the
measured one. The standard error of L_j falls by 40 %, and L_j = L0 (1 - N_j)^2 tells the shorted turns.

Currents stand in regressor and residual. The regressors are therefore the best estimates of the true currents under the
equations (measured ones less their covariance with the residual times Omega^-1 residual), whose errors are independent
of the residual, so that the estimate is unbiased by noise (Stefanski and Carroll, Biometrika 74, 1987, 703). Omega is
block-tridiagonal: three phases share the noise of their currents, neighbouring intervals that of an end current. The
sum of zero leaves each instant the noise covariance sigma^2 (I - 1 1'/m) among the m phases that conduct.

A winding that warms in the record by its own losses has R_j (1 + w(t)) in the equation, with w = g Q and Q the integral
of the currents squared from the start on: R_j is that at the start. What it gives off meanwhile is left out. With
``heating`` the rate g, one for all phases, is an unknown; without, the mean R_j over the record is found.

The angle turned comes from the recorded angles and speeds together. The noise that this leaves in the speed counts as
white in Omega, where what is left out would bias L. It has no slow part, though, and k is told by slow parts alone: the
estimate's covariance is that of the other noise.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solveh_banded

from ..actuator.parameters import ActuatorParameters
from ..actuator.shape import trapezoid_swept
from ..closed_form import PHASE_AXIS
from .factors import backward, factor, forward, project
from .features import Features, Signals, check_number, read_settings
from .goodness import by_stretch, stretches
from .least_squares import CURRENT, DIDT, EMF, INTERCEPT, is_singular
from .noise import LEAST_RATE, LEAST_VOLTAGE, USUAL_VOLTAGE, NoiseLevels, split_noise, stated_noise
from .rows import OFF_HALF_WIDTH, is_zero
from .weighted import LOOSE_INDUCTANCE, WeightedSettings, fit_runs

PASSES = 2  # with corrected regressors; a third changes less than a thousandth of a standard error
FEWEST_FLOATING = 10  # samples of a phase, to tell its offset and the currents' noise
CLEAR = np.deg2rad(0.2)  # electrical angle kept clear of the edges of the off sector, for the angle's noise
STANDSTILL = 1e-3  # rad/s
UNKNOWNS = 12  # R, k, L and c, three phases each


@dataclass(frozen=True)
class NineSettings:
    """Settings of ``nine``."""

    discard: float = 0.0  # s, dropped at the start
    plateau_width: float = 120.0  # electrical degrees
    zero_current: float = 0.2  # A, largest measured current that may count as zero
    noise: Mapping[str, float] | None = None  # voltage, current, current_end, speed (SI, 1 sigma); None estimates them
    heating: bool = False  # the winding warms in the record


@dataclass(frozen=True)
class Record:
    """One run's intervals as the equations need them; row n runs from instant n to instant n + 1."""

    V: np.ndarray  # (row, phase) V
    i: np.ndarray  # (row, phase) A, mean currents that sum to zero, zero where floating
    end: np.ndarray  # (row + 1, phase) A, likewise, at the instants
    emf: np.ndarray  # (row, phase) rad/s, mean of f w
    f: np.ndarray  # (row, phase) mean of f over the angle turned
    live: np.ndarray  # (row, phase) bool: not floating
    live_end: np.ndarray  # (row + 1, phase) bool
    stretch: np.ndarray  # (row,) number of the stretch of rotor angle in which the row begins
    noise: NoiseLevels  # as the record tells it, the voltage's apart
    interval: float  # s
    dissipated: np.ndarray  # (row,) A2 s, Q at the row's middle
    heating: bool = False  # R grows with it at a rate that is an unknown


@dataclass(frozen=True)
class NineFit:
    """Estimate of one run."""

    beta: np.ndarray  # (4, phase) R, k, L, c
    rate: float  # 1/(A2 s), g
    covariance: np.ndarray  # (9, 9) of [R, k, L]
    chi2: np.ndarray  # (phase,) residual variance over the one expected
    fit: np.ndarray  # mean square of the stretches' standardised mean residuals, (phase,), 1 where the equation holds
    freedom: np.ndarray  # (phase,) its degrees of freedom
    growth: tuple[float, float]  # of R over the record, relative, were the rate an unknown too, and its standard error


def angles_turned(speed: np.ndarray, angle: np.ndarray, interval: float) -> tuple[np.ndarray, float]:
    """(time,) rotor angles (rad) at the intervals' ends from recorded angles and speeds together; their rate's noise.

    The rate's noise (rad/s) is the mean of 1/(1/s^2 + 1/(4 a^2 sin^2(x/2))) over frequencies x, with s that of the
    speed and a that of an angle over the interval.
    """
    of_speed, of_angle = split_noise(speed, angle, interval)
    if of_angle <= 1e-12 * of_speed or of_angle < LEAST_RATE:
        return angle, 0.0
    ratio = of_angle / of_speed
    band = np.zeros((2, len(angle)))
    band[0] = 1.0 + 2.0 * ratio
    band[0, [0, -1]] = 1.0 + ratio
    band[1, :-1] = -ratio
    right = angle.copy()
    right[1:] += ratio * interval * speed[1:]
    right[:-1] -= ratio * interval * speed[1:]
    left = of_speed * (1.0 - 1.0 / np.sqrt(1.0 + 4.0 * ratio))
    return solveh_banded(band, right, lower=True, check_finite=False), float(np.sqrt(left))


def read_record(signals: Signals, run: int, actuator: ActuatorParameters, s: NineSettings) -> Record | None:
    """Rows of one run; None where a phase never floats, so that its sensor's offset is not told.

    ``signals`` must hold end currents.
    """
    h, p = signals.interval, float(actuator.pole_pairs)
    first = max(round(s.discard / h), 1)
    angle, rate_noise = angles_turned(signals.speed[run], signals.angle[run], h)
    x = p * angle[:, None] - PHASE_AXIS
    ramp = max(0.5 * (np.pi - np.deg2rad(s.plateau_width)), 1e-9)
    swept = np.stack([trapezoid_swept(np.ascontiguousarray(x[:, j]), ramp)[0] for j in range(3)], axis=1)
    i, end = signals.current[run].copy(), signals.current_end[run].copy()  # type: ignore[index]
    floating = np.zeros(i.shape, bool)
    scatter = np.zeros((2, 3))
    for j in range(3):
        inside = np.abs(x[:, j] - np.pi * np.round(x[:, j] / np.pi)) <= OFF_HALF_WIDTH - CLEAR
        rows = 1 + np.flatnonzero(inside[1:] & inside[:-1])
        zero = is_zero(i[rows, j], s.zero_current) & is_zero(end[rows, j], s.zero_current)
        zero &= is_zero(end[rows - 1, j], s.zero_current)
        # the last of a fading current hides in the noise: where it may have faded within an interval, it is measured
        sure = zero & np.concatenate([[False], zero[:-1]]) & (np.diff(rows, prepend=-1) == 1)
        rows = rows[sure if np.sum(sure) >= FEWEST_FLOATING else zero]
        if len(rows) < FEWEST_FLOATING:
            return None
        floating[rows, j] = True
        for values, n in ((i, 0), (end, 1)):
            values[:, j] -= np.mean(values[rows, j])
            scatter[n, j] = np.mean(values[rows, j] ** 2)
    still = floating.copy()  # an instant beside a floating interval
    still[:-1] |= floating[1:]
    part = slice(first, None)
    emf, rate = np.diff(swept[first - 1 :], axis=0) / (p * h), np.diff(angle[first - 1 :])[:, None] / h
    moving = np.abs(rate) > STANDSTILL
    mean, at_end = (float(np.sqrt(np.mean(s))) for s in scatter)
    i = project(i, ~floating)
    losses = h * np.sum(i**2, axis=1)
    return Record(
        V=signals.voltage[run, part],
        i=i[part],
        end=project(end[first - 1 :], ~still[first - 1 :]),
        emf=emf,
        f=np.where(moving, emf / np.where(moving, rate, 1.0), 0.0),
        live=~floating[part],
        live_end=~still[first - 1 :],
        stretch=stretches(p * angle[first - 1 : -1]),
        noise=NoiseLevels(USUAL_VOLTAGE, mean, at_end, rate_noise),
        interval=h,
        dissipated=(np.cumsum(losses) - 0.5 * losses)[part],
        heating=bool(s.heating),
    )


def warmth(r: Record, rate: float) -> np.ndarray | float:
    """(row, 1) R over that at the start, 1 where it is constant."""
    return 1.0 + rate * r.dissipated[:, None] if r.heating else 1.0


def regressors(r: Record, i: np.ndarray, end: np.ndarray, R: np.ndarray, rate: float) -> np.ndarray:
    """(row, phase, 12) derivatives of the voltages by [R, k, L, c] of phases a, b, c; a last one by the rate."""
    X = np.zeros((*r.V.shape, UNKNOWNS + r.heating))
    if r.heating:
        X[:, :, UNKNOWNS] = R * i * r.dissipated[:, None]
    warm = warmth(r, rate) * i
    for j in range(3):
        X[:, j, 3 * CURRENT + j], X[:, j, 3 * EMF + j] = warm[:, j], r.emf[:, j]
        X[:, j, 3 * DIDT + j], X[:, j, 3 * INTERCEPT + j] = np.diff(end[:, j]) / r.interval, r.live[:, j]
    return X


def residuals(r: Record, beta: np.ndarray, rate: float) -> np.ndarray:
    """(row, phase) recorded less predicted voltage (V); ``beta`` (4, phase) R, k, L, c."""
    R, k, L, c = beta
    return r.V - warmth(r, rate) * R * r.i - k * r.emf - L * np.diff(r.end, axis=0) / r.interval - c * r.live


def information(r: Record, beta: np.ndarray, rate: float, noise: NoiseLevels) -> np.ndarray:
    """(12, 12) Fisher information of [R, k, L, c], or (13, 13) with the rate; ``r`` holds true currents and speeds."""
    C, G = _factor(r, beta, replace(noise, speed=0.0))
    X = regressors(r, r.i, r.end, beta[CURRENT], rate)
    W = forward(C, G, X).reshape(-1, X.shape[2])
    return W.T @ W


def _factor(r: Record, beta: np.ndarray, noise: NoiseLevels) -> tuple[np.ndarray, np.ndarray]:
    R, k, L, _ = beta
    levels = noise.voltage, noise.current, noise.current_end, noise.speed
    return factor(R, L / r.interval, k * r.f, r.live, r.live_end, *levels)


def nine_of(normal: np.ndarray) -> np.ndarray:
    """(9, 9) covariance of [R, k, L] from the information of all unknowns."""
    scale = np.sqrt(np.diagonal(normal))
    return (np.linalg.inv(normal / np.outer(scale, scale)) / np.outer(scale, scale))[:9, :9]


def _voltage_noise(r: Record, beta: np.ndarray, rate: float, noise: NoiseLevels) -> float:
    """Voltage noise (V) that the residuals at ``beta`` leave once that of currents and speed is taken off."""
    m = np.maximum(np.sum(r.live, axis=1, keepdims=True), 1)
    m_end = np.maximum(np.sum(r.live_end, axis=1, keepdims=True), 1)
    of_end = r.live_end * (1.0 - 1.0 / m_end)
    known = (beta[CURRENT] * noise.current) ** 2 * r.live * (1.0 - 1.0 / m)
    known = known + (beta[EMF] * r.f * noise.speed) ** 2
    known = known + (beta[DIDT] / r.interval * noise.current_end) ** 2 * (of_end[1:] + of_end[:-1])
    left = float(np.mean(residuals(r, beta, rate) ** 2 - known))
    return float(np.sqrt(max(left, LEAST_VOLTAGE**2)))


def fit_record(r: Record, actuator: ActuatorParameters, stated: NoiseLevels | None) -> NineFit | None:
    """Gauss-Newton on the joint equations; None where the rows leave an unknown undetermined."""
    beta = np.zeros((4, 3))
    beta[CURRENT], beta[EMF], beta[DIDT] = actuator.resistance, actuator.back_emf, actuator.inductance
    # the noise of the smoothed speed is told by the record in any case
    noise = r.noise if stated is None else replace(stated, speed=r.noise.speed)
    i, end, rate = r.i, r.end, 0.0
    for turn in range(1 + PASSES):
        if turn and stated is None:
            noise = replace(noise, voltage=_voltage_noise(r, beta, rate, noise))
        C, G = _factor(r, beta, noise)
        left = residuals(r, beta, rate)
        white = forward(C, G, left[..., None])[..., 0]
        if turn:
            u = backward(C, G, white)
            # records quieter than stated, noise-free ones above all, are corrected for the noise that they do have
            quiet = min(1.0, float(np.mean(white**2)))
            i = r.i + quiet * noise.current**2 * project(beta[CURRENT] * u, r.live)
            moved = np.zeros(r.end.shape)
            moved[1:] += beta[DIDT] / r.interval * u
            moved[:-1] -= beta[DIDT] / r.interval * u
            end = r.end + quiet * noise.current_end**2 * project(moved, r.live_end)
        X = regressors(r, i, end, beta[CURRENT], rate)
        W = forward(C, G, X).reshape(-1, X.shape[2])
        normal = W.T @ W
        if is_singular(normal):
            return None
        step = np.linalg.solve(normal, W.T @ white.ravel())
        beta = beta + step[:UNKNOWNS].reshape(4, 3)
        rate += float(np.sum(step[UNKNOWNS:]))
    level = np.mean(white**2) if stated is None else 1.0  # as in ``weighted``
    fit, freedom = by_stretch(r.stretch, white / np.sqrt(level), UNKNOWNS // 3)
    covariance = nine_of(information(replace(r, i=i, end=end), beta, rate, noise))
    of_rate = (beta[CURRENT] * i * r.dissipated[:, None])[..., None]
    more, error = _one_more(W, forward(C, G, of_rate).ravel(), white.ravel())
    growth = more * r.dissipated[-1], error * r.dissipated[-1] * float(np.sqrt(max(level, 1.0)))
    return NineFit(beta, rate, covariance, np.mean(white**2, axis=0), fit, np.full(3, freedom), growth)


def _one_more(W: np.ndarray, column: np.ndarray, left: np.ndarray) -> tuple[float, float]:
    """Value and standard error of one more unknown, from white columns (row, unknown), its own and residuals (row,)."""
    normal, own = W.T @ W, W.T @ np.column_stack([column, left])
    of_column, of_left = np.linalg.solve(normal, own).T
    power = float(column @ column - own[:, 0] @ of_column)
    if power <= 1e-12 * float(column @ column):
        return 0.0, np.inf
    return float(column @ left - own[:, 0] @ of_left) / power, power**-0.5


def reconstruct_nine(signals: Signals, actuator: ActuatorParameters, settings: Mapping) -> Features:
    """R_j, k_j, L_j and intercept of each phase with their joint covariance.

    ``extras``: ``nine_covariance`` (run, 9, 9) of [R, k, L] (SI); ``chi2`` (run, phase) residual variance over the one
    expected from the noise levels; ``fit`` (run, phase) mean square of the standardised mean residuals of 15 electrical
    degrees, chi-squared over its ``freedom`` (run, phase) where the equation holds, whatever the noise; ``growth``
    (run, 2) of R over the record beyond what is fitted, relative, and its standard error; with ``heating`` also
    ``heating_rate`` (run,) in 1/(A2 s), relative growth of R. Without end
    currents L_j is not measured: what ``weighted`` makes of floating and plateau samples is returned, with L_j nominal
    to 30 %, and ``fit`` is NaN.

    Raises
    ------
    InputError : an unknown setting or an impossible value
    """
    s = read_settings(NineSettings, settings, "nine")
    check_number("nine", "discard", s.discard, 0.0)
    check_number("nine", "plateau_width", s.plateau_width, 30.0, 180.0)
    check_number("nine", "zero_current", s.zero_current, 0.0)
    runs = signals.runs
    nine, chi2, fit = np.full((runs, 9, 9), np.nan), np.full((runs, 3), np.nan), np.full((runs, 3), np.nan)
    freedom = np.zeros((runs, 3), np.int64)
    growth = np.full((runs, 2), np.nan)
    told = {"chi2": chi2, "fit": fit, "freedom": freedom, "growth": growth, "nine_covariance": nine}
    rate = np.full(runs, np.nan)
    if s.heating:
        told["heating_rate"] = rate
    if signals.current_end is None:
        plain = WeightedSettings(s.discard, 2.0, s.plateau_width, True, s.zero_current, s.noise)
        found, fits = fit_runs(signals, actuator, plain, lambda rows: rows.f[:, None])
        for each in fits:
            nine[each.run] = 0.0
            nine[each.run, :6, :6] = found.covariance[each.run]
            nine[each.run, 6:, 6:] = np.eye(3) * (LOOSE_INDUCTANCE * actuator.inductance) ** 2
        chi2[:] = found.extras["chi2"]
        nominal = np.where(np.isfinite(found.R), actuator.inductance, np.nan)
        return Features(found.R, found.k, nominal, found.offset, found.covariance, told)
    stated = None if s.noise is None else stated_noise(s.noise)
    beta = np.full((4, runs, 3), np.nan)
    for run in range(runs):
        record = read_record(signals, run, actuator, s)
        estimate = None if record is None else fit_record(record, actuator, stated)
        if estimate is not None:
            beta[:, run], nine[run], chi2[run] = estimate.beta, estimate.covariance, estimate.chi2
            fit[run], freedom[run], rate[run] = estimate.fit, estimate.freedom, estimate.rate
            growth[run] = estimate.growth
    R, k, L, offset = beta
    return Features(R, k, L, offset, nine[:, :6, :6].copy(), told)

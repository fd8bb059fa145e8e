"""Generalised least squares in volts, phase by phase, on samples chosen by rotor angle.

V_j = R_j i_j + k_j f w + L_j di_j/dt + c_j on the plateau, f = +-1; and, as an option, V_j = k_j f w where the terminal
floats. R_j, k_j, L_j and c_j are unknown; c_j takes up what a current sensor's offset leaves. di/dt comes from the
currents at the ends of the interval.

A record without end currents falls back on the mean of neighbouring mean currents, clear of commutations. The
switching ripple that this misses, hysteresis/sqrt(3) rms at each end, counts as noise of the end current, L is held
near nominal (30 %), and the covariance is widened where residuals exceed what is expected. Errors are two to ten times
larger then, and at constant speed, where only the ripple tells R from k, several percent.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..actuator.parameters import ActuatorParameters
from .features import Features, Signals, check_number, read_settings
from .goodness import by_stretch, stretches
from .least_squares import CURRENT, DIDT, EMF, INTERCEPT, PhaseFit, PhaseProblem, join_phases
from .noise import LEAST_VOLTAGE, NoiseLevels, likeliest_voltage, sensor_noise, stated_noise
from .rows import Rows, SampleChoice, phase_rows

LOOSE_INDUCTANCE = 0.3  # relative standard deviation of L where di/dt is not measured


@dataclass(frozen=True)
class WeightedSettings:
    """Settings of ``weighted``."""

    discard: float = 0.0  # s, dropped at the start
    margin: float = 2.0  # electrical degrees kept clear of the plateau's corners
    plateau_width: float = 120.0  # electrical degrees
    floating: bool = False  # use floating-phase samples too
    zero_current: float = 0.2  # A, largest measured current that may count as zero
    noise: Mapping[str, float] | None = None  # voltage, current, current_end, speed (SI, 1 sigma); None estimates them


@dataclass(frozen=True)
class RunFit:
    """The three phases' fits of one run, with the samples and noise levels that they rest on."""

    run: int
    rows: list[Rows]
    phases: list[PhaseFit]
    noise: NoiseLevels


def check_settings(s: WeightedSettings, method: str) -> None:
    """Refuse impossible values.

    Raises
    ------
    InputError : naming the key, its value and what is accepted
    """
    check_number(method, "discard", s.discard, 0.0)
    check_number(method, "plateau_width", s.plateau_width, 30.0, 180.0)
    check_number(method, "margin", s.margin, 0.0, 0.5 * s.plateau_width - 1.0)
    check_number(method, "zero_current", s.zero_current, 0.0)


def sample_choice(
    s: WeightedSettings, interval: float, actuator: ActuatorParameters, end_measured: bool = True
) -> SampleChoice:
    """Rules for choosing samples from settings in degrees and seconds."""
    return SampleChoice(
        pole_pairs=float(actuator.pole_pairs),
        plateau_width=float(np.deg2rad(s.plateau_width)),
        margin=float(np.deg2rad(s.margin)),
        first=round(s.discard / interval),
        floating=bool(s.floating),
        zero_current=s.zero_current,
        clear_of_commutation=not end_measured,
    )


def end_currents(signals: Signals) -> np.ndarray:
    """(run, time, phase) currents at the interval's end (A), from neighbouring means where they are not recorded."""
    if signals.current_end is not None:
        return signals.current_end
    end = signals.current.copy()
    end[:, :-1] = 0.5 * (signals.current[:, :-1] + signals.current[:, 1:])
    return end


def nominal_start(actuator: ActuatorParameters, unknowns: int = 4) -> np.ndarray:
    """(unknown,) nominal R, k, L and zeros."""
    start = np.zeros(unknowns)
    start[[CURRENT, EMF, DIDT]] = actuator.resistance, actuator.back_emf, actuator.inductance
    return start


def fit_runs(
    signals: Signals,
    actuator: ActuatorParameters,
    s: WeightedSettings,
    shapes: Callable[[Rows], np.ndarray],
    harmonics: int = 0,
) -> tuple[Features, Iterator[RunFit]]:
    """Fit every run; returns features to be filled and an iterator that fills them run by run.

    Parameters
    ----------
    shapes : rows -> (row, 1 + harmonics), see ``least_squares.PhaseProblem``
    """
    estimated = s.noise is None
    ends = signals.current_end is not None
    choice = sample_choice(s, signals.interval, actuator, ends)
    choice = replace(choice, floating=choice.floating or estimated)
    stated = None if s.noise is None else stated_noise(s.noise)
    ripple = actuator.hysteresis / np.sqrt(3.0)
    end = end_currents(signals)
    prior_L = np.inf if ends else LOOSE_INDUCTANCE * actuator.inductance
    start = nominal_start(actuator, 4 + harmonics)
    R, k, L, offset, chi2, fit_of = (np.full((signals.runs, 3), np.nan) for _ in range(6))
    samples, freedom = np.zeros((signals.runs, 3), np.int64), np.zeros((signals.runs, 3), np.int64)
    covariance = np.full((signals.runs, 6, 6), np.nan)
    out = Features(R, k, L, offset, covariance, {"chi2": chi2, "samples": samples, "fit": fit_of, "freedom": freedom})

    def fill() -> Iterator[RunFit]:
        for run in range(signals.runs):
            rows = [phase_rows(signals, end, run, j, choice) for j in range(3)]
            noise = sensor_noise(signals, run, rows) if stated is None else stated
            if not ends:
                noise = replace(noise, current_end=float(np.hypot(ripple, noise.current)))
            if estimated and not s.floating:
                rows = [r.conducting() for r in rows]
            samples[run] = [len(r.V) for r in rows]
            problems = [PhaseProblem(r, shapes(r), start, signals.interval, prior_L) for r in rows]
            first = [(p, beta) for p in problems if (beta := p.first_pass(noise)) is not None]
            if len(first) < 3:
                continue
            if estimated:
                noise = replace(noise, voltage=_voltage_noise(first, noise, ends))
            fits = [fit for p, beta in first if (fit := p.second_pass(beta, noise)) is not None]
            if len(fits) < 3:
                continue
            for array, column in ((R, CURRENT), (k, EMF), (L, DIDT), (offset, INTERCEPT)):
                array[run] = [fit.beta[column] for fit in fits]
            chi2[run] = [fit.chi2 for fit in fits]
            covariance[run] = join_phases(fits, rows, (CURRENT, EMF))
            if ends:
                # where the end currents' noise is most of all, what is left for the voltage's is estimated roughly
                level = float(np.mean(chi2[run])) if estimated else 1.0
                for j, (fit, r) in enumerate(zip(fits, rows)):
                    stretch = stretches(actuator.pole_pairs * r.theta)
                    white = fit.white / np.sqrt(level)
                    fit_of[run, j], freedom[run, j] = by_stretch(stretch, white, len(fit.beta))
            else:  # the ripple that is missed is no noise that the samples have each of its own
                covariance[run] *= max(1.0, float(np.max(chi2[run])))
            yield RunFit(run, rows, fits, noise)

    return out, fill()


def _voltage_noise(first: Sequence[tuple[PhaseProblem, np.ndarray]], noise: NoiseLevels, ends: bool) -> float:
    """Noise of the voltages (V) by what first estimates leave; beside a ripple not recorded by its mean square."""
    if not ends:
        left = float(np.mean([p.excess_variance(beta, noise) for p, beta in first]))
        return float(np.sqrt(max(left, LEAST_VOLTAGE**2)))
    misfits = [p.misfit_of_voltage(beta, noise) for p, beta in first]
    return likeliest_voltage(
        lambda voltage: sum(misfit(voltage) for misfit in misfits), max(p.left(b) for p, b in first)
    )


def reconstruct_weighted(signals: Signals, actuator: ActuatorParameters, settings: Mapping) -> Features:
    """Generalised R, k, L and intercept of each phase with their covariance.

    ``extras``: ``chi2`` (run, phase) residual variance over the one expected from the noise levels; ``samples`` (run,
    phase); ``fit`` (run, phase) mean square of the standardised mean residuals of 15 electrical degrees, chi-squared
    over its ``freedom`` (run, phase) where the equation holds, whatever the noise, NaN without end currents.
    A run that leaves an unknown of any phase undetermined is NaN throughout.
    """
    s = read_settings(WeightedSettings, settings, "weighted")
    check_settings(s, "weighted")
    features, fits = fit_runs(signals, actuator, s, lambda rows: rows.f[:, None])
    for _ in fits:
        pass
    return features

"""The seed paper's own recipe, frozen: divide by speed, keep what is large, bisect for the resistance.

k' = (V - R0 i)/w (eq. 3 of the seed paper) is fitted as a straight line over i/w; the resistance R* at which the slope
dk*/d(i/w) of k* = (V - R* i)/w vanishes is R, and the level of the line is k. Samples are dropped by the size of the
dependent variable and L di/dt is ignored, as in the paper, so both are biased; it is kept as it is for comparison.

What the paper leaves open is fixed here: the low-pass is a second-order Butterworth run forwards and backwards
(zero phase) over V, i and w before the start is cut off; "close to zero" means |k'| <= 0.5 k0; samples below
``least_speed`` are dropped, as i/w has no value at standstill.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..compiled import compiled
from ..errors import InputError
from .features import Features, Signals, check_number, read_settings

CHUNK = 32  # runs filtered at once, so that memory stays flat


@dataclass(frozen=True)
class PaperSettings:
    """Settings of ``paper``; the defaults are the recipe."""

    cutoff: float = 300.0  # Hz
    discard: float = 0.05  # s, dropped at the start
    threshold: float = 0.5  # of k0
    least_speed: float = 1.0  # rad/s


@compiled
def slope_of_k(resistance, ratio, voltage, centred, spread):
    """Least-squares slope dk*/d(i/w) (ohm) of k* = V/w - R* i/w; ``ratio`` is i/w, ``voltage`` V/w, (sample,)."""
    total = 0.0
    for n in range(len(ratio)):
        total += centred[n] * (voltage[n] - resistance * ratio[n])
    return total / spread


@compiled
def bisect_resistance(ratio, voltage, centred, spread, low, high):
    """R* (ohm) between ``low`` and ``high`` at which the slope changes sign, to the last bit."""
    sign = slope_of_k(low, ratio, voltage, centred, spread) > 0.0
    while True:
        middle = 0.5 * (low + high)
        if not low < middle < high:
            return middle
        if (slope_of_k(middle, ratio, voltage, centred, spread) > 0.0) == sign:
            low = middle
        else:
            high = middle


@compiled
def fit_phase(V, i, w, R0, k0, threshold, least_speed):
    """One phase of one run, (time,) each: R* by bisection, k, R by the closed form, number of samples kept."""
    ratio, voltage = np.empty(len(w)), np.empty(len(w))
    kept = 0
    for n in range(len(w)):
        if abs(w[n]) < least_speed:
            continue
        k_prime = (V[n] - R0 * i[n]) / w[n]
        if abs(k_prime) > threshold * k0:
            sign = 1.0 if k_prime > 0.0 else -1.0  # the absolute value of k'
            ratio[kept], voltage[kept] = sign * i[n] / w[n], sign * V[n] / w[n]
            kept += 1
    ratio, voltage = ratio[:kept], voltage[:kept]
    if kept < 3:
        return np.nan, np.nan, np.nan, kept
    mean_ratio, mean_voltage = np.mean(ratio), np.mean(voltage)
    centred = ratio - mean_ratio
    spread = np.sum(centred * centred)
    if not spread > 1e-24 * kept * mean_ratio * mean_ratio:
        return np.nan, np.nan, np.nan, kept
    low, high = -R0, 3.0 * R0
    for _ in range(60):
        if slope_of_k(low, ratio, voltage, centred, spread) > 0.0 > slope_of_k(high, ratio, voltage, centred, spread):
            break
        low, high = 2.0 * low - R0, 2.0 * high
    R = bisect_resistance(ratio, voltage, centred, spread, low, high)
    closed = np.sum(centred * (voltage - mean_voltage)) / spread
    return R, mean_voltage - R * mean_ratio, closed, kept


def reconstruct_paper(signals: Signals, actuator: ActuatorParameters, settings: Mapping) -> Features:
    """Generalised R and k by the paper's recipe.

    ``extras`` hold ``R_closed_form`` (run, phase), the least-squares solution that the bisection must agree with, and
    ``samples`` (run, phase), the number kept. A phase with fewer than three samples is NaN.

    Raises
    ------
    InputError : a recording interval too long for the low-pass, or a record too short
    """
    from scipy.signal import butter, sosfiltfilt

    s = read_settings(PaperSettings, settings, "paper")
    check_number("paper", "cutoff", s.cutoff, 1e-3)
    check_number("paper", "discard", s.discard, 0.0)
    check_number("paper", "threshold", s.threshold, 0.0)
    check_number("paper", "least_speed", s.least_speed, 0.0)
    if s.cutoff * signals.interval >= 0.5:
        limit = 0.5 / s.cutoff
        raise InputError(
            f"recording interval: got {signals.interval:g} s, the {s.cutoff:g} Hz low-pass of 'paper' accepts less "
            f"than {limit:.3g} s"
        )
    first = round(s.discard / signals.interval)
    runs, samples = signals.speed.shape
    if samples < first + 3 or samples < 10:
        raise InputError(f"record: {samples} samples are too few for 'paper', which drops the first {s.discard:g} s")
    sos = butter(2, s.cutoff, fs=1.0 / signals.interval, output="sos")
    R, k, closed = np.empty((runs, 3)), np.empty((runs, 3)), np.empty((runs, 3))
    kept = np.zeros((runs, 3), np.int64)
    for start in range(0, runs, CHUNK):
        part = slice(start, start + CHUNK)
        V = sosfiltfilt(sos, np.moveaxis(signals.voltage[part], 2, 1))[..., first:]
        i = sosfiltfilt(sos, np.moveaxis(signals.current[part], 2, 1))[..., first:]
        w = sosfiltfilt(sos, signals.speed[part])[..., first:]
        for r in range(len(w)):
            for j in range(3):
                R[start + r, j], k[start + r, j], closed[start + r, j], kept[start + r, j] = fit_phase(
                    V[r, j], i[r, j], w[r], actuator.resistance, actuator.back_emf, s.threshold, s.least_speed
                )
    unknown = np.full((runs, 3), np.nan)
    return Features(
        R, k, unknown, unknown.copy(), np.full((runs, 6, 6), np.nan), {"R_closed_form": closed, "samples": kept}
    )

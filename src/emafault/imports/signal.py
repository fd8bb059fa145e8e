"""A measured signal on its own clock, and its exact means over any intervals."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

ROOT_6 = np.sqrt(6.0)


@dataclass(frozen=True)
class Signal:
    """Samples (sample,) of one channel in the recording format's unit, at the times (s) of its logger's clock.

    ``averaged``: a sample is the mean since the one before, else the value at its instant; ``known``: its unit was
    said.
    """

    time: np.ndarray
    values: np.ndarray
    averaged: bool
    logger: str
    name: str
    known: bool = True

    @property
    def step(self) -> float:
        """Usual distance of samples (s)."""
        return float(np.median(np.diff(self.time)))

    @property
    def begin(self) -> float:
        """From when on its integral is known (s)."""
        return float(self.time[0] - (self.step if self.averaged else 0.0))

    @property
    def end(self) -> float:
        """Until when its integral is known (s)."""
        return float(self.time[-1])

    def scaled(self, factor: float, offset: float = 0.0) -> "Signal":
        """The signal times ``factor`` less ``offset``."""
        return replace(self, values=self.values * factor - offset)

    def on_clock(self, skew: float, drift: float) -> "Signal":
        """The signal on the bench's clock: its own times a part ``drift`` longer, ``skew`` (s) later."""
        return replace(self, time=self.time * (1.0 + drift) + skew)

    def within(self, first: float, last: float) -> "Signal":
        """The samples from ``first`` to ``last`` (s) and one on either side."""
        a, b = np.searchsorted(self.time, [first, last])
        part = slice(max(a - 1, 0), b + 1)
        return replace(self, time=self.time[part], values=self.values[part])

    def at(self, t: np.ndarray) -> np.ndarray:
        """Values at instants (s), linear between samples; means count for the middle of what they are of."""
        return np.interp(t, self.time - (0.5 * self.step if self.averaged else 0.0), self.values)

    def means(self, edges: np.ndarray) -> np.ndarray:
        """Means between successive edges (s): differences of the cumulative integral, exact for samples joined by
        lines, or for means joined as steps."""
        return np.diff(self._integral(edges)) / np.diff(edges)

    @cached_property
    def _total(self) -> np.ndarray:
        """Integral from the first sample to each."""
        if self.averaged:
            return np.cumsum(self.values * np.diff(self.time, prepend=self.begin))
        steps = 0.5 * (self.values[1:] + self.values[:-1]) * np.diff(self.time)
        return np.concatenate([[0.0], np.cumsum(steps)])

    def _integral(self, t: np.ndarray) -> np.ndarray:
        if self.averaged:
            k = np.searchsorted(self.time, t)
            k = np.minimum(k, len(self.time) - 1)  # a mean holds from the sample before to its own
            return self._total[k] - self.values[k] * (self.time[k] - t)
        k = np.clip(np.searchsorted(self.time, t, side="right") - 1, 0, len(self.time) - 2)
        part = t - self.time[k]
        slope = (self.values[k + 1] - self.values[k]) / (self.time[k + 1] - self.time[k])
        return self._total[k] + self.values[k] * part + 0.5 * slope * part**2


def pulse_uncertainty(swing: float, frequency: float, step: float) -> float:
    """Standard deviation (V) of a mean of a pulsed voltage known at samples only.

    Each of the two edges of a period lies anywhere between two samples, so that their distance has a triangular error
    of variance step^2/6; where pulses and samples keep step all periods have the same error, and a longer mean is no
    better.

    Parameters
    ----------
    swing : of the pulses (V)
    frequency : of the pulses (Hz)
    step : between samples (s)
    """
    return swing * frequency * step / ROOT_6


def pulses(signal: Signal) -> tuple[float, float]:
    """Swing (V) and frequency (Hz) of a voltage's pulses; zeros where its samples are not mostly at two levels or more.

    A pulse is seen as two jumps by more than half of the range from one sample to the next.
    """
    values = signal.values
    low, high = np.quantile(values, [0.005, 0.995])
    jumps = np.abs(np.diff(values))
    large = jumps[jumps > 0.5 * (high - low)] if high > low else jumps[:0]
    if signal.averaged or len(large) < 0.01 * len(values):
        return 0.0, 0.0
    return float(np.median(large)), len(large) / 2.0 / float(signal.time[-1] - signal.time[0])

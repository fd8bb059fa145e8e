"""Filters along a signal, and a channel that lags undone."""

import numpy as np
import pytest
from scipy.linalg import expm

from emafault.delays import ahead, averaged, averaging, butterworth, smoothed

SIGNAL = np.cumsum(np.random.default_rng(0).normal(size=400))
BEFORE = np.concatenate([SIGNAL[:1], SIGNAL[:-1]])


@pytest.mark.parametrize("lag", [0.0, 0.2, 0.45, 0.55, 0.8, 1.0])
def test_a_lag_is_undone_by_what_was_recorded_before_or_after(lag):
    recorded = (1.0 - lag) * SIGNAL + lag * BEFORE
    inside = slice(60, -60)  # the first and the last value are not known
    np.testing.assert_allclose(ahead(recorded, lag)[inside], SIGNAL[inside], atol=2e-4)


def test_about_one_half_a_lag_is_nearly_undone():
    lagging = 0.5 * (SIGNAL + BEFORE)
    left = (ahead(lagging, 0.5) - SIGNAL)[60:-60]
    assert np.std(left) < 0.5 * np.std((lagging - SIGNAL)[60:-60])


def test_smoothing_is_what_its_equation_says():
    out = smoothed(SIGNAL, 0.7)
    np.testing.assert_allclose(out[1:] + 0.7 * np.diff(out), SIGNAL[1:], atol=1e-12)


@pytest.mark.parametrize("delay", [0.0, 0.3, 0.5, 1.0, 2.2, 4.0])
def test_an_average_is_late_by_its_delay(delay):
    line = np.arange(50.0)
    np.testing.assert_allclose(averaged(line, delay)[10:], line[10:] - delay, atol=1e-12)
    weights = averaging(delay)
    assert weights.sum() == pytest.approx(1.0)
    np.testing.assert_allclose(averaged(SIGNAL, delay)[10:], np.convolve(SIGNAL, weights)[10 : len(SIGNAL)], atol=1e-9)


def test_an_average_over_whole_numbers_of_samples():
    np.testing.assert_allclose(averaged(SIGNAL, 1.0)[2:], np.convolve(SIGNAL, np.full(3, 1 / 3), "valid"), atol=1e-9)
    assert averaged(SIGNAL, 1.0)[0] == SIGNAL[0]


@pytest.mark.parametrize("delay", [0.4, 3.0, 11.0])
def test_a_filter_of_the_second_order_is_what_its_equation_says(delay):
    """Means over intervals of what an integrator in small steps makes of the same."""
    parts, x = 200, SIGNAL[:120] - SIGNAL[0]
    A = np.array([[0.0, 1.0], [-2.0 / delay**2, -2.0 / delay]])
    step = expm(A / parts)
    y, means = np.zeros(2), []
    for value in x:
        at_rest = np.array([value, 0.0])
        inside = []
        for _ in range(parts):
            inside.append(y[0])
            y = at_rest + step @ (y - at_rest)
        means.append(np.mean(inside) + 0.5 * (y[0] - inside[0]) / parts)
    np.testing.assert_allclose(butterworth(SIGNAL[:120], delay) - SIGNAL[0], means, atol=1e-3)
    line = np.arange(400.0)
    np.testing.assert_allclose(butterworth(line, delay)[200:], line[200:] - delay, atol=1e-6)

"""Filters along a signal, and a channel that lags undone."""

import numpy as np
import pytest

from emafault.first_order import ahead, smoothed

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

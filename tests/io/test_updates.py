"""Channels that are slower than the recording."""

import numpy as np
import pytest

from emafault.io.updates import across, updates

SIZE = 2000


def signal(noise=1e-3, seed=0):
    """Rest, then a motion, with noise."""
    rng = np.random.default_rng(seed)
    t = np.linspace(-0.2, 1.0, SIZE)
    return np.where(t > 0.0, 0.05 * t**2, 0.0) + noise * rng.standard_normal(SIZE) * 0.05


def held(x, every, first=0):
    at = np.maximum((np.arange(len(x)) - first) // every * every + first, 0)
    return x[at]


def joined(x, every):
    at = np.arange(len(x))
    return np.interp(at, at[::every], x[::every])


@pytest.mark.parametrize("every", [2, 5, 8])
@pytest.mark.parametrize("how", [held, joined])
@pytest.mark.parametrize("step", [0.0, 1e-4])
def test_new_samples_are_found(every, how, step):
    x = signal()
    x = step * np.round(x / step) if step else x
    slow = how(x, every)
    new = updates(slow)
    known = np.flatnonzero(new)
    assert np.mean(known % every == 0) > 0.99
    assert np.mean(new) == pytest.approx(1.0 / every, rel=0.02)
    assert across(slow, new)[known] == pytest.approx(x[known])


def test_single_precision_hides_no_straight_line():
    x = joined(signal(), 5).astype(np.float32)
    assert np.mean(updates(x)) == pytest.approx(0.2, rel=0.03)


@pytest.mark.parametrize("step", [1e-5, 1e-4, 1e-3])
def test_counts_that_stay_are_no_slow_channel(step):
    x = signal()
    assert updates(x).all() and updates(step * np.round(x / step)).all()


def test_a_channel_without_noise_and_one_that_once_stood_still_are_quick():
    plain = signal(noise=0.0)
    stalled = signal()
    stalled[700:900] = stalled[700]
    assert updates(plain).all() and updates(stalled).all()


def test_an_offset_of_the_first_new_sample():
    new = updates(held(signal(), 4, first=3))
    assert np.mean(np.flatnonzero(new)[2:] % 4 == 3) > 0.99

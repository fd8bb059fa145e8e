"""Noise is told apart at short intervals, too, and what fits its equations is not said to miss them."""

import numpy as np
import pytest
from scipy import stats

from emafault.actuator.commands import command_positions
from emafault.actuator.parameters import make_runs
from emafault.actuator.sensors import measure
from emafault.actuator.simulate import simulate
from emafault.reconstruction import reconstruct
from emafault.reconstruction.noise import split_noise

from .conftest import ACTUATOR, COMMANDS, LEVELS, NOISE, noisy, recordings

SPEED, ANGLE = 0.3, 1e-4  # rad/s, rad


@pytest.mark.parametrize("interval", [5e-5, 2e-4, 1e-3])
def test_noise_of_speed_and_angle_are_told_apart(interval):
    count = round(1.0 / interval)
    found = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        angle = 150.0 * interval * np.arange(count) + ANGLE * rng.standard_normal(count)
        found.append(split_noise(150.0 + SPEED * rng.standard_normal(count), angle, interval))
    found = np.array(found)
    assert abs(np.mean(found[:, 0]) / SPEED**2 - 1.0) < 0.04
    assert np.std(found[:, 0]) < 0.12 * SPEED**2  # 0.05 to 0.09; of mean squares 0.8 at the shortest interval
    if interval < 1e-3:  # of longer ones the angle's is hardly seen
        assert abs(np.mean(found[:, 1]) / (ANGLE / interval) ** 2 - 1.0) < 0.04


def test_without_noise_there_is_none():
    angle = 0.01 * np.arange(1000)
    assert max(split_noise(np.full(1000, 50.0), angle, 2e-4)) < 1e-15


@pytest.mark.parametrize(
    ("method", "settings"), [("nine", {"noise": LEVELS}), ("nine", {}), ("weighted", {"floating": True})]
)
def test_what_fits_at_short_intervals_is_not_told_to_miss(method, settings):
    batch = recordings(24, "sine", interval=5e-5, seed=11)
    told = reconstruct(method, noisy(batch), 5e-5, ACTUATOR, settings).extras
    off = (told["fit"] - 1.0) * np.sqrt(told["freedom"] / 2.0)  # in standard deviations of chance
    assert np.std(off) < 1.35
    assert np.mean(stats.chi2.sf(told["fit"] * told["freedom"], told["freedom"]) < 1e-4) == 0.0


def test_a_wrong_shape_of_the_back_emf_is_told_at_short_intervals_too():
    run = make_runs(ACTUATOR, np.zeros((1, 6)), effects={"back_emf_shape": {"h5": 0.005}})
    clean = simulate(run, command_positions("sine", COMMANDS["sine"], 1.0, 1e-4), 1.0, 5e-5)
    for settings in ({"floating": True}, {"floating": False}):
        told = reconstruct("weighted", measure(clean, run, NOISE, 3), 5e-5, ACTUATOR, settings).extras
        assert np.all(stats.chi2.sf(told["fit"] * told["freedom"], told["freedom"]) < 1e-4)

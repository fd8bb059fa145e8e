"""The paper's recipe: the bisection finds what the closed form says, and bad input is refused in words."""

import numpy as np
import pytest
from scipy.signal import butter, filtfilt

from emafault.errors import InputError
from emafault.reconstruction import reconstruct
from emafault.reconstruction.paper import slope_of_k

from .conftest import ACTUATOR, COMMANDS, noisy, recordings


@pytest.mark.parametrize("command", COMMANDS)
def test_bisection_agrees_with_the_closed_form_to_rounding(command):
    features = reconstruct("paper", noisy(recordings(4, command)), 2e-4, ACTUATOR, {})
    known = np.isfinite(features.R)
    assert known.any()
    np.testing.assert_allclose(features.R[known], features.extras["R_closed_form"][known], rtol=1e-11)


def test_recipe_agrees_with_an_independent_one():
    """The same recipe written a second time with filtfilt and a straight-line fit of |k'| over i/w."""
    signals = noisy(recordings(2))
    features = reconstruct("paper", signals, 2e-4, ACTUATOR, {})
    b, a = butter(2, 300.0 / (0.5 / 2e-4))
    w = filtfilt(b, a, signals["rotor_speed"][1])[250:]
    for j in range(3):
        V = filtfilt(b, a, signals["phase_voltage"][1, :, j])[250:]
        i = filtfilt(b, a, signals["phase_current"][1, :, j])[250:]
        k_prime = (V - ACTUATOR.resistance * i) / w
        keep = (np.abs(k_prime) > 0.5 * ACTUATOR.back_emf) & (np.abs(w) >= 1.0)
        x = np.sign(k_prime[keep]) * i[keep] / w[keep]
        slope, level = np.polyfit(x, np.abs(k_prime[keep]), 1)
        assert features.extras["samples"][1, j] == keep.sum()
        assert features.R[1, j] == pytest.approx(ACTUATOR.resistance + slope, rel=1e-5)
        assert features.k[1, j] == pytest.approx(level, rel=1e-4)


def test_without_inductance_and_ripple_the_recipe_is_exact():
    """On signals that obey V = R i + k w sign, nothing that the recipe leaves out is there to bias it."""
    t = 2e-4 * np.arange(1, 5001)
    w = 5.0 + 150.0 * t
    i = 0.8 + 0.2 * np.sin(3.0 * t)
    R, k = np.array([0.9, 1.0, 1.2]), np.array([0.036, 0.037, 0.039])
    one = np.ones((1, 1, 3))
    signals = {
        "phase_voltage": one * 0.0 + R * i[None, :, None] + k * w[None, :, None],
        "phase_current": one * i[None, :, None],
        "rotor_speed": w[None],
        "rotor_angle": np.cumsum(w)[None] * 2e-4,
    }
    features = reconstruct("paper", signals, 2e-4, ACTUATOR, {})
    np.testing.assert_allclose(features.R[0], R, rtol=1e-6)
    np.testing.assert_allclose(features.k[0], k, rtol=1e-6)


def test_slope_falls_by_one_with_resistance():
    rng = np.random.default_rng(0)
    ratio, voltage = rng.random(50), rng.random(50)
    centred = ratio - ratio.mean()
    spread = np.sum(centred**2)
    at = [slope_of_k(R, ratio, voltage, centred, spread) for R in (0.0, 2.0)]
    assert at[0] - at[1] == pytest.approx(2.0)


def test_bias_is_what_the_recipe_is_known_for():
    """R +6 to +12 % on a healthy motor; it must not be repaired."""
    from emafault.actuator.commands import command_positions
    from emafault.actuator.parameters import make_runs
    from emafault.actuator.simulate import simulate

    command = command_positions("parabolic", COMMANDS["parabolic"], 1.0, ACTUATOR.control_period)
    signals = simulate(make_runs(ACTUATOR, np.zeros((1, 6))), command, 1.0, 2e-4)
    R = reconstruct("paper", signals, 2e-4, ACTUATOR, {}).R
    assert np.all((R / ACTUATOR.resistance > 1.04) & (R / ACTUATOR.resistance < 1.14))


@pytest.mark.parametrize("interval", [1e-4, 1e-3])
def test_other_intervals_are_accepted(interval):
    features = reconstruct("paper", recordings(2, interval=interval)[2], interval, ACTUATOR, {})
    assert np.all(np.isfinite(features.six))


def test_bad_input_is_refused():
    signals = recordings(2)[2]
    with pytest.raises(InputError, match=r"interval.*0.002 s.*300 Hz.*0.00167"):
        reconstruct("paper", signals, 2e-3, ACTUATOR, {})
    with pytest.raises(InputError, match="cut_off"):
        reconstruct("paper", signals, 2e-4, ACTUATOR, {"cut_off": 1.0})
    with pytest.raises(InputError, match=r"threshold.*-1"):
        reconstruct("paper", signals, 2e-4, ACTUATOR, {"threshold": -1.0})
    with pytest.raises(InputError, match="too few"):
        reconstruct("paper", {k: v[:, :252] for k, v in signals.items()}, 2e-4, ACTUATOR, {})
    with pytest.raises(InputError, match="phase_voltage: missing"):
        reconstruct("paper", {k: v for k, v in signals.items() if k != "phase_voltage"}, 2e-4, ACTUATOR, {})
    with pytest.raises(InputError, match=r"method: got 'papr'"):
        reconstruct("papr", signals, 2e-4, ACTUATOR, {})
    still = {name: np.zeros_like(values) for name, values in signals.items()}
    with pytest.raises(InputError, match="electrical revolution"):
        reconstruct("paper", still, 2e-4, ACTUATOR, {})

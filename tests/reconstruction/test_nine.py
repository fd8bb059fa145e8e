"""Nine coefficients: exact without noise, unbiased with it, errors as the covariance says, misfits told."""

import numpy as np
import pytest
from scipy import stats

from emafault.actuator.commands import command_positions
from emafault.actuator.parameters import make_runs, set_effects
from emafault.actuator.sensors import measure
from emafault.actuator.simulate import simulate
from emafault.closed_form import forward, inductance
from emafault.errors import InputError
from emafault.reconstruction import reconstruct
from emafault.reconstruction.bounds import nine_bound
from emafault.reconstruction.nine import backward, factor
from emafault.reconstruction.nine import forward as whiten

from .conftest import ACTUATOR, COMMANDS, LEVELS, NOISE, noisy, recordings, repeated

RUNS = 240


def truth(faults):
    return np.concatenate([*forward(faults, ACTUATOR), inductance(faults, ACTUATOR)], axis=1)


@pytest.fixture(scope="module")
def measured():
    batch = recordings(RUNS, seed=5)
    return batch, reconstruct("nine", noisy(batch), 2e-4, ACTUATOR, {"noise": LEVELS})


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("interval", [5e-5, 2e-4, 1e-3])
def test_exact_without_noise(command, interval):
    faults, _, signals = recordings(4, command, interval=interval)
    for noise in (None, LEVELS):
        features = reconstruct("nine", signals, interval, ACTUATOR, {"noise": noise})
        np.testing.assert_allclose(features.nine, truth(faults), rtol=1e-8)
        assert np.max(np.abs(features.offset)) < 1e-8


def test_block_factors_against_dense_algebra():
    rng = np.random.default_rng(1)
    rows, R, lever = 6, np.array([1.0, 1.1, 0.9]), np.array([1.8, 1.7, 1.9])
    live = rng.random((rows, 3)) < 0.7
    live_end = np.vstack([live[:1], live[1:] | live[:-1], live[-1:]])

    def shared(mask):
        m = mask.astype(float)
        return np.diag(m) - np.outer(m, m) / max(m.sum(), 1.0)

    dense = 0.05**2 * np.eye(3 * rows)
    for n in range(rows):
        dense[3 * n : 3 * n + 3, 3 * n : 3 * n + 3] += np.diag(R) @ shared(live[n]) @ np.diag(R) * 0.005**2
    steps = np.zeros((3 * rows, 3 * rows + 3))  # of end currents in the rows
    for n in range(rows):
        steps[3 * n : 3 * n + 3, 3 * n : 3 * n + 3], steps[3 * n : 3 * n + 3, 3 * n + 3 : 3 * n + 6] = (
            -np.diag(lever),
            np.diag(lever),
        )
    ends = np.zeros((3 * rows + 3, 3 * rows + 3))
    for n in range(rows + 1):
        ends[3 * n : 3 * n + 3, 3 * n : 3 * n + 3] = 0.02**2 * shared(live_end[n])
    dense += steps @ ends @ steps.T
    slope = rng.standard_normal((rows, 3))
    for n in range(rows):
        dense[3 * n : 3 * n + 3, 3 * n : 3 * n + 3] += np.outer(slope[n], slope[n]) * 0.1**2
    C, G = factor(R, lever, slope, live, live_end, 0.05, 0.005, 0.02, 0.1)
    table = rng.standard_normal((rows, 3, 2))
    white = whiten(C, G, table)
    expected = np.linalg.solve(dense, table.reshape(-1, 2))
    np.testing.assert_allclose(np.einsum("njq,njr->qr", white, white), table.reshape(-1, 2).T @ expected, rtol=1e-9)
    got = backward(C, G, np.ascontiguousarray(white[..., 0]))
    np.testing.assert_allclose(got.ravel(), expected[:, 0], rtol=1e-9)


def test_errors_are_unbiased_white_and_normal(measured):
    (faults, _, _), features = measured
    error = (features.nine - truth(faults))[..., None]
    white = np.linalg.solve(np.linalg.cholesky(features.extras["nine_covariance"]), error)[..., 0]
    assert np.max(np.abs(white.mean(axis=0))) * np.sqrt(RUNS) < 3.5
    np.testing.assert_allclose(white.std(axis=0), 1.0, atol=3.5 * np.sqrt(0.5 / RUNS))
    assert np.mean(white**2) == pytest.approx(1.0, abs=3.5 * np.sqrt(2.0 / white.size))
    correlation = np.corrcoef(white, rowvar=False) - np.eye(9)
    assert np.max(np.abs(correlation)) < 4.0 / np.sqrt(RUNS)
    assert stats.kstest(white.ravel(), "norm").pvalue > 1e-3
    np.testing.assert_allclose(features.extras["chi2"].mean(), 1.0, atol=0.03)
    np.testing.assert_allclose(features.extras["fit"].mean(), 1.0, atol=0.03)


@pytest.mark.parametrize("interval", [1e-4, 1e-3])
def test_noise_in_regressors_biases_nothing(interval):
    """At 100 us noise in the measured di/dt is largest: plain least squares is low in L by many standard errors."""
    _, signals = repeated(np.zeros(6), 60, seed=2, interval=interval)
    features = reconstruct("nine", signals, interval, ACTUATOR, {})
    pull = (features.nine - truth(np.zeros((1, 6)))).mean(axis=0) / (features.nine.std(axis=0) / np.sqrt(60))
    assert np.max(np.abs(pull)) < 4.0


def test_errors_at_the_bound_and_those_of_the_inductance_far_below_phase_by_phase(measured):
    (faults, _, clean), features = measured
    few = slice(0, 40)
    bound = nine_bound({n: v[few] for n, v in clean.items()}, 2e-4, ACTUATOR, LEVELS, {})
    least = np.sqrt(np.diagonal(bound, axis1=1, axis2=2))
    np.testing.assert_allclose(features.nine_error[few] / least, 1.0, atol=0.02)
    error = (features.nine - truth(faults))[:, 6:]
    alone = reconstruct("weighted", noisy(recordings(RUNS, seed=5)), 2e-4, ACTUATOR, {"noise": LEVELS}).L
    assert np.std(error) < 0.62 * np.std(alone - truth(faults)[:, 6:])


@pytest.mark.parametrize("s", [0.01, 0.05])
def test_saturation_lowers_the_three_inductances_alike_and_nothing_else(s):
    """So it lies in what is not known of L0; R and k stay what they are."""
    faults, _, _ = recordings(4)
    records = make_runs(ACTUATOR, faults, effects={"inductance_saturation": {"s": s}})
    clean = simulate(records, command_positions("parabolic", COMMANDS["parabolic"], 1.0, 1e-4), 1.0, 2e-4)
    nine = reconstruct("nine", clean, 2e-4, ACTUATOR, {"noise": LEVELS}).nine / truth(faults)
    np.testing.assert_allclose(nine[:, :6], 1.0, atol=1e-3)
    assert np.all(nine[:, 6:] < 1.0 - 0.5 * s)
    assert np.max(np.ptp(nine[:, 6:], axis=1)) < 0.1 * s


def test_offsets_of_the_current_sensors_cost_nothing():
    faults, records, _ = recordings(2)
    records = records.copy()
    for phase, value in zip("abc", (0.05, -0.03, 0.02)):
        records[f"current_offset_o_{phase}"] = value
    signals = simulate(records, 0.15 * np.arange(0.0, 1.0002, 1e-4) ** 2, 1.0, 2e-4)
    np.testing.assert_allclose(reconstruct("nine", signals, 2e-4, ACTUATOR, {}).nine, truth(faults), rtol=1e-7)


@pytest.mark.parametrize(
    ("effect", "values"),
    [
        ("back_emf_shape", {"h5": 0.02}),
        ("current_gain", {"g_a": 1.02}),
        ("dynamic_eccentricity", {"d": 0.03}),
    ],
)
def test_a_record_that_does_not_fit_its_equations_is_told(measured, effect, values):
    records = make_runs(ACTUATOR, np.zeros((3, 6)), effects={effect: values})
    clean = simulate(records, command_positions("step", COMMANDS["step"], 1.0, 1e-4), 1.0, 2e-4)
    features = reconstruct("nine", measure(clean, records, NOISE, 3), 2e-4, ACTUATOR, {})
    limit = stats.chi2.isf(1e-4, features.extras["freedom"]) / features.extras["freedom"]
    assert np.all(np.any(features.extras["fit"] > limit, axis=1))
    usual = measured[1].extras
    assert np.mean(usual["fit"] > stats.chi2.isf(1e-4, usual["freedom"]) / usual["freedom"]) < 0.01


def test_without_end_currents_the_inductance_is_left_open():
    batch = recordings(12, seed=3)
    signals = {name: values for name, values in noisy(batch).items() if name != "phase_current_end"}
    features = reconstruct("nine", signals, 2e-4, ACTUATOR, {"noise": LEVELS})
    assert np.all(np.isnan(features.extras["fit"]))
    six = reconstruct("weighted", signals, 2e-4, ACTUATOR, {"noise": LEVELS, "floating": True})
    np.testing.assert_array_equal(features.six, six.six)
    assert np.all(np.abs(features.L - truth(batch[0])[:, 6:]) < features.nine_error[:, 6:])


def test_a_run_that_tells_nothing_is_nan_among_others():
    signals = {name: np.array(values) for name, values in recordings(2)[2].items()}
    for values in signals.values():
        values[0] = 0.0
    features = reconstruct("nine", signals, 2e-4, ACTUATOR, {})
    assert features.identified.tolist() == [False, True]
    with pytest.raises(InputError, match="not a setting of 'nine'"):
        reconstruct("nine", signals, 2e-4, ACTUATOR, {"margin": 2.0})


@pytest.fixture(scope="module")
def warming():
    """Faults, runs and clean signals of windings that warm."""
    faults, runs, _ = recordings(60, "reversal", duration=0.5, seed=7)
    runs = runs.copy()
    set_effects(runs, {"self_heating": {"heating_rate": 0.333, "Rth": 5.0}})
    command = command_positions("reversal", {"amplitude": 0.05, "speed": 0.6}, 0.5, ACTUATOR.control_period)
    return faults, runs, simulate(runs, command, 0.5, 2e-4)


def test_a_winding_that_warms_is_told_by_its_rate(warming):
    faults, runs, clean = warming
    constant = reconstruct("nine", clean, 2e-4, ACTUATOR, {})
    assert np.mean(constant.R / truth(faults)[:, :3] - 1.0) > 4e-3  # the winding's mean temperature
    found = reconstruct("nine", clean, 2e-4, ACTUATOR, {"heating": True})
    np.testing.assert_allclose(found.nine, truth(faults), rtol=1.5e-4)  # what is given off meanwhile is left out
    measured = reconstruct("nine", measure(clean, runs, NOISE, 3), 2e-4, ACTUATOR, {"heating": True})
    pull = (measured.nine - truth(faults)) / measured.nine_error
    np.testing.assert_allclose(np.std(pull, axis=0), 1.0, atol=3.5 / np.sqrt(2 * 60))
    assert np.max(np.abs(np.mean(pull, axis=0))) < 3.5 / np.sqrt(60)
    assert measured.extras["fit"].mean() == pytest.approx(1.0, abs=0.1)
    bound = nine_bound(clean, 2e-4, ACTUATOR, LEVELS, {"heating": True})
    own = measured.extras["nine_covariance"]
    np.testing.assert_allclose(np.mean(own, axis=0).diagonal(), np.mean(bound, axis=0).diagonal(), rtol=0.05)
    # the rate costs R, and nothing else much
    less = nine_bound(clean, 2e-4, ACTUATOR, LEVELS, {})
    ratio = np.sqrt(np.mean(bound, axis=0).diagonal() / np.mean(less, axis=0).diagonal())
    assert np.all(ratio[:3] > 1.3) and np.all(ratio[3:] < 1.1)


def test_a_growth_of_r_that_is_left_out_is_told_and_noise_is_none(measured, warming):
    growth, error = measured[1].extras["growth"].T
    z = growth / error
    assert abs(np.mean(z)) < 3.5 / np.sqrt(RUNS) and np.std(z) == pytest.approx(1.0, abs=3.5 / np.sqrt(2.0 * RUNS))
    _, runs, clean = warming
    rate = reconstruct("nine", clean, 2e-4, ACTUATOR, {"heating": True}).extras["heating_rate"]
    grown = rate * 2e-4 * np.sum(clean["phase_current"] ** 2, axis=(1, 2))
    without_noise = reconstruct("nine", clean, 2e-4, ACTUATOR, {}).extras["growth"][:, 0]
    np.testing.assert_allclose(without_noise, grown, rtol=0.05)
    growth, error = reconstruct("nine", measure(clean, runs, NOISE, 3), 2e-4, ACTUATOR, {}).extras["growth"].T
    assert np.all(growth / error > 3.0)
    assert np.std((growth - without_noise) / error) == pytest.approx(1.0, abs=3.5 / np.sqrt(120))

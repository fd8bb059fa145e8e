"""Calibration of a unit on healthy recordings."""

from dataclasses import replace

import numpy as np
import pytest

from emafault.actuator.parameters import make_runs
from emafault.actuator.sensors import measure
from emafault.actuator.simulate import simulate, time_axis
from emafault.closed_form import forward, inverse
from emafault.errors import InputError
from emafault.io.recording import Recording
from emafault.reconstruction import reconstruct
from emafault.reconstruction.calibration import calibrate, calibrate_recordings

from .conftest import ACTUATOR, LEVELS, NOISE

COMMAND = 0.15 * np.arange(0.0, 1.0002, 1e-4) ** 2
UNIT = {"unit_calibration": {"R_scale": 1.06, "k_scale": 0.97}, "contact_resistance": {"R_x_b": 0.02}}
SETTINGS = {"noise": LEVELS, "floating": True}


def healthy(dT, seed, unit=UNIT):
    runs = make_runs(ACTUATOR, np.column_stack([np.zeros((len(dT), 5)), dT]), effects=unit)
    signals = measure(simulate(runs, COMMAND, 1.0, 2e-4), runs, NOISE, seed)
    return signals, reconstruct("weighted", signals, 2e-4, ACTUATOR, SETTINGS)


def test_recovers_the_unit_within_its_uncertainty():
    signals, features = healthy(np.full(8, 0.0), 1)
    found = calibrate(features, signals["ambient_temperature"], ACTUATOR)
    truth = np.repeat([1.06 * ACTUATOR.resistance, 0.97 * ACTUATOR.back_emf], 3)
    truth[1] += 0.02
    assert found.recordings == 8
    assert np.max(np.abs(found.unit - truth) / found.standard_error) < 4.0
    assert np.all(found.standard_error < 0.003 * truth)
    mean = found.actuator(ACTUATOR)
    assert mean.resistance == pytest.approx(np.mean(truth[:3]), rel=3e-3)
    assert mean.inductance == pytest.approx(ACTUATOR.inductance, rel=5e-3)


def test_uncertainty_matches_the_scatter_of_repeated_calibrations():
    dT = np.tile([-30.0, 10.0, 50.0], 40)
    signals, features = healthy(dT, 2, {"unit_calibration": {"R_scale": 1.06, "k_scale": 0.97}})
    found = []
    for start in range(0, 120, 3):
        part = slice(start, start + 3)
        rows = replace(
            features, **{name: getattr(features, name)[part] for name in ("R", "k", "L", "offset", "covariance")}
        )
        found.append(calibrate(rows, signals["ambient_temperature"][part], ACTUATOR, healthy_within=0.0))
    unit = np.array([c.unit for c in found])
    ratio = np.std(unit, axis=0, ddof=1) / np.mean([c.standard_error for c in found], axis=0)
    assert np.all((ratio > 0.65) & (ratio < 1.4))  # 40 repeats: 11 %
    truth = np.repeat([1.06 * ACTUATOR.resistance, 0.97 * ACTUATOR.back_emf], 3)
    assert np.max(np.abs(unit.mean(axis=0) - truth) / (unit.std(axis=0) / np.sqrt(40))) < 4.0


def test_calibrated_features_identify_a_faulty_unit():
    tolerance = {"unit_calibration": {"R_scale": 1.06, "k_scale": 0.97}}
    signals, features = healthy(np.linspace(-20.0, 40.0, 6), 3, tolerance)
    found = calibrate(features, signals["ambient_temperature"], ACTUATOR, healthy_within=0.0)
    faults = np.array([[0.05, 0.02, 0.0, 0.06, -0.03, 40.0], [0.0, 0.09, 0.04, -0.1, 0.1, -30.0]])
    clean = simulate(make_runs(ACTUATOR, faults, effects=tolerance), COMMAND, 1.0, 2e-4)
    faulty = reconstruct("weighted", clean, 2e-4, ACTUATOR, SETTINGS)
    calibrated = found.to_nominal(faulty, ACTUATOR)
    error = inverse(calibrated.R, calibrated.k, ACTUATOR) - faults
    assert np.max(np.abs(error[:, 5])) < 1.5 and np.max(np.abs(error[:, :5])) < 0.005
    raw = inverse(faulty.R, faulty.k, ACTUATOR) - faults
    assert np.min(np.abs(raw[:, 5])) > 10.0
    R, k = forward(faults, ACTUATOR)
    pull = (calibrated.six - np.concatenate([R, k], axis=1)) / calibrated.standard_error
    assert np.max(np.abs(pull)) < 4.0


def test_magnets_at_the_windings_temperature():
    alpha_m, dT = -4e-4, np.array([50.0])
    runs = make_runs(ACTUATOR, [[0, 0, 0, 0, 0, 50.0]], effects={"magnet_temperature": {"alpha_m": alpha_m}})
    features = reconstruct("weighted", simulate(runs, COMMAND, 1.0, 2e-4), 2e-4, ACTUATOR, SETTINGS)
    found = calibrate(features, 20.0 + dT, ACTUATOR, alpha_m=alpha_m)
    np.testing.assert_allclose(found.k0, ACTUATOR.back_emf, rtol=1e-8)
    np.testing.assert_allclose(found.R0, ACTUATOR.resistance, rtol=1e-8)


def test_recordings_of_unequal_length_and_the_paper_method():
    parts = []
    for duration, dT, seed in ((1.0, 0.0, 1), (0.8, 30.0, 2)):
        runs = make_runs(ACTUATOR, [[0, 0, 0, 0, 0, dT]])
        signals = measure(simulate(runs, COMMAND, duration, 2e-4), runs, NOISE, seed)
        ambient = float(signals.pop("ambient_temperature")[0])
        arrays = {name: values[0] for name, values in signals.items()}
        parts.append(Recording(time=time_axis(duration, 2e-4), ambient_temperature=ambient, name=f"{dT}.nc", **arrays))
    found = calibrate_recordings(parts, ACTUATOR, settings=SETTINGS)
    np.testing.assert_allclose(found.R0, ACTUATOR.resistance, rtol=6e-3)
    np.testing.assert_allclose(found.k0, ACTUATOR.back_emf, rtol=3e-3)
    biased = calibrate_recordings(parts, ACTUATOR, method="paper")
    assert np.all(np.isfinite(biased.unit)) and np.all(np.isnan(biased.L0))
    still = replace(parts[1], rotor_angle=parts[1].rotor_angle * 0.0, name="still.nc")
    with pytest.raises(InputError, match=r"^still\.nc: .*electrical revolution"):
        calibrate_recordings([parts[0], still], ACTUATOR)

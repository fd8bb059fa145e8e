"""Faults from nine coefficients: exact, at the bound, honest about what is not known of the unit and its magnets."""

import numpy as np
import pytest

from emafault import closed_form
from emafault.errors import InputError
from emafault.faults import FAULT_NAMES, sample_faults
from emafault.identification.evaluation import FeatureSet, evaluate
from emafault.identification.fitting import HeldOut, Prior, Recipe, fit_identifier
from emafault.identification.identifier import Identifier
from emafault.identification.intervals import coverage
from emafault.identification.posterior import FREEDOM, Knowledge, model_error, nine_forward, nominal_nine, posterior
from emafault.identification.rows import TrainingRows
from emafault.reconstruction.calibration import calibrate
from emafault.reconstruction.features import Features

from .conftest import NOISE, RANGES

RUNS = 2000
FAULTS = sample_faults(RUNS, seed=8, **RANGES)
#: relative, about that of a second's record: R and k of one phase correlated, L by itself
SPREAD = np.kron(np.block([[NOISE / 4.0, np.zeros((2, 1))], [np.zeros((1, 2)), 9e-4**2]]), np.eye(3))


def measured(actuator, faults=FAULTS, seed=0, alpha_m=0.0, lag=None, unit=None):
    """Nine coefficients with noise and their covariance; ``unit`` (run, 9) are factors of R0, k0 and L0."""
    magnets = None if lag is None else faults[:, 5] - lag
    true = nine_forward(faults, actuator, alpha_m, magnets) * (1.0 if unit is None else unit)
    draws = np.random.default_rng([seed, 6]).normal(size=true.shape) @ np.linalg.cholesky(SPREAD).T
    nine = true * (1.0 + draws)
    return nine, SPREAD * nine[:, :, None] * nine[:, None, :]


def as_features(nine, covariance):
    unknown = np.full((len(nine), 3), np.nan)
    extras = {"nine_covariance": covariance}
    return Features(nine[:, :3], nine[:, 3:6], nine[:, 6:], unknown, covariance[:, :6, :6], extras)


def pulls(found, faults=FAULTS):
    return (found.faults - faults) / np.sqrt(np.diagonal(found.covariance, axis1=1, axis2=2))


@pytest.mark.parametrize("alpha_m", [0.0, -4e-4])
def test_undoes_the_laws_and_its_covariance_is_that_of_the_propagated_noise(actuator, alpha_m):
    nine = nine_forward(FAULTS[:50], actuator, alpha_m)
    covariance = SPREAD * nine[:, :, None] * nine[:, None, :]
    found = posterior(nine, covariance, actuator, alpha_m, Knowledge())
    np.testing.assert_allclose(found.faults, FAULTS[:50], atol=1e-9)
    J = closed_form.jacobian(lambda f: nine_forward(f, actuator, alpha_m), FAULTS[:50])
    information = np.swapaxes(J, 1, 2) @ np.linalg.inv(covariance) @ J
    np.testing.assert_allclose(found.covariance @ information, np.broadcast_to(np.eye(6), (50, 6, 6)), atol=1e-6)
    assert np.max(found.misfit) < 1e-12


def test_errors_are_those_of_the_covariance_and_the_inductance_halves_them(actuator):
    nine, covariance = measured(actuator)
    found = posterior(nine, covariance, actuator, 0.0, Knowledge())
    np.testing.assert_allclose(pulls(found).std(axis=0), 1.0, atol=3.5 / np.sqrt(2 * RUNS))
    assert np.max(np.abs(pulls(found).mean(axis=0))) < 3.5 / np.sqrt(RUNS)
    assert found.misfit.mean() == pytest.approx(FREEDOM, abs=3.5 * np.sqrt(2 * FREEDOM / RUNS))
    six = closed_form.inverse(nine[:, :3], nine[:, 3:6], actuator)
    assert np.std((found.faults - FAULTS)[:, :3]) < 0.6 * np.std((six - FAULTS)[:, :3])


def test_magnets_that_lag_are_told_by_the_inductance(actuator):
    lag = np.random.default_rng(3).uniform(0.0, 40.0, RUNS)
    nine, covariance = measured(actuator, alpha_m=-4e-4, lag=lag)
    found = posterior(nine, covariance, actuator, -4e-4, Knowledge(lag=20.0, lag_deviation=40.0 / np.sqrt(12.0)))
    np.testing.assert_allclose(pulls(found).std(axis=0), 1.0, atol=0.06)
    mean = posterior(nine, covariance, actuator, -4e-4, Knowledge(lag=20.0))  # as if the lag were known
    assert np.std((found.faults - FAULTS)[:, :3]) < 0.5 * np.std((mean.faults - FAULTS)[:, :3])


def test_a_unit_within_its_specification(actuator):
    known = Knowledge(R=0.01, k=0.005, L=0.03)
    own = np.random.default_rng(4).normal(size=(RUNS, 3)) * [known.R, known.k, known.L]
    unit = np.repeat(1.0 + own, 3, axis=1)
    nine, covariance = measured(actuator, unit=unit)
    nine_learnt, spread_learnt = measured(actuator, seed=1)
    taught = TrainingRows(nine_learnt, FAULTS, spread_learnt)
    model = fit_identifier(taught, Prior(actuator, known=known)).identifier
    low, high = model.interval(nine, 0.9, covariance)
    assert all(abs(share - 0.9) < 0.025 for share in coverage(low, high, FAULTS).values())
    blind = fit_identifier(taught, Prior(actuator)).identifier
    assert coverage(*blind.interval(nine, 0.9, covariance), FAULTS)["dT"] < 0.5
    # one healthy recording of each of 200 units at an ambient temperature known to 0.5 K
    few = slice(0, 200)
    rng = np.random.default_rng(5)
    soak = rng.uniform(-30.0, 50.0, 200)
    healthy = measured(actuator, np.column_stack([np.zeros((200, 5)), soak]), 2, unit=unit[few])
    ambient = 20.0 + soak + 0.5 * rng.standard_normal(200)
    found = [
        calibrate(as_features(healthy[0][n : n + 1], healthy[1][n : n + 1]), ambient[n : n + 1], actuator,
                  healthy_within=0.0, prior=model.prior)
        for n in range(200)
    ]  # fmt: skip
    own_unit, spread = np.array([c.unit for c in found]), np.array([c.covariance for c in found])
    given = (covariance[few], own_unit, spread)
    low, high = model.interval(nine[few], 0.9, *given)
    assert abs(coverage(low, high, FAULTS[few])["mean"] - 0.9) < 0.04
    error = model.predict(nine[few], *given) - FAULTS[few]
    assert np.std(error[:, 5]) < 0.35 * np.std(model.predict(nine[few], covariance[few])[:, 5] - FAULTS[few, 5])
    # where the unit's own error is left out of the weights, as if it were subtracted, more is lost
    subtracted = model.predict(nine[few], covariance[few], own_unit, 1e-6 * spread) - FAULTS[few]
    assert np.std(error[:, :5]) < np.std(subtracted[:, :5])


def test_a_network_on_nine_features_and_files(actuator, width, tmp_path):
    nine, covariance = measured(actuator, FAULTS[:600])
    fresh = FeatureSet(*(a[600:] for a in (measured(actuator)[0], FAULTS, measured(actuator)[1])))
    rows = TrainingRows(nine, FAULTS[:600], covariance)
    recipe = Recipe({"coordinates": "log", "width": 8}, {"reweight": 1})
    errors = {}
    for name, by in {"network": recipe, "closed_form": None}.items():
        model = fit_identifier(rows, Prior(actuator), by, HeldOut("split")).identifier
        assert model.parameters <= 200
        model.save(tmp_path / name)
        loaded = Identifier.load(tmp_path / name)
        assert np.array_equal(loaded.predict(nine, covariance), model.predict(nine, covariance))
        errors[name] = evaluate(loaded, fresh, width)
        assert abs(errors[name]["coverage"]["mean"] - 0.9) < (0.02 if name == "closed_form" else 0.05)
    assert np.array_equal(model.known.covariance(), loaded.known.covariance())
    for output in ("N", "xi", "dT"):
        assert errors["network"]["errors"][output]["mae"] < 1.2 * errors["closed_form"]["errors"][output]["mae"]
    with pytest.raises(InputError, match="covariance: none given"):
        loaded.predict(nine)
    assert list(loaded.estimate(nine[:1], 0.9, covariance[:1])[0]) == list(FAULT_NAMES)


def test_a_coefficient_that_is_not_positive_is_refused(actuator):
    nine, covariance = nominal_nine(actuator)[None].copy(), np.eye(9)[None]
    nine[0, 7] = -1e-4
    with pytest.raises(InputError, match="L_b of run 0 is"):
        posterior(nine, covariance, actuator, 0.0, Knowledge())


def test_coefficients_that_fit_no_fault_get_an_error_of_their_own(actuator):
    few = slice(0, 300)
    off = 1.0 + 0.01 * np.random.default_rng(9).standard_normal((300, 9))  # every coefficient by 1 %
    nine, covariance = measured(actuator, FAULTS[few], unit=off)
    found = model_error(nine, covariance, actuator, 0.0, Knowledge())
    assert np.sqrt(np.mean(found**2)) == pytest.approx(0.01, rel=0.1)
    wider = covariance + np.eye(9) * (found[:, None, None] * nine[:, :, None]) ** 2
    low, high = (s * 1.645 for s in (-1.0, 1.0))
    z = pulls(posterior(nine, wider, actuator, 0.0, Knowledge()), FAULTS[few])
    assert np.mean((z > low) & (z < high)) > 0.7
    blind = pulls(posterior(nine, covariance, actuator, 0.0, Knowledge()), FAULTS[few])
    assert np.mean((blind > low) & (blind < high)) < 0.4
    none = model_error(*measured(actuator, FAULTS), actuator, 0.0, Knowledge())
    assert np.mean(none > 0.0) < 1e-3

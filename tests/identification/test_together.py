"""One fault from several recordings: that of one is the posterior, more of them tell more, another fault is refused."""

from dataclasses import replace

import numpy as np
import pytest

from emafault import config
from emafault.api.identification import identify
from emafault.dataset import simulate_recording
from emafault.errors import InputError
from emafault.faults import FAULT_NAMES, sample_faults
from emafault.identification.posterior import Knowledge, nominal_nine, posterior
from emafault.identification.together import together

from .conftest import RANGES
from .test_posterior import measured

UNITS, EACH = 300, 4


def of_units(actuator, known, width=9, seed=1, alpha_m=0.0, lag=None):
    """Joint estimates of units that are off nominal as known, and the true faults (unit, recording, 6)."""
    faults = np.repeat(sample_faults(UNITS, seed=seed, **RANGES)[:, None], EACH, axis=1)
    rng = np.random.default_rng(seed)
    faults[..., 5] = rng.uniform(*RANGES["temperature"], (UNITS, EACH))
    off = 1.0 + np.repeat([known.R, known.k, known.L], 3) * np.repeat(rng.standard_normal((UNITS, 3)), 3, axis=1)
    found = []
    for n in range(UNITS):
        behind = None if lag is None else rng.uniform(*lag, EACH)
        nine, covariance = measured(actuator, faults[n], 1000 * seed + n, alpha_m, behind, off[n])
        found.append(together(nine[:, :width], covariance[:, :width, :width], actuator, alpha_m, known))
    return found, faults


@pytest.mark.parametrize("alpha_m", [0.0, -4e-4])
def test_one_recording_is_the_posterior(actuator, alpha_m):
    known = Knowledge(R=0.01, k=0.005, L=0.03, lag=10.0, lag_deviation=3.0)
    faults = sample_faults(5, seed=3, **RANGES)
    nine, covariance = measured(actuator, faults, alpha_m=alpha_m, lag=10.0 if alpha_m else None)
    whole = covariance + known.covariance() * nine[:, :, None] * nine[:, None, :]
    alone = posterior(nine, whole, actuator, alpha_m, known)
    for n in range(5):
        found = together(nine[n : n + 1], covariance[n : n + 1], actuator, alpha_m, known)
        np.testing.assert_allclose(found.faults[0], alone.faults[n], atol=1e-6)
        np.testing.assert_allclose(found.covariance[0], alone.covariance[n], rtol=1e-5, atol=1e-12)
        assert found.misfit == pytest.approx(alone.misfit[n], rel=1e-4, abs=1e-6) and found.freedom == 3


@pytest.mark.parametrize(
    ("known", "width", "alpha_m", "lag"),
    [
        (Knowledge(), 6, 0.0, None),
        (Knowledge(), 9, 0.0, None),
        (Knowledge(R=0.01, k=0.005, L=0.03), 9, 0.0, None),
        (Knowledge(lag=10.0, lag_deviation=20.0 / 12**0.5), 9, -4e-4, (0.0, 20.0)),
    ],
)
def test_errors_are_those_of_the_covariance(actuator, known, width, alpha_m, lag):
    found, faults = of_units(actuator, known, width, alpha_m=alpha_m, lag=lag)
    own = np.stack([f.faults for f in found])
    spread = np.sqrt(np.stack([np.diagonal(f.covariance, axis1=1, axis2=2) for f in found]))
    pulls = (own - faults) / spread
    # recordings of a unit err together: as if there were one of each
    np.testing.assert_allclose(np.sqrt(np.mean(pulls**2, axis=(0, 1))), 1.0, atol=3.5 / np.sqrt(2 * UNITS))
    assert np.all(np.abs(np.mean(pulls, axis=(0, 1))) < 3.5 / np.sqrt(UNITS))
    inside = np.mean(np.abs(pulls) < 1.6449)
    assert 0.87 < inside < 0.93
    freedom = found[0].freedom
    assert freedom == EACH * (width - 1) - 5
    assert np.mean([f.misfit for f in found]) == pytest.approx(freedom, abs=3.5 * np.sqrt(2 * freedom / UNITS))


def test_more_recordings_tell_more_but_not_what_the_unit_is_off_by(actuator):
    faults = np.repeat(sample_faults(1, seed=4, **RANGES), 8, axis=0)
    nine, covariance = measured(actuator, faults)

    def errors(count, known):
        found = together(nine[:count], covariance[:count], actuator, 0.0, known)
        return np.sqrt(np.diagonal(found.covariance[0]))

    one, eight = errors(1, Knowledge()), errors(8, Knowledge())
    assert np.all(eight[:5] < one[:5] / 8**0.5 * 1.02)
    off = Knowledge(R=0.01)
    assert errors(8, off)[5] > 0.95 * errors(1, off)[5] > 2.0


def test_what_healthy_recordings_leave_open_is_shared(actuator):
    rng = np.random.default_rng(9)
    nominal, pulls, alone = nominal_nine(actuator), [], []
    for n in range(200):
        faults = np.repeat(sample_faults(1, seed=n, **RANGES), EACH, axis=0)
        off = 1.0 + 0.02 * rng.standard_normal(9)
        nine, covariance = measured(actuator, faults, 500 + n, unit=off)
        error = 2e-3 * rng.standard_normal(9)
        unit, unit_covariance = nominal * off * (1.0 + error), np.diag((2e-3 * nominal * off) ** 2)
        found = together(nine, covariance, actuator, 0.0, Knowledge(), unit, unit_covariance)
        pulls.append((found.faults[0] - faults[0]) / np.sqrt(np.diagonal(found.covariance[0])))
        one = together(nine[:1], covariance[:1], actuator, 0.0, Knowledge(), unit, unit_covariance)
        alone.append(np.diagonal(one.covariance[0]) / np.diagonal(found.covariance[0]))
    np.testing.assert_allclose(np.std(pulls, axis=0), 1.0, atol=3.5 / np.sqrt(2 * 200))
    assert np.all(np.mean(alone, axis=0) < 0.9 * EACH)  # four recordings are worth less than four times one


@pytest.fixture(scope="module")
def bench():
    """Three recordings of one fault at temperatures of their own, and one of another fault."""
    spec = config.dataset_spec(config.compose("nine_features", ["recording.duration=0.4"]), "fresh")
    one = [0.05, 0.01, 0.03, 0.05, -0.1]
    faults = [[*one, -20.0], [*one, 10.0], [*one, 50.0], [0.02, 0.01, 0.03, 0.05, -0.1, 10.0]]
    made = [simulate_recording({**spec, "tolerance": 0.0, "seed": n}, fault) for n, fault in enumerate(faults)]
    unknown = {"attributes": {"health": "unknown"}}
    return [replace(recording, name=f"{n}.nc", **unknown) for n, recording in enumerate(made)], faults


@pytest.mark.parametrize("experiment", ["paper", "nine_features"])
def test_identify_takes_one_fault_of_a_bench(bench, experiment, tmp_path):
    recordings, faults = bench
    options = {"experiment": experiment, "results": tmp_path}
    alone = identify(recordings[:3], **options).estimates
    found = identify(recordings[:3], together=True, **options)
    for name, estimate in found.estimates.items():
        for j, component in enumerate(FAULT_NAMES):
            e = estimate[component]
            width, before = (x[component]["high"] - x[component]["low"] for x in (estimate, alone[name]))
            assert width < before
            truth = faults[int(name.split(".")[0])][j]
            assert abs(e["value"] - truth) < 4.0 * 0.5 * width / 1.645
    assert "one fault of all 3 recordings" in str(found)


def test_another_fault_and_a_network_are_refused(bench, tmp_path):
    recordings, _ = bench
    with pytest.raises(InputError, match=r"fits no fault that the other recordings have too"):
        identify(recordings, experiment="nine_features", together=True, results=tmp_path)
    seeded = [recordings[0], replace(recordings[1], attributes={"health": "seeded"})]
    with pytest.raises(InputError, match=r"1\.nc: has health 'seeded'"):
        identify(seeded, together=True, results=tmp_path)
    with pytest.raises(InputError, match="accepted is a closed form of six or nine features"):
        identify(
            recordings, experiment="rotor_angle_eccentricity", method="angle_resolved", together=True, results=tmp_path
        )

"""Identification of recordings: what does not fit its equations is said and widens the intervals, by every method."""

from dataclasses import replace

import numpy as np
import pytest

from emafault import config
from emafault.dataset import simulate_blocks, simulate_recording
from emafault.errors import InputError
from emafault.faults import FAULT_NAMES
from emafault.identification.fitting import Prior, fit_identifier
from emafault.identification.possible import doubts
from emafault.identification.recordings import Model, identify_recordings
from emafault.identification.rows import TrainingRows
from emafault.reconstruction import join_features, reconstruct

FAULT = np.array([0.05, 0.0, 0.02, 0.05, 0.0, 10.0])
METHODS = {"paper": ("paper", {}), "weighted": ("weighted", {}), "floating": ("weighted", {"floating": True})}
BENT = "effects.back_emf_shape.h5=0.02"


def simulated(*overrides: str, fault: np.ndarray = FAULT):
    return simulate_recording(config.dataset_spec(config.compose("paper", list(overrides)), "fresh"), fault)


@pytest.fixture(scope="module")
def models(actuator):
    blocks = list(simulate_blocks(config.dataset_spec(config.compose("paper"), "training"), 0, 75))
    faults = np.concatenate([block.faults for block in blocks])
    out = {}
    for name, (method, settings) in METHODS.items():
        found = join_features([reconstruct(method, b.signals, b.interval, actuator, settings) for b in blocks])
        covariance = None if method == "paper" else found.covariance
        fit = fit_identifier(TrainingRows(found.inputs, faults, covariance), Prior(actuator))
        out[name] = Model(f"{name}/closed_form", method, settings, fit.identifier, 0.5)
    return out


def widths(estimate) -> np.ndarray:
    return np.array([estimate[name]["high"] - estimate[name]["low"] for name in FAULT_NAMES])


@pytest.mark.parametrize("method", METHODS)
def test_voltages_that_do_not_fit_their_equation_are_told_and_widen_the_intervals(models, method):
    straight, bent = (identify_recordings(models[method], [simulated(*more)]) for more in ([], [BENT]))
    assert "equation" not in straight.notes[0]
    assert "the voltage of phase a, b, c does not fit its equation" in bent.notes[0]
    wide, narrow = widths(bent.estimates[0]), widths(straight.estimates[0])
    assert np.all(wide > 3.0 * narrow)
    assert all(e["low"] < truth < e["high"] for e, truth in zip(bent.estimates[0].values(), FAULT))


@pytest.mark.parametrize("method", METHODS)
def test_a_winding_that_warms_is_told_and_widens_the_intervals(models, method):
    reversal = ["command=reversal", "command.amplitude=0.22", "command.speed=0.66"]
    cold, warm = (
        identify_recordings(models[method], [simulated(*reversal, f"effects.self_heating.heating_rate={rate}")])
        for rate in (0.0, 0.2)
    )
    assert "warms" not in cold.notes[0] and "as of a winding that warms by" in warm.notes[0]
    assert np.all(widths(warm.estimates[0]) > 3.0 * widths(cold.estimates[0]))
    assert all(e["low"] < truth < e["high"] for e, truth in zip(warm.estimates[0].values(), FAULT))


@pytest.mark.parametrize("method", METHODS)
def test_a_healthy_recording_that_does_not_fit_is_named_and_widens_what_it_calibrates(models, method):
    healthy = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 10.0])
    straight, bent = (
        identify_recordings(models[method], [simulated()], [replace(simulated(*more, fault=healthy), name="healthy")])
        for more in ([], [BENT])
    )
    assert "equation" not in straight.notes[0]
    assert "healthy: the voltage of phase a, b, c does not fit its equation" in bent.notes[0]
    assert np.all(widths(bent.estimates[0]) > 2.0 * widths(straight.estimates[0]))


@pytest.mark.parametrize("floating", [False, True])
def test_the_fit_of_simulated_recordings_is_that_of_noise(actuator, floating):
    blocks = simulate_blocks(config.dataset_spec(config.compose("paper"), "fresh"), 0, 50)
    found = join_features(
        [reconstruct("weighted", b.signals, b.interval, actuator, {"floating": floating}) for b in blocks]
    )
    fit, freedom = found.extras["fit"], found.extras["freedom"]
    # standard errors of a mean of chi-squared over its freedom
    assert np.mean(fit) == pytest.approx(1.0, abs=3.5 * np.sqrt(2.0 / np.sum(freedom)))
    scatter = (fit - 1.0) / np.sqrt(2.0 / freedom)
    assert np.std(scatter) == pytest.approx(1.0, abs=3.5 / np.sqrt(2.0 * scatter.size))


@pytest.mark.parametrize(
    ("factor", "says"), [(-1.0, "its sign is reversed"), (180.0 / np.pi, "as if in degrees"), (0.0, "channel is dead")]
)
def test_a_command_that_the_output_does_not_follow_is_refused_as_by_a_diagnosis(models, factor, says):
    plain = simulated()
    wrong = replace(plain, name="r.nc", commanded_position=factor * plain.commanded_position, attributes={})
    with pytest.raises(InputError, match=f"^r.nc: commanded_position .*{says}"):
        identify_recordings(models["weighted"], [wrong])
    with pytest.raises(InputError, match=f"^r.nc: commanded_position .*{says}"):
        identify_recordings(models["weighted"], [plain], [wrong])


def gained(recording, **factors):
    """A recording with channels times factors; ``ib`` is the current of phase b, ends included."""
    out = {}
    for name, factor in factors.items():
        names = ("phase_current", "phase_current_end") if name == "ib" else (name,)
        out |= {n: getattr(recording, n) * ([1.0, factor, 1.0] if name == "ib" else factor) for n in names}
    return replace(recording, name="r.nc", attributes={}, **out)


SCALES = {
    "rotor_speed": "rotor_speed is 1.05 times the rate of rotor_angle",
    "ib": "phase_current of phase b is 1.05 times what adds up to zero with the other two",
}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("channel", SCALES)
def test_a_scale_that_the_recording_itself_tells_is_told_and_widens_the_intervals(models, channel, method):
    straight, off = (
        identify_recordings(models[method], [gained(simulated(), **{channel: factor})]) for factor in (1.0, 1.05)
    )
    assert " times " not in straight.notes[0]
    assert SCALES[channel] in off.notes[0] and off.notes[0].count(" times ") == 1
    wider = np.max(widths(off.estimates[0]) / widths(straight.estimates[0]))
    assert wider > (1.1 if method == "paper" else 5.0)  # whose own are as wide as a quarter of the turns
    if method != "paper":
        assert all(e["low"] < truth < e["high"] for e, truth in zip(off.estimates[0].values(), FAULT))


@pytest.mark.parametrize("channel", SCALES)
def test_a_scale_that_no_sensor_has_is_refused_unless_healthy_recordings_have_it_too(models, channel):
    model = models["weighted"]
    off = gained(simulated(), **{channel: 1.13})
    with pytest.raises(InputError, match=r"^r.nc: .* is 1.13 times .* accepted is 0.9 to 1.1.*--reference calibrates"):
        identify_recordings(model, [off])
    healthy = simulated(fault=np.array([0.0, 0.0, 0.0, 0.0, 0.0, 10.0]))
    found = identify_recordings(model, [off], [gained(healthy, **{channel: 1.13})])
    assert " times " not in found.notes[0]
    assert found.estimates[0]["Na"]["value"] == pytest.approx(FAULT[0], abs=0.01)


def test_turns_below_zero_are_told_and_refused_where_no_unit_looks_like_them(models):
    healthy = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 10.0])
    within, little = (
        identify_recordings(models["weighted"], [gained(simulated(fault=healthy), phase_voltage=f)])
        for f in (1.01, 1.05)
    )
    assert "share of shorted turns" not in within.notes[0]  # two of a unit's standard deviations
    assert "Na is -0.05" in little.notes[0] and "--reference calibrates" in little.notes[0]
    with pytest.raises(InputError, match=r"^r.nc: Na would be -0.2.*share of shorted turns is not negative"):
        identify_recordings(models["weighted"], [gained(simulated(fault=healthy), phase_voltage=1.2)])


def test_an_eccentricity_beyond_the_gap_is_refused():
    of = {"Na": 0.0, "Nb": 0.0, "Nc": 0.0, "xi_x": 0.8, "xi_y": -0.8, "dT": 0.0}
    wide = {n: {"value": v, "low": v - 0.5, "high": v + 0.5} for n, v in of.items()}
    with pytest.raises(InputError, match=r"^r.nc: xi_x and xi_y would be 1.13 together, at 1 the rotor touches"):
        doubts("r.nc", wide, 0.0, 0.9)
    assert doubts("r.nc", wide | {"xi_y": wide["Na"]}, 0.0, 0.9) == []


def test_a_speed_that_stops_changing_at_its_extreme_is_refused(models):
    plain = simulated()
    speed = np.minimum(plain.rotor_speed, 0.6 * plain.rotor_speed.max())
    with pytest.raises(InputError, match="rotor_speed clips"):
        identify_recordings(models["weighted"], [replace(plain, rotor_speed=speed)])

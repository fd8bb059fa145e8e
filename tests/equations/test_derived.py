"""Currents of which one has no sensor, or of which the mean was taken off: their sum tells nothing."""

from dataclasses import asdict, replace

import numpy as np
import pytest

from emafault.actuator.sensors import SensorNoise
from emafault.equations.quality import seen
from emafault.equations.signals import Signals, estimated_noise
from emafault.io.currents_noise import adds_up, derived_phase, shares_of_noise

from .conftest import ACTUATOR, NOISE, machine_of, recorded


def less_the_others(recording, phase):
    """The same where the current of a phase is less the sum of the others."""
    out = {}
    for name in ("phase_current", "phase_current_end"):
        x = getattr(recording, name).copy()
        x[:, phase] -= x.sum(axis=1)
        out[name] = x
    return replace(recording, **out)


def less_their_mean(recording):
    """The same where the currents have their mean taken off."""
    names = ("phase_current", "phase_current_end")
    of = {n: getattr(recording, n) for n in names}
    return replace(recording, **{n: x - x.mean(axis=1, keepdims=True) for n, x in of.items()})


@pytest.mark.parametrize("phase", [0, 2])
def test_a_current_without_a_sensor_is_found_and_the_noise_of_the_others(phase):
    recordings = [less_the_others(recorded(c, seed=n), phase) for n, c in enumerate(("sine", "reversal", "parabolic"))]
    assert derived_phase(recordings) == phase
    found = estimated_noise(recordings, replace(NOISE, current=0.02, current_end=0.05))
    assert found.current == pytest.approx(NOISE.current, rel=0.1)
    assert found.current_end == pytest.approx(NOISE.current_end, rel=0.1)
    signals = Signals.of("a.nc", recordings[0], ACTUATOR, NOISE)
    assert signals.adds_up and signals.derived == phase
    more = signals.disturbed(0).current - signals.current
    assert np.abs(more.sum(axis=1)).max() < 1e-9
    scatter = np.cov(more.T) / NOISE.current**2
    assert scatter == pytest.approx(signals.current_covariance, abs=0.15)
    assert seen(recordings[0])["phase_current"].noise == pytest.approx(NOISE.current, rel=0.15)


def test_what_is_stated_goes_before_what_is_seen():
    stating = replace(less_the_others(recorded("sine"), 1), known={"phase_current": {"derived": "c"}})
    assert derived_phase([stating]) == 2


def test_of_currents_less_their_mean_none_is_derived():
    recordings = [less_their_mean(recorded(c, seed=n)) for n, c in enumerate(("sine", "reversal"))]
    assert derived_phase(recordings) is None
    assert estimated_noise(recordings, NOISE).current == pytest.approx(NOISE.current, rel=0.1)
    signals = Signals.of("a.nc", recordings[0], ACTUATOR, NOISE)
    more = signals.disturbed(0).current - signals.current
    assert np.cov(more.T) / NOISE.current**2 == pytest.approx(signals.current_covariance, abs=0.1)


def test_a_channel_that_lags_behind_the_others_is_no_noise_of_the_currents():
    """The sum of the currents then has of their ripple, many times the noise."""
    entry = {"place": "current_b", "form": "lag", "lag": 0.3}
    recordings = [recorded(c, seed=n, unlisted=[entry]) for n, c in enumerate(("sine", "reversal"))]
    ripple = np.median(np.abs(np.diff(recordings[0].phase_current.sum(axis=1), 2))) / 0.6745 / np.sqrt(18.0)
    found = estimated_noise(recordings, NOISE)
    assert ripple > 1.2 * NOISE.current
    assert found.current == pytest.approx(NOISE.current, rel=0.1)
    assert found.current_end == pytest.approx(NOISE.current_end, rel=0.1)


def test_a_sensor_with_more_noise_than_the_others_is_told_by_its_phase_at_rest():
    rng = np.random.default_rng(5)
    plain = [recorded(c, seed=n) for n, c in enumerate(("sine", "reversal"))]
    louder = [
        replace(r, phase_current=r.phase_current + rng.normal(0.0, 1.0, (len(r.time), 3)) * [0.0, 0.015, 0.0])
        for r in plain
    ]
    true = np.array([NOISE.current**2, NOISE.current**2 + 0.015**2, NOISE.current**2])
    assert shares_of_noise(louder) == pytest.approx(true / true.mean(), rel=0.2)
    assert (shares_of_noise(plain) == 1.0).all() and (shares_of_noise(louder, end=True) == 1.0).all()
    assert estimated_noise(louder, NOISE).current == pytest.approx(np.sqrt(true.mean()), rel=0.1)
    signals = Signals.of("a.nc", louder[0], ACTUATOR, estimated_noise(louder, NOISE))
    more = signals.disturbed(0).current - signals.current
    assert more.std(axis=0) == pytest.approx(np.sqrt(true), rel=0.15)
    assert np.diag(signals.current_covariance)[1] > 2.0 * np.diag(signals.current_covariance)[0]


def test_a_sum_that_is_nothing_by_construction_is_no_equation():
    machine = machine_of({"a.nc": less_the_others(recorded("sine"), 2), "b.nc": recorded("sine")})
    off = {n: p.off for n, p in machine.parameters.items()}
    with_sum = {name: {b.equation for b in machine.blocks(off, name)} for name in ("a.nc", "b.nc")}
    assert with_sum["b.nc"] - with_sum["a.nc"] == {"sensor_current"}


def test_an_error_of_a_sensor_is_in_the_derived_current_too():
    """What the third phase truly carries is less what the others do, whatever their sensors are off by."""
    plain = recorded("sine")
    off = replace(plain, **{
        n: getattr(plain, n) + np.array([0.1, 0.0, 0.0]) for n in ("phase_current", "phase_current_end")
    })  # fmt: skip
    machine = machine_of({"a.nc": less_the_others(off, 2), "b.nc": less_the_others(plain, 2)})
    values = {n: p.off for n, p in machine.parameters.items()}
    with_offset = {b.equation: b.residual for b in machine.blocks({**values, "current_offset.o_a": 0.1}, "a.nc")}
    without = {b.equation: b.residual for b in machine.blocks(values, "b.nc")}
    for equation in ("electrical_a", "electrical_c", "torque"):
        assert with_offset[equation] == pytest.approx(without[equation], abs=1e-4)


def test_gains_that_are_alike_are_not_told_by_a_sum_of_which_one_channel_lags():
    machine = machine_of({"a.nc": recorded("sine", unlisted=[{"place": "current_b", "form": "lag", "lag": 0.3}])})
    at = {n: p.off for n, p in machine.parameters.items()} | {"lag.current_b_late": 0.3}
    block = next(b for b in machine.blocks(at, "a.nc") if b.equation == "sensor_current")
    columns = np.array([block.columns[f"current_gain.g_{j}"] for j in "abc"])
    assert np.abs(columns.sum(axis=0)).max() < 1e-9 < 1e-3 < np.abs(columns).max()


def test_currents_without_noise_add_up_by_themselves():
    none = SensorNoise(**dict.fromkeys(asdict(NOISE), 0.0))
    assert not adds_up(recorded("sine", noise=none)) and adds_up(less_the_others(recorded("sine"), 1))

"""Noise of channels: estimated, or as recordings state it."""

from dataclasses import asdict, replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.ndimage import uniform_filter1d

from emafault.actuator.sensors import SensorNoise
from emafault.equations.point import Point
from emafault.equations.rounding import error, names_of
from emafault.equations.signals import STRETCH, Signals, estimated_noise
from emafault.io.lattice import spacing
from emafault.io.sensors import spikes

from .conftest import ACTUATOR, NOISE, in_steps, machine_of, recorded


def test_stated_noise_is_taken_where_every_recording_states_it():
    plain = recorded()
    stating = [replace(plain, known={"phase_voltage": {"noise": sigma}}) for sigma in (0.3, 0.4)]
    own = estimated_noise([plain, plain], NOISE)
    assert estimated_noise([stating[0], plain], NOISE) == own and own.voltage == NOISE.voltage
    stated = estimated_noise(stating, NOISE)
    assert stated.voltage == pytest.approx((0.5 * (0.09 + 0.16)) ** 0.5) and stated.current == own.current


def test_instants_that_scatter_are_noise_in_proportion_to_the_speed():
    scatter = [{"place": "angle", "form": "clock", "scatter": 1e-5}]
    named = [[recorded(c, seed=n, unlisted=u) for n, c in enumerate(("parabolic", "sine"))] for u in ([], scatter)]
    plain, faulty = (estimated_noise(recordings, NOISE) for recordings in named)
    assert plain.angle_timing == 0.0
    assert faulty.angle_timing == pytest.approx(1e-5, rel=0.05) and faulty.angle == pytest.approx(1e-4, rel=0.2)
    signals = Signals.of("a.nc", named[1][0], ACTUATOR, faulty)
    np.testing.assert_allclose(signals.angle_noise, np.hypot(faulty.angle, faulty.angle_timing * signals.speed))


@pytest.mark.parametrize("offset", [0.0, 0.05, 0.5])
def test_the_currents_noise_is_found_whatever_their_offsets(offset):
    of_unit = {"current_offset": {"o_a": offset, "o_b": -0.6 * offset, "o_c": 0.3 * offset}}
    recordings = [recorded(effects=of_unit, seed=seed) for seed in range(3)]
    found = estimated_noise(recordings, SensorNoise(**{**asdict(NOISE), "current": 0.02, "current_end": 0.05}))
    assert found.current == pytest.approx(NOISE.current, rel=0.08)
    assert found.current_end == pytest.approx(NOISE.current_end, rel=0.08)


def test_currents_that_take_small_ones_for_none_have_noise_where_they_flow():
    recordings = [recorded(seed=n) for n in range(2)]
    dead = [
        replace(r, **{name: x * (np.abs(x) > 0.1) for name in ("phase_current", "phase_current_end")
                      if (x := getattr(r, name)) is not None})
        for r in recordings
    ]  # fmt: skip
    found = estimated_noise(dead, NOISE)
    assert 0.7 * NOISE.current < found.current < 1.1 * NOISE.current  # two of three that flow
    assert 0.7 * NOISE.current_end < found.current_end < 1.1 * NOISE.current_end


@pytest.mark.parametrize("step", [0.02, 0.05, 0.09])
def test_coarse_steps_of_the_currents_are_noise_and_no_spikes(step):
    """Most sums of three rounded currents are the same; where one is taken for a spike, the lattice is lost."""
    recordings = [in_steps(recorded(c, seed=n), {"phase_current": step}) for n, c in enumerate(("sine", "reversal"))]
    rounding = step / np.sqrt(12.0)
    found = estimated_noise(recordings, NOISE).current
    assert 0.999 * rounding < found < 1.05 * np.hypot(rounding, NOISE.current)
    for recording in recordings:
        assert len(spikes(recording.phase_current)) == 0
        assert Signals.of("a.nc", recording, ACTUATOR, NOISE).current_step == pytest.approx(step)


@pytest.mark.parametrize("step", [0.05, 0.09])
def test_over_a_stretch_of_a_slow_current_in_steps_the_error_changes_evenly(step):
    plain = recorded("parabolic")
    fine, coarse = (Signals.of("a.nc", r, ACTUATOR, NOISE) for r in (plain, in_steps(plain, {"phase_current": step})))
    assert fine.stretches() == []
    found = coarse.stretches()
    assert found and all(s.stop - s.start >= STRETCH for s in found)
    assert all(one.stop <= other.start for one, other in pairwise(found))
    slow = uniform_filter1d(coarse.level - fine.level, 20)  # without the sensors' noise
    long = [slow[s] for s in found if s.stop - s.start > 100]
    lines = [np.polynomial.Polynomial.fit(t := np.arange(len(e)), e, 1)(t) for e in long]
    all_of_it, but_a_constant, but_a_line = (
        sum(np.sum((e - of) ** 2) for e, of in zip(long, less, strict=True))
        for less in ([0.0] * len(long), [e.mean() for e in long], lines)
    )
    assert but_a_line < 0.05 * all_of_it and but_a_line < 0.5 * but_a_constant


@pytest.mark.parametrize("command", ["parabolic", "reversal"])
def test_what_coarse_steps_add_to_a_slow_current_goes_with_what_the_torque_needs(command):
    step = 0.09
    plain = recorded(command)
    coarse = in_steps(plain, {"phase_current": step, "phase_current_end": step})
    machine = machine_of({"a.nc": coarse})
    rec = machine.recordings["a.nc"]
    at_off = {n: p.off for n, p in machine.parameters.items()}
    columns = error(rec, Point(at_off, "a.nc")).slopes
    names = [n for n in columns if n.startswith("steps.")]
    known = np.array([columns[n] for n in names]).T[rec.moving]
    added = (np.abs(coarse.phase_current) - np.abs(plain.phase_current)).sum(axis=1)[rec.moving] / 2.0
    left = added - known @ np.linalg.lstsq(known, added, rcond=None)[0]
    slow, slow_left = (np.var(uniform_filter1d(x, 50)) for x in (added, left))
    assert len(names) == 6 and slow_left < 0.3 * slow
    assert names_of(machine_of({"a.nc": plain}).recordings["a.nc"]) == {}


def test_an_encoder_s_counts_are_noise_of_rounding_however_evenly_it_turns():
    counts = 2.0 * np.pi / 4096.0
    turning = [in_steps(recorded(c, seed=n), {"rotor_angle": counts}) for n, c in enumerate(("reversal", "parabolic"))]
    assert estimated_noise(turning, NOISE).angle == pytest.approx(counts / np.sqrt(12.0), rel=0.2)
    evenly = replace(turning[0], rotor_angle=counts * np.round(np.arange(4000) * 20.5))
    assert estimated_noise([evenly], NOISE).angle == pytest.approx(counts / np.sqrt(12.0))
    assert spacing(turning[0].rotor_angle) == pytest.approx(counts) and spacing(recorded().rotor_angle) == 0.0


def test_of_an_output_in_counts_the_rounding_goes_with_its_place():
    counts = 1e-4
    recording = in_steps(recorded("parabolic"), {"output_position": counts})
    machine = machine_of({"a.nc": recording})
    (block,) = (
        b for b in machine.blocks({n: p.off for n, p in machine.parameters.items()}, "a.nc") if b.equation == "position"
    )
    names = [n for n in block.columns if n.startswith("counts.")]
    columns = np.array([block.columns[n] for n in names]).T[block.usable]
    left = block.residual[block.usable]
    fitted = columns @ np.linalg.lstsq(columns, left, rcond=None)[0]
    assert len(names) == 6 and counts**2 / 12.0 < np.var(left) < counts**2 / 8.0
    assert np.var(left - fitted) < 0.7 * np.var(left)


@pytest.mark.parametrize("channel", ["angle", "current", "position", "speed"])
def test_noise_far_above_the_nominal_sensors_is_found(channel):
    noisy = replace(NOISE, **{channel: 10.0 * getattr(NOISE, channel)})
    found = estimated_noise([recorded(seed=seed, noise=noisy) for seed in range(2)], NOISE)
    assert getattr(found, channel) == pytest.approx(10.0 * getattr(NOISE, channel), rel=0.05)


def test_the_noise_s_square_does_not_go_along_the_current():
    """A resistance that depends on the current is a function of its level, times the current: of noise in both, more is
    left where the level is low."""
    noisy = replace(NOISE, current=0.05)
    products = []
    for seed in range(6):
        machine = machine_of({"a.nc": recorded("sine", noise=noisy, seed=seed)})
        off = {n: p.off for n, p in machine.parameters.items()}
        block = next(b for b in machine.blocks(off, "a.nc") if b.equation == "electrical_a")
        level = block.coordinates["current"]
        low = block.usable & (level < np.quantile(level[block.usable], 0.2))
        products.append(np.mean((block.residual * block.coordinates["drivers"][1])[low]))
    expected = -ACTUATOR.resistance * 2.0 / 3.0 * noisy.current**2  # of a current less the mean of three
    assert np.mean(products) == pytest.approx(expected, abs=4.0 * np.std(products) / np.sqrt(len(products)))


def test_a_sample_that_is_held_is_none_of_its_interval():
    plain, rows = recorded(), np.array([400, 900, 1500, 1501])
    at_end = plain.phase_current_end.copy()
    for k in rows:
        at_end[k, 1] = at_end[k - 1, 1]
    of_end = Signals.of("r.nc", replace(plain, phase_current_end=at_end), ACTUATOR, NOISE)
    assert np.array_equal(np.flatnonzero(of_end.lost), [400, 401, 900, 901, 1500, 1501, 1502])
    voltage = plain.phase_voltage.copy()
    for k in rows:
        voltage[k, 2] = voltage[k - 1, 2]
    assert np.array_equal(
        np.flatnonzero(Signals.of("r.nc", replace(plain, phase_voltage=voltage), ACTUATOR, NOISE).lost), rows
    )
    # a phase that is off has no current, and coarse steps repeat by themselves
    quiet = recorded(noise=SensorNoise(**dict.fromkeys(asdict(NOISE), 0.0)))
    coarse = in_steps(plain, {"phase_current": 0.1})
    for recording in (plain, quiet, coarse):
        assert not Signals.of("r.nc", recording, ACTUATOR, NOISE).lost.any()


def test_no_row_of_the_torque_spans_a_reversal_however_quick_it_is():
    quiet = replace(NOISE, angle=1e-3 * NOISE.angle)
    passed = 0
    for frequency in (2.0, 4.0, 6.0):
        quick = recorded("sine", noise=quiet, settings={"amplitude": 0.1, "frequency": frequency})
        machine = machine_of({"a.nc": quick})
        rec = machine.recordings["a.nc"]
        values = {n: p.off for n, p in machine.parameters.items()}
        [block] = [b for b in machine.blocks(values, "a.nc", wanted=set()) if b.equation == "torque"]
        turns = np.flatnonzero((rec.rate[:-1] * rec.rate[1:] < 0.0) & (np.abs(rec.rate[1:]) > 1.0))
        # a row has the interval before its angle and the one after, the speed of a reversal is known to a sample
        assert not block.usable[turns].any()
        passed += len(turns)
    assert passed >= 8

"""Interval means of samples, and what pulses between samples cost."""

import numpy as np
import pytest

from emafault.errors import InputError
from emafault.imports.signal import Signal, pulse_uncertainty

from .checks import bring
from .measured import INTERVAL, NOISE, log, map_of, simulated


def test_pulse_uncertainty_is_that_of_edges_between_samples():
    # 48 V, 20 kHz at 100 kS/s and at 10 MS/s; and against pulses that keep step with the samples
    assert pulse_uncertainty(48.0, 20e3, 1e-5) == pytest.approx(3.9, abs=0.05)
    assert pulse_uncertainty(48.0, 20e3, 1e-7) == pytest.approx(0.039, abs=0.001)
    rng = np.random.default_rng(3)
    rise, width = rng.uniform(0.0, 5e-5, 2000), rng.uniform(1e-5, 4e-5, 2000)
    time = 1e-5 * np.arange(21)
    means = []
    for begin, long in zip(rise, width):
        pulses = 48.0 * (np.mod(time - begin, 5e-5) < long)
        means.append(Signal(time, pulses, False, "", "").means(np.array([0.0, 2e-4]))[0] - 48.0 * long / 5e-5)
    assert np.std(means) == pytest.approx(pulse_uncertainty(48.0, 20e3, 1e-5), rel=0.05)


def test_means_are_exact_for_any_edges():
    rng = np.random.default_rng(1)
    time = np.sort(rng.uniform(0.0, 1.0, 40))
    values = rng.standard_normal(40)
    edges = np.sort(rng.uniform(time[0], time[-1], 9))
    fine_time = np.linspace(edges[0], edges[-1], 400_001)
    line = np.interp(fine_time, time, values)
    total = np.concatenate([[0.0], np.cumsum(0.5 * (line[1:] + line[:-1]) * np.diff(fine_time))])
    expected = np.diff(np.interp(edges, fine_time, total)) / np.diff(edges)
    assert Signal(time, values, False, "", "").means(edges) == pytest.approx(expected, abs=1e-7)
    uniform = 0.1 * np.arange(1, 41)
    stepped = Signal(uniform, values, True, "", "")
    assert stepped.means(np.array([0.0, 0.1, 0.3])) == pytest.approx([values[0], values[1:3].mean()])
    assert stepped.means(np.array([0.05, 0.15])) == pytest.approx([0.5 * (values[0] + values[1])])


def test_instants_of_pulses_are_averaged_and_their_uncertainty_is_written(tmp_path):
    step = 5e-7
    s = simulated(step, duration=0.25)
    kept = slice(1, None, 4)  # 500 kS/s, each the value at an instant
    raw = log({name: values[kept] for name, values in s.items()}, "dc_minus", noisy=False)
    result = bring(tmp_path, map_of("dc_minus", "instants"), log=raw)
    recording = result.recordings["one.nc"]
    coarse = simulated(INTERVAL, duration=0.25)
    begin = round((raw.time[0] % INTERVAL) / step)
    moved = {n: np.roll(v, -begin, axis=0) for n, v in s.items()}
    wanted = moved["phase_voltage"][: len(recording.time) * 400].reshape(-1, 400, 3).mean(axis=1)
    error = recording.phase_voltage - wanted
    noise = recording.known["phase_voltage"]["noise"]
    assert 0.3 < np.sqrt(np.mean(error**2)) / noise < 1.5 and noise > NOISE["u"]
    assert any("a 200 us mean is uncertain by" in text for text in result.lost["one"])
    assert recording.phase_current_end is not None and len(coarse["time"]) >= len(recording.time)


def test_pulses_that_samples_miss_are_refused_until_their_frequency_is_said(tmp_path):
    s = simulated(1e-6, duration=0.3)
    raw = log({name: values[::40] for name, values in s.items()}, "dc_minus", noisy=False)
    given = map_of("dc_minus", "instants")
    with pytest.raises(InputError, match=r"say signals\.phase_voltage\.pwm_frequency"):
        bring(tmp_path, given, log=raw)
    given["signals"]["phase_voltage"]["pwm_frequency"] = "17 kHz"
    result = bring(tmp_path, given, log=log({name: values[::4] for name, values in s.items()}, "dc_minus"))
    noise = result.recordings["one.nc"].known["phase_voltage"]["noise"]  # of what switches between 0 and 48 V
    assert noise == pytest.approx(48.0 * 17e3 * 4e-6 / 6.0**0.5, rel=0.05)

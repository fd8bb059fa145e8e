"""What of a measuring chain is undone in recordings, by the values of a diagnosis."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from emafault.delays import averaged, filtered
from emafault.equations.corrected import corrected

from .conftest import ACTUATOR, recorded


def late(x):
    return x + 0.4 * (np.append(x[:1], x[:-1]) - x)


MADE = {
    "late": (late, {"lag.speed_late": 0.4}, 0.05),
    "late in the sensor": (late, {"lag.speed_sensor_late": 0.4}, 0.05),
    "filtered": (lambda x: filtered(x, 3.0), {"lag.speed_filtered": 3.0}, 0.1),
    "averaged": (lambda x: averaged(x, 3.0), {"lag.speed_averaged": 3.0}, 0.1),
}


@pytest.mark.parametrize("case", MADE)
def test_a_lag_of_the_speed_is_undone(case):
    make, values, left = MADE[case]
    recording = recorded("sine")
    smooth = gaussian_filter1d(recording.rotor_speed, 10.0)
    faulty = {"a.nc": replace(recording, rotor_speed=make(smooth))}
    bench = SimpleNamespace(described=(), machine=SimpleNamespace(actuator=ACTUATOR))
    found = SimpleNamespace(verdict={"discovered": [{"unit": "~lag_speed"}]}, values=values, bench=bench)
    undone, what = corrected(found, faulty)
    assert what == ["lag of the speed channel"]
    inside = slice(20, -20)
    off = [np.std((r.rotor_speed - smooth)[inside]) for r in (undone["a.nc"], faulty["a.nc"])]
    assert off[0] < left * off[1]


def test_what_currents_pick_up_is_undone():
    plain = recorded("sine")
    more = 1e-3 * plain.phase_voltage + np.outer(2e-3 * plain.phase_voltage[:, 1], [0.0, 1.0, 0.0])
    ends = None if plain.phase_current_end is None else plain.phase_current_end + more
    faulty = replace(plain, phase_current=plain.phase_current + more, phase_current_end=ends)
    bench = SimpleNamespace(described=(), machine=SimpleNamespace(actuator=ACTUATOR))
    values = {"pickup.current": 1e-3, "pickup.current_b": 2e-3}
    found = SimpleNamespace(verdict={"discovered": [{"unit": "~crosstalk_current"}]}, values=values, bench=bench)
    undone, what = corrected(found, {"a.nc": faulty})
    assert what == ["pickup of the voltages by the currents"]
    np.testing.assert_allclose(undone["a.nc"].phase_current, plain.phase_current, atol=1e-12)


def test_counts_that_the_angle_has_lost_are_added():
    plain = recorded("reversal")
    angle = plain.rotor_angle + 6e-3 * (plain.time > 0.2)
    bench = SimpleNamespace(described=(), machine=SimpleNamespace(actuator=ACTUATOR))
    found = SimpleNamespace(verdict={"discovered": [{"unit": "~step_change"}]}, values={}, bench=bench)
    undone, what = corrected(found, {"a.nc": replace(plain, rotor_angle=angle)})
    assert what == ["counts that the angle's encoder has lost"]
    np.testing.assert_allclose(undone["a.nc"].rotor_angle, plain.rotor_angle, atol=5e-4)


def test_a_bus_voltage_of_the_recording_s_own_is_undone():
    plain = recorded("reversal")
    bench = SimpleNamespace(described=(), machine=SimpleNamespace(actuator=ACTUATOR))
    values = {"offset_bus_voltage.all@a.nc": 0.5, "drift_bus_voltage.all@a.nc": -0.2}
    found = SimpleNamespace(verdict={"discovered": [{"unit": "~drift_bus_voltage"}]}, values=values, bench=bench)
    share = (np.arange(len(plain.time)) + 0.5) / len(plain.time)
    faulty = replace(plain, bus_voltage=plain.bus_voltage + 0.5 - 0.2 * share)
    undone, what = corrected(found, {"a.nc": faulty})
    assert what == ["drift of the bus voltage"]
    np.testing.assert_allclose(undone["a.nc"].bus_voltage, plain.bus_voltage, atol=1e-12)
    without = replace(plain, bus_voltage=None)
    assert corrected(found, {"a.nc": without})[0]["a.nc"].bus_voltage is None

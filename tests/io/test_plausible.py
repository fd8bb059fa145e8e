"""What units, signs, zeros and broken channels of a recording are refused for, and by what words."""

from dataclasses import replace

import numpy as np
import pytest

from emafault.errors import InputError
from emafault.io.sensors import refuse_mistaken

POLE_PAIRS = 4


def scaled(name, factor):
    return lambda r: replace(r, **{n: getattr(r, n) * factor for n in (name, f"{name}_end") if hasattr(r, n)})


def frozen(name, j):
    def change(r):
        x, half = getattr(r, name).copy(), len(r.time) // 2
        x[half:, j] = x[half, j]
        return replace(r, **{name: x})

    return change


MISTAKES = {
    "mV": (scaled("phase_voltage", 1e3), ("phase_voltage is", "mistaken by a factor of 1000")),
    "a probe's decade": (scaled("phase_voltage", 0.1), ("phase_voltage is", "factor of 0.1")),
    "mA": (scaled("phase_current", 1e3), ("phase_current is", "factor of 1000")),
    "a tenth of the currents": (scaled("phase_current", 0.1), ("phase_current is", "factor of 0.1")),
    "one current's sign": (scaled("phase_current", [1, -1, 1]), ("add up to", "phase b has the wrong sign")),
    "one current's decade": (scaled("phase_current", [1, 1, 10]), ("add up to", "phase c has 10 times its size")),
    "30 degrees": (lambda r: replace(r, rotor_angle=r.rotor_angle + np.pi / 6 / POLE_PAIRS), ("rotor_angle", "ahead")),
    "15 degrees": (
        lambda r: replace(r, rotor_angle=r.rotor_angle - np.pi / 12 / POLE_PAIRS),
        ("rotor_angle", "behind"),
    ),
    "line to line": (
        lambda r: replace(r, phase_voltage=r.phase_voltage - np.roll(r.phase_voltage, -1, axis=1)),
        ("phase_voltage", "from line to line"),
    ),
    "a voltage frozen": (frozen("phase_voltage", 1), ("phase_voltage of phase b stays at", "frozen")),
    "a current frozen": (frozen("phase_current", 2), ("phase_current of phase c stays at", "frozen")),
    "a voltage's offset": (
        lambda r: replace(r, phase_voltage=r.phase_voltage + np.array([5, 0, 0])),
        ("phase a has an offset",),
    ),
    "bus in mV": (lambda r: replace(r, bus_voltage=1e3 * r.bus_voltage), ("bus_voltage is", "factor of 1000")),
    "another actuator": (
        lambda r: replace(r, attributes={**r.attributes, "actuator": '{"pole_pairs": 7}'}),
        ("another actuator", "pole_pairs 7 where 4 is told"),
    ),
}


def test_sound_recordings_are_taken(plain, shop):
    for name, recording in plain.items():
        refuse_mistaken(name, recording, shop.actuator)


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_is_named(plain, shop, name):
    change, says = MISTAKES[name]
    with pytest.raises(InputError) as refused:
        refuse_mistaken("r.nc", change(plain["recording_0.nc"]), shop.actuator)
    text = str(refused.value)
    assert text.startswith("r.nc: ") and "\n" not in text
    for word in says:
        assert word in text


def test_a_lag_and_a_strong_effect_are_no_mistakes(plain, shop):
    r = plain["recording_0.nc"]
    late = replace(r, phase_voltage=np.vstack([r.phase_voltage[:2], r.phase_voltage[:-2]]))
    refuse_mistaken("r.nc", late, shop.actuator)
    strong = {"angle_offset": {"offset": 5.0}, "contact_resistance": {"R_x_a": 0.2}, "current_offset": {"o_a": 0.1}}
    refuse_mistaken(
        "r.nc", shop.record("sine", {"amplitude": 0.03, "frequency": 2.0}, 70.0, "unknown", strong), shop.actuator
    )


def test_a_constant_speed_tells_no_delay_from_the_zero_of_the_angle(shop):
    """A slow ramp of a unit with strong faults: what little its speed changes must not turn the back-EMFs."""
    strong = {"fault": (0.081, 0.043, 0.012, -0.177, -0.03), "theta_0": 3.2336, "duration": 0.65}
    for seed in range(4):
        slow = shop.record("ramp", {"speed": 0.0504}, 75.0, "unknown", seed=seed, **strong)
        refuse_mistaken("r.nc", slow, shop.actuator)

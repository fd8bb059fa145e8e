"""What units, signs, zeros and broken channels of a recording are refused for, and by what words."""

from dataclasses import replace

import numpy as np
import pytest

from emafault.errors import InputError
from emafault.io.scales import current_scales, speed_scale
from emafault.io.sensors import refuse_mistaken

POLE_PAIRS = 4


def scaled(name, factor):
    return lambda r: replace(r, **{n: getattr(r, n) * factor for n in (name, f"{name}_end") if hasattr(r, n)})


def frozen(name, j=..., of=3):
    """A channel that stays the same but for the first and the last of so many parts."""

    def change(r):
        x, part = getattr(r, name).copy(), len(r.time) // of
        x[part:-part, j] = x[part, j]
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
    "speed frozen": (frozen("rotor_speed", of=10), ("rotor_speed stays at", "frozen")),
    "angle frozen": (frozen("rotor_angle", of=10), ("rotor_angle stays at", "frozen")),
    "angle dead": (lambda r: replace(r, rotor_angle=0.0 * r.rotor_angle), ("rotor_angle stays at 0", "frozen")),
    "output frozen": (frozen("output_position", of=10), ("output_position stays at", "frozen")),
    "bus frozen": (frozen("bus_voltage", of=10), ("bus_voltage stays at", "frozen")),
    "speed half as fast again": (scaled("rotor_speed", 1.5), ("rotor_speed is 1.5 times", "accepted is 0.8 to 1.2")),
    "speed of 3 pole pairs for 4": (scaled("rotor_speed", 0.75), ("rotor_speed is 0.75 times", "accepted is 0.8")),
    "a current half as large again": (scaled("phase_current", [1, 1.5, 1]), ("phase b has 1.5 times its size",)),
    "a voltage's offset": (
        lambda r: replace(r, phase_voltage=r.phase_voltage + np.array([5, 0, 0])),
        ("phase a has an offset",),
    ),
    "bus in mV": (lambda r: replace(r, bus_voltage=1e3 * r.bus_voltage), ("bus_voltage is", "factor of 1000")),
    "another actuator": (
        lambda r: replace(r, attributes={**r.attributes, "actuator": '{"pole_pairs": 7}'}),
        ("another actuator", "pole_pairs 7 where 4 is given"),
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


@pytest.mark.parametrize("factor", [0.9, 1.1])
def test_scales_that_a_diagnosis_names_or_describes_are_no_mistakes(plain, shop, factor):
    """Those of the catalogue are a fifth of this and less, what no catalogue lists may be ten per cent."""
    for r in plain.values():
        for change in (scaled("rotor_speed", factor), scaled("phase_current", [1, factor, 1])):
            refuse_mistaken("r.nc", change(r), shop.actuator)


@pytest.mark.parametrize("name", ["rotor_speed", "bus_voltage"])
def test_what_is_held_for_a_while_is_left_to_a_diagnosis(plain, shop, name):
    refuse_mistaken("r.nc", frozen(name)(plain["recording_0.nc"]), shop.actuator)


def test_a_coarse_channel_may_stay_the_same(plain, shop):
    r = plain["recording_1.nc"]
    bus, speed = np.round(r.bus_voltage), 5.0 * np.round(r.rotor_speed / 5.0)
    assert np.ptp(bus) == 0.0
    refuse_mistaken("r.nc", replace(r, bus_voltage=bus, rotor_speed=speed), shop.actuator)


@pytest.mark.parametrize("name", ["recording_0.nc", "recording_2.nc"])
def test_scales_are_those_that_channels_have_within_their_errors(plain, shop, name):
    late = shop.record(
        "sine", {"amplitude": 0.03, "frequency": 4.0}, 20.0, "healthy", {"speed_latency": {"tau": 0.005}}
    )
    for r in (plain[name], late):
        for factor in (1.0, 1.02):
            scale = speed_scale(scaled("rotor_speed", factor)(r))
            assert abs(scale.value - factor) < 4.0 * scale.error < 0.02
            a, b, c = current_scales(scaled("phase_current", [1.0, factor, 1.0])(r))
            for found, truth in ((a, 1.0), (b, factor), (c, 1.0)):
                assert abs(found.value - truth) < 4.5 * found.error < 0.01
            assert bool(b.off) == (factor != 1.0) and not a.off and not c.off


def test_a_constant_speed_tells_no_delay_from_the_zero_of_the_angle(shop):
    """A slow ramp of a unit with strong faults: what little its speed changes must not turn the back-EMFs."""
    strong = {"fault": (0.081, 0.043, 0.012, -0.177, -0.03), "theta_0": 3.2336, "duration": 0.65}
    for seed in range(4):
        slow = shop.record("ramp", {"speed": 0.0504}, 75.0, "unknown", seed=seed, **strong)
        refuse_mistaken("r.nc", slow, shop.actuator)


def test_a_delay_that_makes_up_for_the_zero_at_the_speed_of_the_recording_is_none(shop):
    """At 1 ms a ramp had been 14 degrees ahead, by as much late, and refused."""
    seeded = {"fault": (0.005, 0.008, 0.017, 0.008, 0.006), "theta_0": 0.5318, "duration": 0.69, "interval": 1e-3}
    for seed in range(4):
        fast = shop.record("ramp", {"speed": 0.45237}, -22.9, "seeded", seed=seed, **seeded)
        refuse_mistaken("r.nc", replace(fast, phase_current_end=None), shop.actuator)

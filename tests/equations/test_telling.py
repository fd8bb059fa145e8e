"""Described forms in words."""

from dataclasses import replace

import numpy as np
import pytest

from emafault.diagnosis.described import Described, with_forms
from emafault.diagnosis.scanning import proposed
from emafault.equations import telling
from emafault.equations.telling_chain import told_of_chain

from .conftest import ACTUATOR, NOISE, machine_of, recorded

WARMS_UP = Described(
    "~m", "memory", "electrical_c", 0, (("source", 2.0, 0.0, ""), ("time_constant", 0.12, 0.01, "s")), 0.1, 1.0
)


def test_a_voltage_that_goes_with_time_alone_is_its_channels():
    said = telling.told(WARMS_UP, {"gain": (0.05, 0.001)}, ACTUATOR)
    assert (said["equation"], said["form"], said["along"]) == ("sensor_voltage", "drift", "time")
    assert said["parameters"]["offset"]["value"] == 0.05 and said["parameters"]["time_constant"]["value"] == 0.12
    assert said["sentence"] == (
        "In the measuring chain: the recorded voltage of phase c drifts by 0.05 V from the start, "
        "with a time constant of 0.12 s."
    )


@pytest.mark.parametrize(("change", "equation", "form"), [
    ({"driver": 1}, "electrical_c", "memory"), ({"equation": "torque"}, "torque", "memory"),
    ({"shape": (("source", 0.0, 0.0, ""), ("time_constant", 0.12, 0.01, "s"))}, "electrical_c", "memory"),
])  # fmt: skip
def test_what_is_the_machines_stays_there(change, equation, form):
    said = telling.told(replace(WARMS_UP, **change), {"gain": (0.05, 0.001)}, ACTUATOR)
    assert (said["equation"], said["form"]) == (equation, form)


def test_the_shape_of_the_back_emf_is_told_by_its_harmonics():
    said = told_of_chain(
        "~harmonics_emf", "electrical", {"emf.h3": (-0.02, 1e-3), "emf.h11": (0.004, 1e-3)},
        {"emf.h3": "1", "emf.h11": "1"}, ACTUATOR,
    )  # fmt: skip
    assert (said["equation"], said["form"], said["along"]) == ("electrical", "coefficient", "rotor_angle")
    assert said["sentence"] == (
        "In the electrical equation: the back-EMF of all phases has harmonics beside its trapezoid, "
        "-2 % of order 3 and 0.4 % of order 11."
    )


def test_a_drag_that_goes_says_so():
    shape = (("source", 3.0, 0.0, ""), ("time_constant", 0.02, 1e-3, "s"))
    form = Described("~m", "memory", "torque", 2, shape, 0.1, 1.0)
    said = telling.told(form, {"gain": (0.08, 0.001)}, ACTUATOR)
    assert (said["equation"], said["form"], said["along"]) == ("torque", "memory", "time")
    assert "is there at the start and goes, with a time constant of 0.02 s" in said["sentence"]


def test_a_drag_that_builds_up_over_travel_is_a_memory_along_the_angle():
    form = Described("~t", "travel", "torque", 0, (("length", 4.2, 0.1, "rad"),), 0.1, 1.0)
    said = telling.told(form, {"amplitude": (0.018, 1e-4)}, ACTUATOR)
    assert (said["equation"], said["form"], said["along"]) == ("torque", "memory", "rotor_angle")
    assert said["sentence"] == (
        "In the torque equation: a drag of 0.018 N m builds up anew after each reversal, over a travel of 4.2 rad."
    )


def test_a_wave_of_the_recorded_angle_moves_the_commutations_of_the_point():
    recording = recorded("reversal")
    wave = 2e-4 * np.cos(recording.rotor_angle)
    one = machine_of({"a.nc": recording})
    values = {n: p.off for n, p in one.parameters.items()} | {"controller.commutation_time": 3e-5}
    x = wave[None] / NOISE.angle
    (before,) = [b for b in one.blocks(values, "a.nc", wanted=()) if b.equation == "commutation"]
    column = one.seen_at(values, "a.nc", "commutation", x, {})[0]
    other = machine_of({"a.nc": recording})
    other.recordings["a.nc"] = one.recordings["a.nc"].less("angle", wave)
    (after,) = [b for b in other.blocks(values, "a.nc", wanted=()) if b.equation == "commutation"]
    moved = after.residual - before.residual
    assert "commutation" not in one.seen_in("angle", "a.nc", x)
    assert np.corrcoef(moved, NOISE.angle * column)[0, 1] > 0.99
    assert np.std(NOISE.angle * column) == pytest.approx(np.std(moved), rel=0.05)


def test_a_wave_of_the_speeds_scale_may_be_one_of_the_angle():
    machine = machine_of({"a.nc": recorded()})
    assert machine.channels("sensor_speed", 1) == ("angle",) and machine.channels("torque", 1) == ()


def test_a_wave_of_the_output_may_be_one_of_its_recorder():
    machine = machine_of({"a.nc": recorded()})
    wave = Described("~w", "order", "position", 0, (("order", 0.48, 0.01, "1"),), 1.0, 1.0)
    assert {d.channel for d in proposed(machine, [(9.0, wave)])} == {"", "angle", "output"}


@pytest.mark.parametrize(("share", "says"), [(0.15, "15 % too low at 20 A"), (-0.15, "15 % too high at 20 A")])
def test_a_bent_curve_says_which_way(share, says):
    said = told_of_chain(
        "~curve_current", "sensor_current", {"curve.current_a": (share, 1e-3)}, {"curve.current_a": "1"}, ACTUATOR
    )
    assert said["sentence"].endswith(f"{says}.")


def test_what_several_equations_show_of_a_channel_has_the_shape_that_is_known_best():
    machine = machine_of({"a.nc": recorded()})
    roughly = Described("~p", "order", "position", 0, (("order", 1.001, 6e-4, "1"),), 1.0, 1.0)
    whole = Described("~s", "order", "sensor_speed", 1, (("order", 1.0, 0.0, "1"),), 1.0, 1.0)
    for found in ([(9.0, roughly), (5.0, whole)], [(5.0, roughly), (9.0, whole)]):
        (of_angle,) = (d for d in proposed(machine, found) if d.channel == "angle")
        assert (of_angle.values["order"], of_angle.seen) == (1.0, "sensor_speed")
    other = replace(roughly, shape=(("order", 1.01, 6e-4, "1"),))
    assert len([d for d in proposed(machine, [(9.0, other), (5.0, whole)]) if d.channel == "angle"]) == 2


def test_a_wave_of_the_recorded_angle_goes_along_the_true_one():
    recording = recorded("reversal")
    wave = 0.02 * np.cos(recording.rotor_angle + 0.4)
    form = Described("~o", "order", "sensor_angle", 0, (("order", 1.0, 0.0, "1"),), 1.0, 1.0, channel="angle")
    machine = machine_of({"a.nc": replace(recording, rotor_angle=recording.rotor_angle + wave)})
    found = with_forms(machine, [form]).wrong("a.nc", "angle", {form: 0.02 * np.array([np.cos(0.4), -np.sin(0.4)])})
    np.testing.assert_allclose(found, wave, atol=1e-7)


@pytest.mark.parametrize(("of", "said"), [
    ("all", "voltages differs between recordings, by +0 to +2 % from that in one of them."),
    ("c", "voltage of phase c differs between recordings, by +1 to +2 %."),
])  # fmt: skip
def test_a_gain_of_all_phases_is_told_against_that_in_one_recording(of, said):
    gains = {f"gain_voltage.{of}@{n}.nc": (0.01 * n, 1e-4) for n in (1, 2)}
    told = told_of_chain("~gain_voltage", "sensor_voltage", gains, dict.fromkeys(gains, "1"), ACTUATOR)
    assert told["sentence"].endswith(said)


def test_a_gain_that_drifts_is_told_with_what_it_comes_to():
    gains = {f"gain_drift_current.all@{n}.nc": (0.01 * n, 1e-4) for n in (1, 2)}
    told = told_of_chain("~gain_current", "sensor_current", gains, dict.fromkeys(gains, "1"), ACTUATOR)
    said = "In the measuring chain: the gain of the recorded currents drifts along each recording, by +1 to +2 % to its"
    assert told["sentence"] == f"{said} end." and told["form"] == "drift"


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({"rate_voltage.c": (0.2, 1e-3)}, "drifts by 0.2 V/s"),
        (
            {"offset_voltage.c": (0.1, 1e-3), "rate_voltage.c": (0.2, 1e-3)},
            "has an offset of 0.1 V and drifts by 0.2 V/s",
        ),
    ],
)
def test_a_channel_that_drifts_alike_in_all_recordings_is_told_by_its_rate(values, says):
    units = {"rate_voltage.c": "V/s", "offset_voltage.c": "V"}
    told = told_of_chain("~drift_voltage_c", "sensor_voltage", values, {n: units[n] for n in values}, ACTUATOR)
    assert told["sentence"] == f"In the measuring chain: the voltage channel of phase c {says}."


@pytest.mark.parametrize(
    ("unit", "equation", "values", "units", "says"),
    [
        (
            "~drift_bus_voltage", "bus", {f"offset_bus_voltage.all@{n}.nc": (0.2 * n, 1e-3) for n in (-1, 2)}, "V",
            "In the supply, or in the channel of its voltage: the offset of the bus voltage differs between recordings"
            ", from -0.2 to 0.4 V.",
        ),
        (
            "~saliency", "electrical", {"saliency.cos": (0.03, 1e-3), "saliency.sin": (-0.04, 1e-3)}, "1",
            "In the electrical equation: the inductances go with the rotor's angle (saliency), by 5 % twice per turn of"
            " the field.",
        ),
        (
            "~mutual", "electrical",
            {"mutual.ab": (0.05, 1e-3), "mutual.bc": (-0.01, 1e-3), "mutual.ca": (-0.01, 1e-3)}, "1",
            "In the electrical equation: the inductances between phases differ from their mean, over that of one phase:"
            " +4 % between a and b, -2 % between b and c, -2 % between c and a.",
        ),
        (
            "~load", "torque", {f"load.each@{n}.nc": (0.002 * n, 1e-5) for n in (-1, 2)}, "N m",
            "In the torque equation: a constant load differs between recordings, from -0.002 to 0.004 N m at the rotor"
            ".",
        ),
    ],
)  # fmt: skip
def test_what_acts_in_an_equation_is_told_there(unit, equation, values, units, says):
    told = told_of_chain(unit, equation, values, dict.fromkeys(values, units), ACTUATOR)
    assert (told["sentence"], told["equation"]) == (says, equation)
    assert told["form"] == ("coefficient" if equation == "electrical" else "drift")

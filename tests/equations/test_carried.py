"""What is described becomes an entry that simulators have: of the same values, where the form's driver acts."""

from dataclasses import replace

import numpy as np
import pytest

from emafault.actuator.commands import command_positions
from emafault.actuator.parameters import make_runs
from emafault.actuator.simulate import time_axis
from emafault.actuator.unlisted import followed, row_of
from emafault.dataset import simulate_and_measure
from emafault.diagnosis.described import Described, WithForms
from emafault.diagnosis.forms import FORMS
from emafault.diagnosis.scanning import proposed, refined
from emafault.diagnosis.whitening import Weights
from emafault.equations.carried import DRIVERS, of_chain, of_form
from emafault.equations.handover import experiment_text
from emafault.equations.telling import differing_settings
from emafault.io.recording import Recording
from emafault.schema import check_unlisted

from .conftest import ACTUATOR, COMMANDS, SPEC, machine_of

SHAPES = {
    "order": {"order": 2.4}, "frequency": {"frequency": 40.0}, "bump": {"centre": 6.0, "width": 0.4},
    "step_change": {"time": 0.30003}, "pulse": {"time": 0.20003, "until": 0.35003}, "power": {"exponent": 2.0},
    "memory": {"source": 0.0, "time_constant": 0.1},
    "function": {"coordinate": 0.0, "from": -100.0, "to": 150.0}, "travel": {"length": 2.0},
}  # fmt: skip


def described(word, equation="torque", driver=0, shape=None, channel=""):
    """A form with a shape that is known exactly."""
    rows = tuple((n, v, 0.0, "1") for n, v in (shape or SHAPES[word]).items())
    return Described(f"~{word}", word, equation, driver, rows, 1.0, 1.0, channel=channel)


def coefficients(form, recordings):
    """Coefficients of a form, another for each, as a fit gives them."""
    names = dict.fromkeys(n for r in recordings for n in form.names(r))
    return {n: (0.3 + 0.2 * k, 0.01) for k, n in enumerate(names)}


@pytest.mark.parametrize("word", FORMS)
def test_an_entry_has_the_values_of_the_form(word):
    t = np.linspace(0.0, 0.6, 6001)
    theta, w = 0.4 + 100.0 * t**2, 200.0 * t
    along = {
        "time": t,
        "angle": theta,
        "rotor_angle": np.mod(theta, 2 * np.pi),
        "rotor_speed": w,
        "current": 1.0 + 3.0 * t,
    }
    form = described(word)
    linear = coefficients(form, ["a", "b"])
    entry = of_form(form, linear, ["a", "b"], ACTUATOR)
    check_unlisted([entry])
    for name in ("a", "b"):
        wanted = np.array([linear[n][0] for n in form.names(name)]) @ FORMS[word].columns(along, form.values)
        own = entry | entry.get("recordings", {}).get(name, {})
        row = row_of({key: value for key, value in own.items() if key != "recordings"})
        got = followed(row, t, theta, w, along["current"], 0.0 * t, 20.0)
        np.testing.assert_allclose(got, wanted, atol=2e-3 * np.abs(wanted).max())


def recorded(unlisted, voltage=0.1, interval=2e-4):
    """A recording of the nominal unit with these entries, its noise a tenth of the usual, that of voltages ``voltage``
    times the usual."""
    runs = make_runs(ACTUATOR, np.zeros((1, 6)), theta_0=0.7)
    position = command_positions("sine", COMMANDS["sine"], 0.8, ACTUATOR.control_period)
    sensors = {name: (voltage if name == "voltage" else 0.1) * value for name, value in SPEC["sensors"].items()}
    spec = {"sensors": sensors, "seed": 1, "unlisted": unlisted}
    out = simulate_and_measure(spec, runs, position, 0.8, interval, recording="a.nc")
    ambient = float(out.pop("ambient_temperature")[0])
    return Recording(
        time=time_axis(0.8, interval), ambient_temperature=ambient, attributes={"health": "healthy"},
        **{k: v[0] for k, v in out.items()},
    )  # fmt: skip


def found(form, entry):
    """Coefficient of a form, by least squares in its equation, with an entry simulated less that without."""
    values = []
    for unlisted in ([entry], []):
        machine = WithForms(machine_of({"a.nc": recorded(unlisted)}), [form])
        off = {n: p.off for n, p in machine.parameters.items()}
        block = next(b for b in machine.blocks(off, "a.nc") if b.equation == (form.seen or form.equation))
        (name,) = form.names("a.nc")
        column = block.columns[name][block.usable]
        values.append(-float(column @ block.residual[block.usable]) / float(column @ column))
    return values[0] - values[1]


#: of each driver a coefficient that is plain to see, in the units of the equation
SIZES = {"electrical": (0.5, 0.3, 0.4), "torque": (0.01,) * 6, "sensor_speed": (2.0, 3.0)}
SIZES |= {"sensor_current": (0.3, 0.1, 0.1), "position": (1e-4, 1e-4, 1e-4), "bus": (1.0,)}


@pytest.mark.parametrize(
    ("equation", "driver"), [(equation, d) for equation, places in DRIVERS.items() for d in range(len(places))]
)
def test_a_place_is_what_its_driver_multiplies(equation, driver):
    size = SIZES[equation.partition("_")[0] if equation.startswith("electrical") else equation][driver]
    form = described("step_change", equation, driver)
    entry = of_form(form, {form.names("a.nc")[0]: (size, 0.0)}, ["a.nc"], ACTUATOR)
    assert entry["place"] == DRIVERS[equation][driver]
    assert found(form, entry) == pytest.approx(size, rel=0.1)


@pytest.mark.parametrize(
    ("coefficient", "equation", "driver", "size"),
    [
        ("k", "electrical_b", 2, 0.05),
        ("k", "torque", 2, 0.05),
        ("k_b", "torque", 2, 0.1),
        ("R", "electrical_c", 1, 0.1),
    ],
)
def test_a_coefficient_is_in_every_equation_that_has_it(coefficient, equation, driver, size):
    """Whichever of them the scan has seen it in: as much in each of the others as the simulator makes it."""
    form = described("step_change", "electrical", driver, channel=coefficient)
    entry = of_form(form, {form.names("a.nc")[0]: (size, 0.0)}, ["a.nc"], ACTUATOR)
    check_unlisted([entry])
    assert found(replace(form, seen=equation), entry) == pytest.approx(size, rel=0.1)


def test_what_is_in_a_channel_or_a_coefficient_lies_there():
    form = described("order", "sensor_angle", channel="angle")
    assert of_form(form, coefficients(form, ["a"]), ["a"], ACTUATOR)["place"] == "angle"
    form = described("step_change", "sensor_voltage", channel="voltage")
    entry = of_form(form, coefficients(form, ["a"]), ["a"], ACTUATOR)
    assert entry["place"] == "voltage"
    check_unlisted([entry])
    form = described("bump", "electrical_b", 2, channel="k_b")
    entry = of_form(form, {form.names("a")[0]: (-0.1, 0.01)}, ["a"], ACTUATOR)
    assert entry == {"place": "emf_b", "form": "bump", "centre": 6.0, "width": 0.4, "depth": -0.1}
    assert of_form(described("order", "bus", 1), {}, ["a"], ACTUATOR) is None


@pytest.mark.parametrize(
    ("unit", "values", "wanted"),
    [
        ("~lag_voltage", {"lag.voltage_late": 0.4}, {"place": "voltage", "form": "lag", "lag": 0.4}),
        ("~lag_output", {"lag.output_early": 0.4}, {"place": "output", "form": "lag", "lag": -0.4}),
        (
            "~controller_feedforward",
            {"command.feedforward": 0.4},
            {"place": "command", "form": "feedforward", "gain": 0.4},
        ),
        (
            "~controller_filter",
            {"command.filter": 0.004},
            {"place": "command", "form": "command_filter", "time_constant": 0.004},
        ),
        ("~lag_current", {"lag.current_smoothed": 0.4}, {"place": "current", "form": "smoothing", "delay": 0.4}),
        ("~lag_speed", {"lag.speed_filtered": 0.4}, {"place": "speed", "form": "low_pass", "delay": 0.4}),
        ("~lag_output", {"lag.output_butterworth": 4.0}, {"place": "output", "form": "butterworth", "delay": 4.0}),
        ("~lag_speed", {"lag.speed_averaged": 4.0}, {"place": "speed", "form": "averaging", "samples": 9.0}),
        ("~lag_voltage", {"lag.voltage_filtered": 0.4}, {"place": "voltage", "form": "low_pass", "delay": 0.4}),
        (
            "~crosstalk_current",
            {"crosstalk_current.ab": 0.05},
            {"place": "current_a", "form": "crosstalk", "source": "b", "gain": 0.05},
        ),
        (
            "~crosstalk_current",
            {"pickup.current_b": 5e-4},
            {"place": "current_b", "form": "pickup", "gain": 5e-4},
        ),
        (
            "~crosstalk_voltage",
            {"crosstalk_voltage.cb": 0.05},
            {"place": "voltage_c", "form": "crosstalk", "source": "b", "gain": 0.05},
        ),
        (
            "~drift_speed",
            {"offset_speed.all": 0.5},
            {"place": "speed", "form": "drift", "at_start": 0.5, "at_end": 0.5},
        ),
        (
            "~drift_voltage_c",
            {"offset_voltage.c": 0.1, "rate_voltage.c": 0.2},
            {
                "place": "voltage_c", "form": "drift", "at_start": 0.1, "at_end": 0.4,
                "recordings": {"one.nc": {"at_start": 0.1, "at_end": 0.3}, "two.nc": {"at_start": 0.1, "at_end": 0.5}},
            },
        ),
        (
            "~drift_bus_voltage",
            {"offset_bus_voltage.all@one.nc": -0.5, "offset_bus_voltage.all@two.nc": 0.3},
            {
                "place": "bus_voltage", "form": "drift", "at_start": -0.1, "at_end": -0.1,
                "recordings": {
                    "one.nc": {"at_start": -0.5, "at_end": -0.5}, "two.nc": {"at_start": 0.3, "at_end": 0.3},
                },
            },
        ),
        (
            "~load",
            {"load.each@one.nc": 0.004, "load.each@two.nc": -0.002},
            {
                "place": "torque", "form": "pulse", "time": 0.0, "until": 2.0, "jump": -0.001,
                "recordings": {"one.nc": {"jump": -0.004}, "two.nc": {"jump": 0.002}},
            },
        ),
        ("~curve_voltage", {"curve.voltage": 0.02}, {"place": "voltage", "form": "sensor_curve", "bend": 0.02}),
        ("~curve_current", {"curve.current_c": 0.02}, {"place": "current_c", "form": "sensor_curve", "bend": 0.02}),
        ("~curve_current", {"halves.current_a": 0.01}, {"place": "current_a", "form": "sensor_curve", "halves": 0.01}),
        (
            "~curve_current",
            {"dead.current": 0.05, "dead.turn": 0.1},
            {"place": "current", "form": "sensor_curve", "dead": 0.05},
        ),
        (
            "~drop_voltage",
            {"drop.voltage_b": 0.4, "drop.turn": 0.1},
            {"place": "voltage_b", "form": "drop", "drop": 0.4, "turn": 0.1},
        ),
        (
            "~drift_current_b",
            {"drift_current.b@one.nc": 0.1, "drift_current.b@two.nc": 0.3},
            {
                "place": "current_b", "form": "drift", "at_end": 0.2,
                "recordings": {"one.nc": {"at_end": 0.1}, "two.nc": {"at_end": 0.3}},
            },
        ),
        (
            "~drift_voltage_b",
            {
                "offset_voltage.b@one.nc": 0.1, "offset_voltage.b@two.nc": 0.3,
                "drift_voltage.b@one.nc": 0.2, "drift_voltage.b@two.nc": -0.2,
            },
            {
                "place": "voltage_b", "form": "drift", "at_start": 0.2, "at_end": 0.2,
                "recordings": {"one.nc": {"at_start": 0.1, "at_end": 0.3}, "two.nc": {"at_start": 0.3, "at_end": 0.1}},
            },
        ),
        (
            "~gain_current",
            {"gain_current.all@one.nc": 0.01, "gain_current.all@two.nc": 0.03},
            {
                "place": "current", "form": "gain", "gain": 0.02,
                "recordings": {"one.nc": {"gain": 0.01}, "two.nc": {"gain": 0.03}},
            },
        ),
        (
            "~gain_voltage",
            {"gain_voltage.c@one.nc": 0.01},
            {"place": "voltage_c", "form": "gain", "gain": 0.01, "recordings": {"one.nc": {"gain": 0.01}}},
        ),
        (
            "~harmonics_emf",
            {"emf.h3": -0.02, "emf.h11": 0.004},
            {"place": "emf", "form": "harmonics", "h3": -0.02, "h11": 0.004},
        ),
        (
            "~coefficient_winding",
            {"winding.back_emf_b": 0.01, "winding.inductance_c": -0.03},
            {"place": "winding", "form": "coefficient", "back_emf_b": 0.01, "inductance_c": -0.03},
        ),
        ("~clock_angle", {"clock_rate.angle": 2e-4}, {"place": "angle", "form": "clock", "rate": 2e-4}),
        (
            "~clock_motion",
            {"clock.motion@one.nc": 0.2, "clock.motion@two.nc": 0.6, "clock_rate.motion": -1e-4},
            {
                "place": "motion", "form": "clock", "late": 0.4, "rate": -1e-4,
                "recordings": {"one.nc": {"late": 0.2}, "two.nc": {"late": 0.6}},
            },
        ),
        ("~scale_output", {"gain_output.recorder": 0.01}, {"place": "output", "form": "gain", "gain": 0.01}),
        (
            "~gain_current",
            {"gain_drift_current.a@one.nc": 0.01, "gain_drift_current.a@two.nc": 0.02},
            {
                "place": "current_a", "form": "gain", "gain": 0.0, "growth": 0.015,
                "recordings": {"one.nc": {"gain": 0.0, "growth": 0.01}, "two.nc": {"gain": 0.0, "growth": 0.02}},
            },
        ),
    ],
)  # fmt: skip
def test_faults_of_the_measuring_chain(unit, values, wanted):
    entry = of_chain(unit, {n: (v, 0.01) for n, v in values.items()}, {"one.nc": 1.0, "two.nc": 2.0})
    assert entry == wanted
    check_unlisted([entry])


def test_an_experiment_says_what_it_does_not_simulate():
    gain = {"value": 80.0, "low": 79.0, "high": 81.0, "nominal": 100.0}
    verdict = {
        "bench": "mine", "verdict": "partly", "digest": "0", "which": [{"effects": ["cogging"]}],
        "controller": {"position_gain": gain, "speed_gain": gain | {"nominal": 80.5}},
        "discovered": [
            {"equation": "bus", "form": "remainder", "sentence": "The bus equation leaves more."},
            {"equation": "torque", "form": "order", "sentence": "A wave.", "term": {"place": "torque"}},
        ],
    }  # fmt: skip
    text = experiment_text(verdict, {"cogging": {"a": 0.01}}, "mine")
    assert "# not simulated: The bus equation leaves more.\n" in text and "A wave." not in text
    assert "place: torque" in text and "position_gain: 80.0" in text and "speed_gain" not in text


@pytest.mark.parametrize(("unit", "told"), [("remainder:control", False), ("remainder:commutation", True)])
def test_a_gain_is_told_beside_what_the_commutations_leave_but_not_beside_what_the_control_law_does(unit, told):
    """What the control law leaves may be a gain's doing; the commutations depend on no gain."""
    gain = {"value": 0.2, "low": 0.19, "high": 0.21, "nominal": 0.25}
    left = {"unit": unit, "equation": "control", "form": "remainder"}
    found = differing_settings({"controller": {"speed_gain": gain}, "discovered": [left]})
    assert ("speed_gain" in found) is told


def test_a_wave_lies_alike_in_both_directions():
    """A row of the torque equation is between two intervals, a sample of an angle at an interval's end."""
    of_torque = Described("~o", "order", "torque", 0, (("order", 5.3, 0.0, "1"),), 1.0, 1.0)
    of_angle = Described("~o", "order", "sensor_angle", 0, (("order", 5.3, 0.0, "1"),), 1.0, 1.0, "position", "angle")
    of_output = Described("~o", "order", "position", 0, (("order", 5.3, 0.0, "1"),), 1.0, 1.0)
    for form, size in ((of_torque, 0.01), (of_angle, 2e-3), (of_output, 1e-4)):
        names = form.names("a.nc")
        entry = of_form(form, {names[0]: (size, 0.0), names[1]: (0.0, 0.0)}, ["a.nc"], ACTUATOR)
        rows = []
        for unlisted in ([entry], []):
            machine = WithForms(machine_of({"a.nc": recorded(unlisted)}), [form])
            off = {n: p.off for n, p in machine.parameters.items()}
            block = next(b for b in machine.blocks(off, "a.nc") if b.equation == (form.seen or form.equation))
            rows.append((block, np.column_stack([*(block.columns[n] for n in names), block.residual])))
        direction = block.coordinates["direction"]
        clear = block.usable & rows[0][0].usable & (np.abs(block.coordinates["rotor_speed"]) > 20.0)
        phases = []
        for sign in (1.0, -1.0):
            mine = clear & (direction == sign)
            columns = rows[0][1][mine, :2]
            left = (rows[0][1] - rows[1][1])[mine, 2]
            cosine, sine = np.linalg.lstsq(columns, -left, rcond=None)[0]
            assert np.hypot(cosine, sine) == pytest.approx(size, rel=0.1)
            phases.append(np.arctan2(sine, cosine))
        assert np.abs(phases).max() < 0.02


@pytest.mark.parametrize(("channel", "equation", "size"), [("angle", "torque", 5e-4), ("output", "position", 1e-4)])
def test_a_hum_of_a_channel_that_is_sampled_has_its_phase(channel, equation, size):
    form = Described("~h", "frequency", channel, 0, (("frequency", 60.0, 0.0, "Hz"),), 1.0, 1.0, "position", channel)
    names = form.names("a.nc")
    entry = of_form(form, {names[0]: (size, 0.0), names[1]: (0.0, 0.0)}, ["a.nc"], ACTUATOR)
    check_unlisted([entry])
    rows = []
    for unlisted in ([entry], []):
        machine = WithForms(machine_of({"a.nc": recorded(unlisted)}), [form])
        off = {n: p.off for n, p in machine.parameters.items()}
        block = next(b for b in machine.blocks(off, "a.nc") if b.equation == equation)
        rows.append((block, np.column_stack([*(block.columns[n] for n in names), block.residual])))
    clear = block.usable & rows[0][0].usable
    left = (rows[0][1] - rows[1][1])[clear, 2]
    cosine, sine = np.linalg.lstsq(rows[1][1][clear, :2], -left, rcond=None)[0]
    assert np.hypot(cosine, sine) == pytest.approx(size, rel=0.1)
    assert abs(np.arctan2(sine, cosine)) < 0.02


COARSE = [
    ({"form": "order", "amplitude": 0.02, "phase": 0.0}, {"order": 9.0}, 0.02),
    ({"form": "bump", "depth": 0.05}, {"centre": 2.0, "width": 0.12}, 0.05),
]


@pytest.mark.parametrize(("sized", "shape", "size"), COARSE, ids=["order", "bump"])
def test_a_form_is_as_large_where_an_interval_sweeps_much_of_it(sized, shape, size):
    entry = {"place": "torque", **sized, **shape}
    form = described(entry["form"], shape=shape)
    rows = []
    for unlisted in ([entry], []):
        machine = WithForms(machine_of({"a.nc": recorded(unlisted, interval=1e-3)}), [form])
        off = {n: p.off for n, p in machine.parameters.items()}
        block = next(b for b in machine.blocks(off, "a.nc") if b.equation == "torque")
        rows.append((block, np.column_stack([*(block.columns[n] for n in form.names("a.nc")), block.residual])))
    speed = np.abs(block.coordinates["rotor_speed"])
    fast = block.usable & rows[0][0].usable & (speed > 0.7 * speed.max())
    left = (rows[0][1] - rows[1][1])[fast, -1]
    found = np.linalg.lstsq(rows[0][1][fast, :-1], -left, rcond=None)[0]
    assert np.hypot(*found, *[0.0] * (2 - len(found))) == pytest.approx(size, rel=0.05)


def test_what_the_motor_s_torque_lacks_about_an_angle_may_be_the_magnet_of_any_phase_or_all():
    machine = machine_of({"a.nc": recorded([])})
    bump = Described("~b", "bump", "torque", 2, (("centre", 2.0, 0.1, "rad"), ("width", 0.4, 0.1, "rad")), 1.0, 1.0)
    _, *elsewhere = proposed(machine, [(9.0, bump)])
    assert [(f.channel, f.equation, f.seen) for f in elsewhere] == [
        *((f"k_{j}", f"electrical_{j}", "torque") for j in "abc"),
        ("k", "electrical", "torque"),
    ]
    friction = Described("~f", "bump", "torque", 1, bump.shape, 1.0, 1.0)
    assert proposed(machine, [(9.0, friction)]) == [friction]


def test_a_coefficient_of_two_equations_is_looked_at_in_both():
    """Loud voltages say little of a weak magnet, the torque all."""
    rows = (("centre", 2.3, 0.1, "rad"), ("width", 0.55, 0.1, "rad"))
    form = Described("~b", "bump", "electrical_b", 2, rows, 1.0, 1.0, "electrical_b", "k_b")
    entry = {"place": "emf_b", "form": "bump", "centre": 2.1, "width": 0.4, "depth": -0.1}
    machine = WithForms(machine_of({"a.nc": recorded([entry], voltage=30.0)}), [form])
    off = {n: p.off for n, p in machine.parameters.items()}
    blocks = machine.blocks(off, "a.nc")
    loud = {b.equation: 900.0 if b.equation.startswith("electrical") else 1.0 for b in blocks}
    white = {b.equation: Weights(b.usable, np.zeros(0), np.full(len(b.residual), loud[b.equation])) for b in blocks}
    better = refined(machine, form, blocks, {"a.nc": white}, off, {}).values
    assert better["centre"] == pytest.approx(2.1, abs=0.04)
    assert better["width"] == pytest.approx(0.4, abs=0.04)

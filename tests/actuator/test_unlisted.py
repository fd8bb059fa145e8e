"""Terms that no catalogue lists: each is what it says, and one that is a listed effect by another name acts alike."""

import numpy as np
import pytest

from emafault.actuator.commands import command_positions, seen_by_controller
from emafault.actuator.fixed_step import simulate_fixed_step
from emafault.actuator.parameters import make_runs, with_coefficients
from emafault.actuator.simulate import simulate
from emafault.actuator.unlisted import COORDINATES, PLACES, SHAPES, acting, remembered, term
from emafault.config import reference_actuator
from emafault.dataset import simulate_and_measure
from emafault.effects import EFFECTS
from emafault.errors import InputError

TABLE = np.array([0.0, 1.0, 3.0, 3.0])


def value(shape, t=0.0, theta=0.0, w=0.0, current=0.0, turned=0.0, memory=0.0, **parameters):
    return acting(term("torque", shape, **parameters), t, theta, w, current, turned, 20.0, memory, TABLE)


def function_of(coordinate, low, high, values):
    return {"coordinate": list(COORDINATES).index(coordinate), "from": low, "to": high} | {
        f"at_{n + 1}": v for n, v in enumerate(values)
    }


CUBE = function_of("current", 1.0, 6.0, [x**3 for x in range(1, 7)])


@pytest.mark.parametrize(
    ("got", "wanted"),
    [
        (value("order", theta=2.0, amplitude=0.3, order=2.5, phase=1.0), 0.3 * np.cos(6.0)),
        (value("frequency", t=0.01, amplitude=0.3, frequency=50.0, phase=0.0), 0.3 * np.cos(np.pi)),
        (value("step_change", t=0.1, jump=0.3, time=0.2), 0.0),
        (value("step_change", t=0.3, jump=0.3, time=0.2), 0.3),
        (value("pulse", t=0.1, jump=0.3, time=0.2, until=0.4), 0.0),
        (value("pulse", t=0.3, jump=0.3, time=0.2, until=0.4), 0.3),
        (value("pulse", t=0.5, jump=0.3, time=0.2, until=0.4), 0.0),
        (value("power", w=-200.0, at_100_rad_s=0.1, exponent=2.0), 0.4),
        (value("function", current=3.5, **CUBE), 3.5**3),
        (value("function", current=0.0, **CUBE), 1.0),
        (value("function", current=9.0, **CUBE), 216.0),
        (value("function", turned=0.15, **function_of("output_angle", 0.0, 0.5, [0, 1, 2, 3, 4, 5])), 1.5),
        (value("function", **function_of("temperature", 0.0, 100.0, [0, 1, 2, 3, 4, 5])), 1.0),
        (value("bump", theta=6.0 + 8.0 * np.pi, depth=0.2, centre=6.0, width=0.1), 0.2),
        (value("bump", theta=6.1, depth=0.2, centre=0.1, width=0.1), 0.2 * np.exp(-0.5 * (2.831853) ** 2)),
        (value("memory", memory=0.5, gain=0.2, time_constant=1.0, source=1), 0.1),
        (value("memory", memory=0.25, gain=0.2, time_constant=1.0, source=3), 0.15),
        (value("sweep", t=0.5, amplitude=1.0, frequency=2.0, rate=4.0, phase=0.0), np.cos(2 * np.pi * 1.5)),
        (value("burst", t=0.1, amplitude=1.0, time=0.2, decay=0.1, frequency=10.0), 0.0),
        (value("burst", t=0.225, amplitude=1.0, time=0.2, decay=0.1, frequency=10.0), np.exp(-0.25)),
        (value("travel", memory=0.5, amplitude=0.2, length=1.0), -0.1),
        (value("table", t=1.5e-3, amplitude=2.0), 4.0),
        (value("table", t=1.0, amplitude=2.0), 6.0),
    ],
)
def test_values(got, wanted):
    assert got == pytest.approx(wanted, abs=1e-6)


def test_memories():
    drag = term("drag", "memory", gain=1.0, time_constant=0.1, source=1)
    assert remembered(drag, -100.0, 9.0, 0.0, 0.1) == pytest.approx(1.0 - np.exp(-1.0))
    heat = term("resistance_a", "memory", gain=1.0, time_constant=0.1, source=0)
    assert remembered(heat, -100.0, 4.0, 0.0, 0.1) == pytest.approx(4.0 * (1.0 - np.exp(-1.0)))
    seal, memory = term("torque", "travel", amplitude=1.0, length=0.5), 0.0
    for _ in range(4000):
        memory = remembered(seal, 10.0, 0.0, memory, 1e-4)
    assert memory == pytest.approx(1.0, abs=1e-2)
    assert remembered(seal, -10.0, 0.0, memory, 1e-4) < memory


def simulated(effects=None, duration=0.1, **more):
    actuator = reference_actuator()
    runs = make_runs(actuator, np.zeros((1, 6)), effects=effects or {})
    command = command_positions("ramp", {"speed": 0.3}, duration, actuator.control_period)
    return simulate_fixed_step(runs, command, duration, 2e-4, 4e-6, **more)


@pytest.mark.parametrize(
    ("effects", "row"),
    [
        ({"load_constant": {"T": 5.0}}, term("torque", "step_change", jump=-5.0 / 500.0, time=0.0)),
        ({"contact_resistance": {"R_x_b": 0.05}}, term("resistance_b", "step_change", jump=0.05, time=0.0)),
        ({"cogging": {"a": 0.01}}, term("torque", "order", amplitude=0.01, order=72.0, phase=np.pi / 2.0)),
    ],
)
def test_a_listed_effect_by_another_name(effects, row):
    nominal, listed, unlisted = simulated(), simulated(effects), simulated(terms=row[None])
    apart = np.abs(listed["output_position"] - nominal["output_position"]).max()
    assert np.abs(listed["output_position"] - unlisted["output_position"]).max() < 0.1 * apart


def test_nothing_added_is_the_nominal_run_to_the_last_bit():
    one, other = simulated(), simulated(terms=term("torque", "order", amplitude=0.0, order=1.0, phase=0.0)[None])
    np.testing.assert_array_equal(one["phase_current"], other["phase_current"])


def test_a_filter_of_the_reference_delays_the_current():
    quick, slow = (np.abs(simulated(filter_time=t)["phase_current"][0, :10]).sum() for t in (0.0, 2e-3))
    assert slow < 0.8 * quick


ACTUATOR = reference_actuator()
TO_AND_FRO = command_positions("reversal", {"amplitude": 0.02, "speed": 0.25}, 0.3, ACTUATOR.control_period)
#: a torque or drag of each shape that is plain to see beside a friction of 0.05 N m
SEEN = {
    "order": {"amplitude": 0.02, "order": 2.4, "phase": 1.0},
    "frequency": {"amplitude": 0.02, "frequency": 40.0, "phase": 0.5},
    "step_change": {"jump": -0.02, "time": 0.12},
    "pulse": {"jump": -0.02, "time": 0.07, "until": 0.16},
    "power": {"at_100_rad_s": 0.02, "exponent": 1.5},
    "bump": {"depth": -0.03, "centre": 2.0, "width": 0.3},
    "memory": {"gain": 0.02, "time_constant": 0.05, "source": 1},
    "sweep": {"amplitude": 0.02, "frequency": 5.0, "rate": 100.0, "phase": 0.3},
    "burst": {"amplitude": 0.03, "time": 0.05, "decay": 0.1, "frequency": 30.0},
    "travel": {"amplitude": 0.02, "length": 3.0},
    "table": {"amplitude": 0.02},
    "function": function_of("rotor_speed", -150.0, 150.0, [0.02, -0.01, 0.0, 0.01, -0.02, 0.01]),
}
WANDER = np.random.default_rng(3).standard_normal(400)
#: of the other places, so that each acts; along what they change fastest
ELSEWHERE = {
    "emf_a": ("bump", {"depth": -0.2, "centre": 2.0, "width": 0.3}),
    "emf_b": ("order", {"amplitude": 0.1, "order": 1.0, "phase": 0.0}),
    "emf_c": ("function", function_of("output_angle", -0.03, 0.03, [0.3, 0.1, 0.1, -0.1, -0.1, -0.3])),
    "resistance_a": ("step_change", {"jump": 0.3, "time": 0.1}),
    "resistance_b": ("order", {"amplitude": 0.3, "order": 1.0, "phase": 1.0}),
    "resistance_c": ("memory", {"gain": 1.0, "time_constant": 0.1, "source": 0}),
    "drag": ("power", {"at_100_rad_s": 0.02, "exponent": 2.0}),
    "torque_constant": ("function", function_of("current", 0.0, 3.0, [0.1, 0.1, 0.0, -0.1, -0.1, -0.2])),
    "inertia": ("step_change", {"jump": 0.5, "time": 0.0}),
    "back_emf": ("function", function_of("current", 0.0, 3.0, [0.0, -0.1, -0.1, -0.2, -0.2, -0.3])),
    "torque_by_speed": ("order", {"amplitude": 0.02, "order": 1.0, "phase": 0.5}),
    "torque_by_speed_squared": ("order", {"amplitude": 0.01, "order": 2.0, "phase": 0.0}),
    "resistance": ("function", function_of("rotor_speed", -150.0, 150.0, [0.3, 0.1, 0.0, 0.0, 0.1, 0.3])),
}


def stretches(signals):
    """Means over fifteen stretches: what two chaotic switched loops must agree in."""
    i, v = signals["phase_current"][0], signals["phase_voltage"][0]

    def means(x):
        return x.reshape(15, -1).mean(1)

    return {
        "speed": means(signals["rotor_speed"][0]),
        "current": np.concatenate([means(np.abs(i[:, j])) for j in range(3)]),
        "voltage": np.concatenate([means(np.abs(v[:, j])) for j in range(3)]),
        "power": means((v * i).sum(1)),
    }


def apart(one, other, nominal):
    """Largest relative difference of two runs' stretches, by quantity, over the nominal run's root mean square."""
    return max(np.sqrt(np.mean((one[n] - other[n]) ** 2) / np.mean(nominal[n] ** 2)) for n in nominal)


@pytest.fixture(scope="module")
def nominal():
    runs = make_runs(ACTUATOR, np.zeros((1, 6)), theta_0=0.7)
    return stretches(simulate(runs, TO_AND_FRO, 0.3, 2e-4))


@pytest.mark.parametrize(
    ("place", "shape", "parameters"),
    [("drag" if shape in ("power", "memory") else "torque", shape, p) for shape, p in SEEN.items()]
    + [(place, *what) for place, what in ELSEWHERE.items()],
)
def test_both_simulations_agree(nominal, place, shape, parameters):
    """The event-driven run, which holds a term, with the fixed step: apart by far less than the term changes."""
    runs = make_runs(ACTUATOR, np.zeros((1, 6)), theta_0=0.7)
    rows = term(place, shape, **parameters)[None]
    ours = stretches(simulate(runs, TO_AND_FRO, 0.3, 2e-4, terms=rows, table=WANDER))
    theirs = stretches(simulate_fixed_step(runs, TO_AND_FRO, 0.3, 2e-4, 2e-6, terms=rows, table=WANDER))

    assert apart(ours, theirs, nominal) < 4e-3
    assert apart(ours, nominal, nominal) > 3.0 * apart(ours, theirs, nominal)


@pytest.mark.parametrize("form", [(), ("back_emf_shape",)], ids=["closed", "tabulated"])
def test_both_simulations_agree_on_a_back_emf_with_harmonics(nominal, form):
    runs = make_runs(ACTUATOR, np.zeros((1, 6)), theta_0=0.7)
    shaped = with_coefficients(runs, [{"place": "emf", "form": "harmonics", "h3": 0.3, "h11": -0.1}])
    assert not runs["emf_harmonics"].any()
    ours = stretches(simulate(shaped, TO_AND_FRO, 0.3, 2e-4))
    theirs = stretches(simulate_fixed_step(shaped, TO_AND_FRO, 0.3, 2e-4, 2e-6, forms=form))

    assert apart(ours, theirs, nominal) < (1e-2 if form else 4e-3) < 0.3 * apart(ours, nominal, nominal)


def test_both_simulations_agree_on_windings_that_differ(nominal):
    runs = make_runs(ACTUATOR, np.zeros((1, 6)), theta_0=0.7)
    shares = {"inductance_b": -0.3, "back_emf_b": 0.1, "back_emf_c": -0.1}
    unequal = with_coefficients(runs, [{"place": "winding", "form": "coefficient", **shares}])
    assert not runs["back_emf_share"].any()
    ours = stretches(simulate(unequal, TO_AND_FRO, 0.3, 2e-4))
    theirs = stretches(simulate_fixed_step(unequal, TO_AND_FRO, 0.3, 2e-4, 2e-6))

    assert apart(ours, theirs, nominal) < 4e-3 < 0.3 * apart(ours, nominal, nominal)


TOGETHER = np.array(
    [term("torque", "order", **SEEN["order"]), term("drag", "power", **SEEN["power"])]
    + [term(place, shape, **parameters) for place, (shape, parameters) in list(ELSEWHERE.items())[:5]]
)


@pytest.mark.parametrize(
    "effect", ["compliance", "self_heating", "bus_resistance", "inductance_saturation", "speed_latency", "cogging"]
)
def test_both_simulations_agree_beside_listed_effects(nominal, effect):
    """Those that take another way through the event-driven run, or have a state of their own."""
    values = {n: p.low + 0.8 * (p.high - p.low) for n, p in EFFECTS[effect].parameters.items()}
    runs = make_runs(ACTUATOR, np.array([[0.08, 0.03, 0.0, 0.12, -0.05, 40.0]]), effects={effect: values}, theta_0=0.7)
    plain, ours = (stretches(simulate(runs, TO_AND_FRO, 0.3, 2e-4, terms=t)) for t in (None, TOGETHER))
    theirs = stretches(simulate_fixed_step(runs, TO_AND_FRO, 0.3, 2e-4, 2e-6, terms=TOGETHER))

    assert apart(ours, theirs, nominal) < 4e-3 < 0.1 * apart(ours, plain, nominal)


def test_every_shape_and_place_is_compared():
    assert set(SEEN) == set(SHAPES)
    assert {*ELSEWHERE, "torque"} == set(PLACES)


def test_terms_of_a_run_are_its_own():
    runs = make_runs(ACTUATOR, np.zeros((10, 6)), theta_0=0.7)
    rows = np.array([term("torque", "order", amplitude=0.03 * (n == 7), order=1.0, phase=0.0)[None] for n in range(10)])
    plain = simulate(runs, TO_AND_FRO, 0.2, 2e-4)["rotor_speed"]
    alone = simulate(runs[:1], TO_AND_FRO, 0.2, 2e-4, terms=rows[7])["rotor_speed"][0]
    together = simulate(runs, TO_AND_FRO, 0.2, 2e-4, terms=rows)["rotor_speed"]
    np.testing.assert_allclose(together[7], alone, atol=0.02)
    assert np.abs(together[7] - plain[7]).max() > 0.5
    assert np.abs(together[3] - plain[3]).max() < 0.02


def test_too_many_terms():
    runs = make_runs(ACTUATOR, np.zeros((1, 6)))
    with pytest.raises(InputError, match="terms: got 9, accepted are 8"):
        simulate(runs, TO_AND_FRO, 0.2, 2e-4, terms=np.repeat(term("torque", "table", amplitude=1.0)[None], 9, axis=0))


def test_a_controller_sees_its_command_late_and_ahead_and_the_command_is_recorded_as_it_is():
    filtered = {"place": "command", "form": "command_filter", "time_constant": 0.005}
    ahead = {"place": "command", "form": "feedforward", "gain": 0.5}
    ramp = 0.2 * 1e-3 * np.arange(202)
    late = seen_by_controller(ramp, [filtered], 1e-3, 100.0)
    np.testing.assert_allclose((ramp - late)[100:], 0.2 * 0.005, rtol=1e-6)  # by the time constant
    np.testing.assert_allclose(seen_by_controller(ramp, [ahead], 1e-3, 100.0) - ramp, 0.5 / 100.0 * 0.2)
    assert seen_by_controller(ramp, [{"place": "torque", "form": "order"}], 1e-3, 100.0) is ramp
    actuator = reference_actuator()
    runs = make_runs(actuator, np.zeros((1, 6)))
    noise = {"voltage": 0.0, "current": 0.0, "current_end": 0.0, "speed": 0.0, "angle": 0.0, "position": 0.0}
    spec = {"seed": 0, "sensors": noise | {"bus_voltage": 0.0, "ambient": 0.0}}
    command = command_positions("ramp", {"speed": 0.2}, 0.2, actuator.control_period)
    plain = simulate_and_measure(spec, runs, command, 0.2, 2e-4)
    other = simulate_and_measure(spec | {"unlisted": [filtered]}, runs, command, 0.2, 2e-4)
    np.testing.assert_array_equal(other["commanded_position"], plain["commanded_position"])
    lag = (plain["output_position"] - other["output_position"])[0, -100:].mean()
    assert lag == pytest.approx(0.2 * 0.005, rel=0.05)

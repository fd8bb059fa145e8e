"""The event-driven simulation: check figures, exactness, and physics that can be worked out by hand."""

import os
import subprocess
import sys
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest

from emafault.actuator.commands import command_positions, jumps_of
from emafault.actuator.conduction import LANES, NEVER, passing
from emafault.actuator.lane import stays_off
from emafault.actuator.parameters import make_runs
from emafault.actuator.simulate import simulate, simulate_each, ways
from emafault.config import reference_actuator
from emafault.effects import EFFECTS

ACTUATOR = reference_actuator()
HEALTHY = np.zeros((1, 6))
FAULT = np.array([[0.08, 0.03, 0.0, 0.12, -0.05, 40.0]])


def command(name, duration, **settings):
    return command_positions(name, settings, duration, ACTUATOR.control_period)


def parabolic(duration):
    return command("parabolic", duration, acceleration=0.3)


def test_check_figures_of_the_reference():
    """Speed recorded at t; active current over the 20 ms before t (at 0.05 s it still rises, to 0.844 A at t)."""
    signals = simulate(make_runs(ACTUATOR, HEALTHY), parabolic(1.0), 1.0, 2e-4)
    speed = signals["rotor_speed"][0]
    active = np.abs(signals["phase_current"][0]).sum(1) / 2.0
    for t, low, high, i_low, i_high in [
        (0.05, 6.2, 6.5, 0.80, 0.84), (0.10, 13.2, 13.6, 0.855, 0.865), (0.20, 28.1, 28.5, 0.875, 0.895),
        (0.50, 73.1, 73.5, 0.935, 0.955), (1.00, 147.5, 148.5, 1.035, 1.055),
    ]:  # fmt: skip
        n = round(t / 2e-4)
        assert low <= speed[n - 1] <= high, t
        assert i_low <= active[n - 100 : n].mean() <= i_high, t


@pytest.mark.parametrize("fault", [HEALTHY, FAULT])
def test_effects_at_nominal_values_change_no_bit(fault):
    plain = simulate(make_runs(ACTUATOR, fault), parabolic(0.3), 0.3, 2e-4)
    named = make_runs(ACTUATOR, fault, effects={name: effect.off for name, effect in EFFECTS.items()})
    for name, values in simulate(named, parabolic(0.3), 0.3, 2e-4).items():
        assert np.array_equal(values, plain[name]), name


def test_threads_and_neighbours_change_no_bit():
    faults = np.concatenate([HEALTHY, FAULT, 0.5 * FAULT, -0.1 * FAULT + 0.05])
    runs = make_runs(ACTUATOR, faults)
    one = simulate(runs, parabolic(0.2), 0.2, 2e-4, threads=1)
    two = simulate(runs, parabolic(0.2), 0.2, 2e-4, threads=2)
    alone = simulate(runs[2:3], parabolic(0.2), 0.2, 2e-4)
    for name, values in one.items():
        assert np.array_equal(values, two[name]), name
        assert np.array_equal(values[2:3], alone[name]), name


def test_each_run_is_the_same_among_runs_of_other_lengths_commands_and_effects():
    effects = {name: {p: 0.5 * (q.low + q.high) for p, q in e.parameters.items()} for name, e in EFFECTS.items()}
    runs = np.concatenate([make_runs(ACTUATOR, FAULT, effects={name: e}) for name, e in effects.items()])
    assert len(runs) > 2 * LANES
    way = dict(zip(effects, ways(runs), strict=True))
    assert (way["compliance"], way["inductance_saturation"], way["cogging"]) == (2, 1, 0)
    duration = 0.05 + 0.002 * np.arange(len(runs))
    interval = np.array([5e-5, 1.3e-4, 2e-4, 1e-3])[np.arange(len(runs)) % 4]
    records = [int(d / i) for d, i in zip(duration, interval)]
    commands = [command("step", d, amplitude=0.02 * (-1) ** n, time=0.01) for n, d in enumerate(duration)]
    together = simulate_each(runs, commands, interval, records)
    for n in range(len(runs)):
        alone = simulate_each(runs[n : n + 1], commands[n : n + 1], interval[n : n + 1], records[n : n + 1])[0]
        assert np.abs(alone["rotor_speed"]).max() > 10.0
        for name, values in alone.items():
            assert np.array_equal(values, together[n][name]), (n, name)


UNCOMPILED = """
import sys, numpy as np
from emafault.actuator.commands import command_positions
from emafault.actuator.parameters import make_runs
from emafault.actuator.simulate import simulate
from emafault.config import reference_actuator
actuator = reference_actuator()
command = command_positions("step", {"amplitude": 0.02, "time": 0.0005}, 0.004, actuator.control_period)
runs = make_runs(actuator, np.zeros((2, 6)), effects={"compliance": {"K": np.array([0.0, 8000.0])}})
np.savez(sys.argv[1], **simulate(runs, command, 0.004, 2e-4))
"""


def test_it_also_runs_uncompiled(tmp_path):
    found = {}
    for flag in ("0", "1"):
        environment = os.environ | {"NUMBA_DISABLE_JIT": flag}
        path = tmp_path / f"{flag}.npz"
        subprocess.run([sys.executable, "-W", "ignore", "-c", UNCOMPILED, path], env=environment, check=True)
        found[flag] = np.load(path)
    assert np.abs(found["0"]["phase_current"]).max() > 1.0
    for name in found["0"]:
        assert np.allclose(found["0"][name], found["1"][name], rtol=1e-9, atol=1e-9), name


@pytest.mark.parametrize("fault", [HEALTHY, FAULT])
def test_energy_is_conserved(fault):
    """Work of the phase voltages = copper loss + magnetic energy + kinetic energy + friction loss."""
    runs, interval, duration = make_runs(ACTUATOR, fault), 1e-6, 0.15
    signals = simulate(runs, parabolic(duration), duration, interval)
    i, end, w = (signals[name][0] for name in ("phase_current", "phase_current_end", "rotor_speed"))
    electrical = interval * (signals["phase_voltage"][0] * i).sum()
    turns = 1.0 - fault[0, :3]
    R = ACTUATOR.resistance * turns * (1.0 + ACTUATOR.copper_coefficient * fault[0, 5])
    stored = 0.5 * (ACTUATOR.inductance * turns**2 * end[-1] ** 2).sum() + 0.5 * ACTUATOR.inertia * w[-1] ** 2
    friction = ACTUATOR.coulomb_friction * np.abs(w) + ACTUATOR.viscous_friction * w**2
    spent = interval * (R * i**2).sum() + stored + interval * friction.sum()
    assert electrical > 0.1
    assert spent == pytest.approx(electrical, rel=1e-3)


def test_friction_sticks_below_the_static_limit_and_gives_way_above():
    """The torque k (i_c - i_b) at the moment of break-away is T_c FSD."""
    held = simulate(make_runs(ACTUATOR, HEALTHY), command("step", 0.2, amplitude=1e-6, time=0.0), 0.2, 2e-4)
    assert np.abs(held["phase_current_end"]).max() > 0.1
    assert np.all(held["rotor_angle"] == 0.0)
    interval = 1e-6
    freed = simulate(make_runs(ACTUATOR, HEALTHY), command("step", 0.2, amplitude=1e-5, time=0.0), 0.2, interval)
    first = int(np.flatnonzero(freed["rotor_angle"][0])[0])
    end = freed["phase_current_end"][0]
    torque = ACTUATOR.back_emf * (end[:, 2] - end[:, 1])  # c and b are on their plateaus at zero, a crosses zero
    limit = ACTUATOR.static_over_coulomb * ACTUATOR.coulomb_friction
    assert torque[:first].max() <= limit * (1.0 + 1e-9)
    assert torque[first - 1 : first + 1].max() == pytest.approx(limit, rel=0.04)


def test_end_stop_holds():
    runs = make_runs(ACTUATOR, HEALTHY)
    runs["end_stop"] = 0.02
    signals = simulate(runs, command("ramp", 0.3, speed=0.3), 0.3, 2e-4)
    assert signals["output_position"].max() <= 0.02 * (1.0 + 1e-12)
    rest = slice(1000, None)
    np.testing.assert_allclose(signals["output_position"][0, rest], 0.02, rtol=1e-12)
    assert np.all(signals["rotor_speed"][0, rest] == 0.0)
    reach = signals["rotor_angle"][0, -1] / ACTUATOR.gear_ratio
    assert reach == pytest.approx(0.02 + 0.5 * ACTUATOR.backlash, rel=1e-6)


@pytest.mark.parametrize("play", [1e-4, 6e-4])
def test_play_is_as_wide_as_its_parameter(play):
    runs = make_runs(ACTUATOR, HEALTHY, effects={"backlash": {"blk": play}})
    signals = simulate(runs, command("reversal", 0.5, amplitude=0.01, speed=0.2), 0.5, 2e-4)
    lost = signals["rotor_angle"][0] / ACTUATOR.gear_ratio - signals["output_position"][0]
    assert np.ptp(lost) == pytest.approx(play, rel=1e-6)
    still = np.diff(signals["output_position"][0]) == 0.0
    inside = np.abs(lost[1:]) < 0.49 * play
    assert inside.any() and np.all(still[inside & (np.abs(lost[:-1]) < 0.49 * play)])


@pytest.mark.parametrize("fault", [HEALTHY, FAULT])
def test_locked_rotor_reaches_the_steady_current_of_two_phases(fault):
    runs = make_runs(ACTUATOR, fault)
    runs["coulomb_friction"], runs["current_limit"] = 1e3, 1e3
    duration = 0.05
    signals = simulate(runs, command("step", duration, amplitude=0.4, time=0.0), duration, 2e-4)
    turns = 1.0 - fault[0, :3]
    R = ACTUATOR.resistance * turns * (1.0 + ACTUATOR.copper_coefficient * fault[0, 5])
    current = signals["phase_current"][0, -1]
    on = np.abs(current) > 1.0
    assert on.sum() == 2
    steady = ACTUATOR.bus_voltage / (R[on].sum() + 2.0 * ACTUATOR.switch_resistance)
    np.testing.assert_allclose(np.abs(current[on]), steady, rtol=1e-6)
    np.testing.assert_allclose(signals["phase_voltage"][0, -1, on], (R * current)[on], rtol=1e-6)
    assert np.all(signals["rotor_angle"] == 0.0)


@pytest.mark.parametrize(
    "effects",
    [
        {},
        {"inductance_saturation": {"s": 0.02}},
        {"cogging": {"a": 0.01}},
        {"stribeck": {"a": 0.03, "w_s": 2.0}},
        {"load_spring": {"c": 100.0}, "speed_latency": {"tau": 5e-4}},
        {"dynamic_eccentricity": {"d": 0.03, "psi": 1.0}, "back_emf_shape": {"width": 115.0, "h5": 0.02, "h7": 0.01}},
    ],
)
def test_extras_that_are_nothing_change_nothing(effects):
    """A supply resistance of nothing but rounding is followed with every extra, and must not change the run."""
    for name, settings, duration in (
        ("parabolic", {"acceleration": 0.4}, 0.3),
        ("reversal", {"amplitude": 0.02, "speed": 0.3}, 0.3),
    ):
        on = {name: {k: np.array([v]) for k, v in values.items()} for name, values in effects.items()}
        fast = simulate(make_runs(ACTUATOR, FAULT, effects=on), command(name, duration, **settings), duration, 2e-4)
        general = make_runs(ACTUATOR, FAULT, effects=on | {"bus_resistance": {"R": np.array([1e-13])}})
        slow = simulate(general, command(name, duration, **settings), duration, 2e-4)
        for signal, values in fast.items():
            assert values == pytest.approx(slow[signal], rel=1e-6, abs=1e-6), (name, signal)


GENERAL = """
import sys

import numpy as np

from emafault.actuator import kernel
from emafault.actuator.commands import command_positions
from emafault.actuator.parameters import make_runs
from emafault.actuator.simulate import simulate
from emafault.config import reference_actuator

actuator, fault = reference_actuator(), np.array([[0.15, 0.0, 0.05, 0.0, 0.0, 30.0]])
light = {"inertia": {"scale": np.array([float(sys.argv[3])])}}
runs = make_runs(actuator, fault, effects=light)
handed = {True: 0, False: 0}
taken = kernel.hand_over

def hand_over(*given):
    done = taken(*given) if sys.argv[2] == "lanes" else False
    handed[bool(done)] += abs(given[1].w) > 250.0
    return done

kernel.hand_over = hand_over
command = command_positions("step", {"amplitude": 0.5, "time": 0.001}, 0.012, actuator.control_period)
signals = simulate(runs, command, 0.012, 2e-4)
np.savez(sys.argv[1], fast=[handed[True], handed[False]], **signals)
"""


@pytest.mark.parametrize(("inertia", "fast"), [(1.0, False), (0.05, True)])
def test_a_lane_is_the_general_run(tmp_path, inertia, fast):
    """Lanes and the general segment are two writings of one physics, at low speed and where a terminal nears a rail."""
    found = {}
    for way in ("lanes", "general"):
        path = tmp_path / f"{way}.npz"
        arguments = [sys.executable, "-W", "ignore", "-c", GENERAL, path, way, str(inertia)]
        subprocess.run(arguments, env=os.environ | {"NUMBA_DISABLE_JIT": "1"}, check=True)
        found[way] = dict(np.load(path))
    in_lanes, in_general = found["lanes"].pop("fast")
    assert not fast or (in_lanes > 10 and in_general > 10)
    for name, values in found["lanes"].items():
        assert values == pytest.approx(found["general"][name], rel=1e-6, abs=1e-6), name


def test_a_terminal_that_is_said_to_stay_off_never_reaches_a_rail():
    """Against the star point's voltage itself, over the angles, currents and directions that it is said of."""
    rng = np.random.default_rng(4)
    said = 0
    for _ in range(3000):
        k, L, R = (x * rng.uniform(0.6, 1.4, 3) for x in (0.0752, 8e-4, 1.1))
        s = SimpleNamespace(sagging=False, L=L, R=R, K=k * rng.uniform(-1.0, 1.0, 3), dK=k * rng.uniform(-8.0, 8.0, 3))
        s.inverse_L_pair = [1.0 / (L[(j + 1) % 3] + L[(j + 2) % 3]) for j in range(3)]
        p = SimpleNamespace(inductance_saturation_s=0.0, switch_resistance=0.1, bus_voltage_Vdc=48.0, diode_voltage=0.8)
        plus, minus, off = rng.permutation(3)
        w, gone, current = rng.uniform(0.0, 600.0), rng.uniform(-0.05, 0.05), rng.uniform(0.0, 20.0)
        if not stays_off.py_func(p, s, plus, minus, off, w, gone, current):
            continue
        said += 1
        for part, i, sign, high in product((0.0, 0.5, 1.0), (-current, current), (-w, w), (True, False)):
            K = s.K + part * gone * s.dK
            v_plus, v_minus = (48.0, 0.0) if high else (0.0, 48.0)
            across = (
                v_plus - K[plus] * sign - (R[plus] + 0.1) * i,
                v_minus - K[minus] * sign + (R[minus] + 0.1) * i,
            )
            star = (across[0] / L[plus] + across[1] / L[minus]) / (1.0 / L[plus] + 1.0 / L[minus])
            assert -0.8 <= star + K[off] * sign <= 48.8
    assert 300 < said < 2700


@pytest.mark.parametrize(
    ("name", "settings"), [("parabolic", {"acceleration": 0.3}), ("sine", {"amplitude": 0.01, "frequency": 2.0})]
)
def test_asymmetric_friction_and_a_constant_load_are_one_torque_break_away_included(name, settings):
    """T_c (1 + a sign w) sign w = T_c sign w + a T_c. The static limits differ, but the ripple makes the rotor creep as
    soon as the mean current holds the sliding friction, so that the limit hardly shows: by less than 5 mA of 0.06 A."""
    a = 0.15
    load = a * ACTUATOR.coulomb_friction * ACTUATOR.gear_ratio
    causes = ({}, {"friction_asymmetry": {"a": a}}, {"load_constant": {"T": load}})
    smooth = []
    for effects in causes:
        signals = simulate(make_runs(ACTUATOR, HEALTHY, effects=effects), command(name, 1.0, **settings), 1.0, 2e-4)
        active = 0.5 * np.abs(signals["phase_current"][0]).sum(1)
        smooth.append(np.convolve(active, np.full(50, 0.02), "valid"))  # over 10 ms
    nominal, asymmetric, loaded = smooth
    assert np.abs(asymmetric - nominal).max() > 0.1
    assert np.abs(asymmetric - loaded).max() < 0.005


@pytest.mark.parametrize("s", [0.05, 0.07])
def test_a_saturating_inductance_at_the_current_limit_comes_to_an_end(s):
    """At 20 A the inductance is a twentieth of its own: segments must shorten and the run must not stall."""
    step = command("step", 0.1, amplitude=0.05, time=0.01)
    runs = make_runs(ACTUATOR, HEALTHY, effects={"inductance_saturation": {"s": np.array([s])}})
    signals = simulate(runs, step, 0.1, 2e-4)
    plain = simulate(make_runs(ACTUATOR, HEALTHY), step, 0.1, 2e-4)
    assert np.max(np.abs(signals["phase_current"])) > 0.9 * ACTUATOR.current_limit
    for name, values in signals.items():
        assert np.all(np.isfinite(values)), name
    # the regulator sets the current whatever the inductance, so the motion is nearly the same
    assert signals["output_position"] == pytest.approx(plain["output_position"], abs=0.02 * 0.05)


@pytest.mark.parametrize("interval", [5e-5, 5.7e-5, 7e-5, 1e-4, 1.44e-4, 2e-4, 2.5e-4, 4.1e-4, 1e-3])
@pytest.mark.parametrize("moment", [0.0226639, 0.03, 0.07771])
def test_a_recorded_step_is_found_however_it_is_sampled(interval, moment):
    tick, duration = 1e-4, 0.3
    time = interval * np.arange(1, int(duration / interval) + 1)

    def recorded(name, **settings):
        true = command_positions(name, settings, duration, tick)
        return np.interp(time, tick * np.arange(len(true)), true)

    step = recorded("step", amplitude=-0.02, time=moment)
    ((last, first),) = jumps_of(step)
    assert step[last] == pytest.approx(0.0, abs=1e-9) and step[first] == pytest.approx(-0.02, abs=1e-9)
    assert time[last] - tick <= moment <= time[first] + tick
    for name, settings in (
        ("reversal", {"amplitude": 0.02, "speed": 0.31}),
        ("ramp", {"speed": -0.5}),
        ("sine", {"amplitude": 0.01, "frequency": 6.0}),
        ("chirp", {"amplitude": 0.01, "frequency_start": 1.0, "frequency_end": 12.0}),
        ("parabolic", {"acceleration": 0.7}),
    ):
        assert len(jumps_of(recorded(name, **settings))) == 0


def test_a_commutation_is_never_missed():
    """A light rotor: where a comparator's event comes just before an edge, rounding may put the rotor past it."""
    for start in np.arange(0.0, 2.0, 0.1):
        runs = make_runs(ACTUATOR, HEALTHY, theta_0=start, effects={"inertia": {"scale": 0.01}})
        signals = simulate(runs, command("ramp", 0.5, speed=0.4), 0.5, 5e-4)
        assert np.max(np.abs(signals["phase_voltage"])) < 49.0, start


def test_a_bound_is_passed_at_once_where_rounding_has_put_the_motion_past_it():
    assert passing(-1e-9, -1, -160.0, 0.0, 0.0, 1e-5) == 0.0
    assert passing(0.0, 1, 160.0, 0.0, 0.0, 1e-5) == 0.0
    assert passing(1e-9, 1, -160.0, 0.0, 0.0, 1e-5) == pytest.approx(1e-9 / 160.0)  # on its way back
    assert passing(-1e-4, 1, 160.0, 0.0, 0.0, 1e-5) == pytest.approx(1e-4 / 160.0)
    assert passing(-1e-2, 1, 160.0, 0.0, 0.0, 1e-5) == NEVER

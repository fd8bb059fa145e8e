"""Nearly without noise nothing is left at the simulated point along any coordinate: what noise hides in one recording
a bench of many would find."""

from dataclasses import asdict, replace

import numpy as np
import pytest

from emafault.actuator.commands import command_positions
from emafault.actuator.parameters import make_runs
from emafault.actuator.sensors import SensorNoise
from emafault.actuator.shape import trapezoid_at
from emafault.actuator.simulate import simulate
from emafault.closed_form import PHASE_AXIS
from emafault.diagnosis.described import Described, with_forms
from emafault.diagnosis.linear import assemble, compressed_columns, correct, disturbance
from emafault.diagnosis.whitening import whiten
from emafault.equations import electrical
from emafault.equations.point import Point, State

from .conftest import ACTUATOR, NOISE, machine_of, recorded
from .test_residuals import truth

QUIET = SensorNoise(**{channel: 0.05 * size for channel, size in asdict(NOISE).items()})
FLEXIBLE = {"compliance": {"K": 2e4, "C": 350.0}}
ROUNDED = {"speed_quantisation": {"step": 5.0}}
OFFSETS = {"current_offset": {"o_a": -0.03, "o_b": -0.02, "o_c": -0.05}}
SPRING = {"load_spring": {"c": 150.0}}
CASES = {
    "what a phase that is off shows is not regulated": ("control", "parabolic", 2e-4, OFFSETS),
    "torque, phases on in both directions": ("torque", "step", 1e-3, {}),
    "rounding is the recording's alone": ("control", "parabolic", 2e-4, ROUNDED),
    "rounding, the same for long": ("sensor_speed", "parabolic", 2e-4, ROUNDED),
    "a supply of another voltage": ("control", "step", 2e-4, {"bus_voltage": {"Vdc": 44.0}}),
    "fields take up power": ("bus", "step", 2e-4, {"bus_resistance": {"R": 0.5}}),
    "contact while the shaft moves": ("torque", "sine", 5e-5, FLEXIBLE),
    "flexible behind this unit's play": ("torque", "sine", 5e-5, FLEXIBLE | {"backlash": {"blk": 4e-4}}),
    "a load moves a flexible shaft": ("position", "reversal", 2e-4, FLEXIBLE | {"load_constant": {"T": 6.0}}),
    "a spring acts on the motor through it": ("torque", "sine", 1e-4, FLEXIBLE | SPRING),
    "a spring behind this unit's play": ("torque", "sine", 1e-4, SPRING | {"backlash": {"blk": 9e-4}}),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_nothing_is_left_along_any_coordinate(case):
    equation, command, interval, effects = CASES[case]
    leap = {"amplitude": 0.08, "time": 0.02} if command == "step" else None
    recording = recorded(command, effects=effects, interval=interval, noise=QUIET, settings=leap)
    machine = machine_of({"a.nc": recording})
    values = {n: v for n, v in truth(machine, recording, effects).items() if n in machine.parameters}
    block = next(b for b in machine.blocks(values, "a.nc") if b.equation == equation)
    rows = np.column_stack([block.residual, *block.coordinates["phi"]])
    left, *along = whiten(block.bands, block.usable, rows)[block.usable].T
    assert block.usable.sum() > 15
    assert max(abs(left @ f) / np.sqrt(f @ f) for f in along if f @ f > 0.0) < 4.0


def test_about_a_constant_speed_rounding_says_nothing_of_its_scale():
    """There the value next to it comes up on one side alone, as often as noise reaches it."""
    step = {"speed_quantisation": {"step": 1.3}}
    recordings = {
        f"{k}.nc": recorded("reversal", effects=step, interval=1e-4, seed=k, theta_0=float(k)) for k in range(4)
    }
    machine = machine_of(recordings)
    at, name, whites = {n: p.off for n, p in machine.parameters.items()}, "speed_scale.scale", []
    for recording in recordings:
        block, other = (
            next(b for b in machine.blocks(at, recording, drawn, {name}) if b.equation == "sensor_speed")
            for drawn in (False, True)
        )
        white = compressed_columns(block, [name], [block.columns[name], block.residual], None)
        correct(white, disturbance(block, other, [name], None))
        whites.append(white)
    normal = assemble(whites, [name], {})
    assert normal.H[0, 0] > 1e7
    assert abs(normal.g[0]) < 3.0 * np.sqrt(normal.H[0, 0])


def test_noise_about_a_standstill_does_not_drive_what_is_behind_a_play():
    leap = {"amplitude": 0.046, "time": 0.05}
    noisy, exact = (
        machine_of({"a.nc": recorded("step", interval=5e-5, settings=leap, noise=noise)}).recordings["a.nc"]
        for noise in (NOISE, SensorNoise(**dict.fromkeys(asdict(NOISE), 0.0)))
    )
    stands = np.abs(np.gradient(exact.angle, exact.interval)) < 1e-3
    within = slice(12000, 15500)  # long after the step
    assert stands[within].all()
    off = (noisy.quiet() - exact.turned)[within]
    assert np.std(off) < 0.1 * NOISE.angle < 0.2 * np.std((noisy.turned - exact.turned)[within])
    moves = np.abs(noisy.speed) > 20.0
    assert moves.sum() > 1000 and np.array_equal(noisy.quiet()[moves], noisy.turned[moves])


@pytest.mark.parametrize(("command", "interval", "seed"), [("sine", 1e-4, 17), ("parabolic", 5e-5, 18)])
def test_the_angle_s_noise_counts_once_where_an_edge_lies(command, interval, seed):
    """A share of an interval is a mean over that noise: taken out of the regressors as well, it left a matrix that the
    gradient does not follow, and a fit that went to and fro."""
    recording = recorded(command, seed=seed, interval=interval, theta_0=0.2 + 0.21 * seed)
    machine = machine_of({"a.nc": recording})
    at, edge = truth(machine, recording), "controller.passing_a_ahead_out@a.nc"

    def gram(early):
        block, other = (
            next(b for b in machine.blocks(at | {edge: early}, "a.nc", drawn, {edge}) if b.equation == "commutation")
            for drawn in (False, True)
        )
        white = compressed_columns(block, [edge], [block.columns[edge], block.residual], None)
        correct(white, disturbance(block, other, [edge], None))
        return white.gram

    before, here, after = (gram(early) for early in (-1e-6, 0.0, 1e-6))
    assert (after[0, 1] - before[0, 1]) / 2e-6 == pytest.approx(here[0, 0], rel=0.1)


def test_commutations_tell_a_displacement_where_the_currents_have_gains_and_offsets():
    """At a constant speed all of them meet the ripple at one place: that is no displacement of the sensors."""
    effects = {
        "current_gain": {"g_a": 1.006, "g_b": 0.998, "g_c": 1.0},
        "current_offset": {"o_a": 0.02, "o_b": 0.0, "o_c": 0.0},
        "hall_displacement": {"d_a": 0.3, "d_b": -0.3, "d_c": 0.0},
    }
    moves = [("parabolic", {"acceleration": 0.3}), ("ramp", {"speed": 0.12}), ("ramp", {"speed": -0.2})]
    recordings = {
        f"{k}.nc": recorded(command, effects, seed=k, theta_0=0.2 + 0.3 * k, settings=settings)
        for k, (command, settings) in enumerate(moves)
    }
    machine = machine_of(recordings)
    at = {n: p.off for n, p in machine.parameters.items()}
    for n, r in recordings.items():
        known = truth(machine_of({"a.nc": r}), r, effects)
        at |= {m.replace("a.nc", n): x for m, x in known.items()}
    told = {n: at[n] for n in ("hall_displacement.d_a", "hall_displacement.d_b")}
    names = [*told, *(n for n in machine.parameters if n.startswith(("controller.commutation", "controller.passing")))]
    prior = {n: machine.parameters[n] for n in names}
    values = at | {n: p.off for n, p in prior.items()}
    for _ in range(4):
        whites = []
        for r in recordings:
            blocks, others = (machine.blocks(values, r, drawn, names) for drawn in (False, True))
            for block, other in zip(blocks, others, strict=True):
                if block.equation == "commutation":
                    inside = [n for n in names if n in block.columns]
                    columns = [*(block.columns[n] for n in inside), block.residual]
                    whites.append(compressed_columns(block, inside, columns, None))
                    correct(whites[-1], disturbance(block, other, inside, None))
        normal = assemble(whites, names, {})
        precision = normal.H + np.diag([p.sd**-2.0 for p in prior.values()])
        step = np.linalg.solve(precision, [(p.mean - values[n]) / p.sd**2 for n, p in prior.items()] - normal.g)
        values |= {n: values[n] + d for n, d in zip(names, step, strict=True)}
    sd = dict(zip(names, np.sqrt(np.diag(np.linalg.inv(precision))), strict=True))
    for n, true in told.items():
        assert abs(true - prior[n].off) > 8.0 * sd[n], n
        assert values[n] == pytest.approx(true, abs=4.0 * sd[n]), n


def test_a_large_wave_of_the_recorded_angle_is_undone_in_every_equation():
    recording = recorded("sine", interval=1e-4)
    size = 80.0 * NOISE.angle
    wrong = replace(recording, rotor_angle=recording.rotor_angle + size * np.sin(recording.rotor_angle))
    form = Described("~o", "order", "sensor_angle", 0, (("order", 1.0, 0.0, "1"),), 1.0, 1.0, "position", "angle")
    machine = with_forms(machine_of({"a.nc": wrong}), [form])
    here = truth(machine, recording) | {"form.~o.sine": size}
    at, up, down = (
        {b.equation: b for b in machine.blocks(here | {"form.~o.sine": size + step}, "a.nc")}
        for step in (0, 2e-6, -2e-6)
    )
    off = {b.equation: b for b in machine.blocks(truth(machine, recording), "a.nc")}
    for equation in ("electrical_a", "torque", "position", "commutation"):
        block = at[equation]
        changes = (up[equation].residual - down[equation].residual) / 4e-6
        a, b, left, before = whiten(
            block.bands, block.usable,
            np.column_stack([block.columns["form.~o.sine"], changes, block.residual, off[equation].residual]),
        ).T  # fmt: skip
        assert left @ left < 0.7 * (before @ before), equation
        assert a @ b / np.sqrt((a @ a) * (b @ b)) > 0.95, equation


@pytest.mark.parametrize(("signal", "size"), [("current_a", 0.1), ("voltage", 0.5)])
def test_a_wrong_signal_of_a_faulty_unit_is_undone_in_every_equation(signal, size):
    """What equations make of a signal depends on the unit: phase a has 0.1 fewer turns, and the winding is warm."""
    fault = (0.1, 0.0, 0.0, 0.0, 0.0, 40.0)
    recording = recorded("parabolic", fault=fault, health="seeded", noise=QUIET)
    wrong = size * (1.0 - np.exp(-(recording.time - recording.time[0]) / 0.2))[:, None]
    unit = np.array([1.0, 0.0, 0.0]) if signal == "current_a" else np.ones(3)
    more = ("phase_current", "phase_current_end") if signal == "current_a" else ("phase_voltage",)
    seen = replace(recording, **{n: getattr(recording, n) + wrong * unit for n in more})
    shape = (("source", 2.0, 0.0, ""), ("time_constant", 0.2, 0.0, "s"))
    form = Described("~m", "memory", f"sensor_{signal[:7]}", 0, shape, 1.0, 1.0, "electrical_a", signal)
    machine = with_forms(machine_of({"a.nc": seen}), [form])
    at = truth(machine, recording, fault=fault) | {"form.~m.gain": size}
    shown = {"current_a": (*electrical.NAMES, "torque", "sensor_current"), "voltage": electrical.NAMES}[signal]
    blocks = {b.equation: b for b in machine.blocks(at, "a.nc", wanted={"form.~m.gain"})}
    for equation in shown:
        block = blocks[equation]
        column, left = whiten(
            block.bands, block.usable, np.column_stack([block.columns["form.~m.gain"], block.residual])
        ).T
        assert abs(column @ left) / np.sqrt(column @ column) < 4.0, equation


def test_runs_without_end_currents_have_no_period():
    """Ends at regular phases would alias the ripple into a wave at constant speed."""
    recording = replace(recorded("parabolic", interval=5e-5), phase_current_end=None)
    machine = machine_of({"a.nc": recording})
    state = State(machine.recordings["a.nc"], Point(truth(machine, recording), "a.nc", ()))
    runs = electrical._runs(state, 0)
    lengths = runs.lengths[~runs.crosses]
    _, often = np.unique(lengths, return_counts=True)
    assert often.max() < 0.25 * len(lengths)


@pytest.mark.parametrize(("command", "interval", "scale"), [("sine", 1e-4, 0.85), ("parabolic", 4e-4, 1.1)])
def test_commutations_tell_the_inductance_without_end_currents(command, interval, scale):
    """A phase that is off has no current: what it has once it is on is a change that the ripple does not hide."""
    effects = {"inductance_tolerance": {"L_scale": scale}}
    recording = replace(recorded(command, effects=effects, interval=interval), phase_current_end=None)
    machine = machine_of({"a.nc": recording})
    at = {n: v for n, v in truth(machine, recording, effects).items() if n in machine.parameters}
    L = "inductance_tolerance.L_scale"
    blocks = [b for b in machine.blocks(at | {L: 1.0}, "a.nc") if b.equation in electrical.NAMES]
    power, found = 0.0, 0.0
    for b in blocks:
        residual, column = whiten(b.bands, b.usable, np.column_stack([b.residual, b.columns[L]]))[b.usable].T
        power, found = power + column @ column, found - column @ residual
    assert power**-0.5 < machine.parameters[L].sd  # one recording tells more than the tolerance does
    assert found / power == pytest.approx(scale - 1.0, abs=4.0 * power**-0.5)


@pytest.mark.parametrize("tau", [1e-5, 1e-4, 2e-3])
def test_a_filter_of_the_speed_filters_the_noise_of_the_angle(tau):
    """Otherwise a short time constant would be told by how much noise it leaves, and not by what lags."""
    effects = {"speed_latency": {"tau": tau}}
    recording = recorded("sine", effects=effects, interval=5e-5)
    machine = machine_of({"a.nc": recording})
    values = {n: v for n, v in truth(machine, recording, effects).items() if n in machine.parameters}
    block = next(b for b in machine.blocks(values, "a.nc") if b.equation == "sensor_speed")
    left = whiten(block.bands, block.usable, np.array(block.residual)[:, None])[block.usable, 0]
    rows = len(left)
    assert np.mean(left**2) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / rows))
    assert all(abs(left[k:] @ left[:-k]) / rows < 4.0 / np.sqrt(rows) for k in (1, 2, 3))


@pytest.mark.parametrize("tau", [0.0, 6e-4])
def test_the_lag_of_an_angle_shows_in_the_speed_as_the_sensor_makes_it(tau):
    recording = recorded("sine", effects={"speed_latency": {"tau": tau}})
    machine = machine_of({"a.nc": recording})
    at = truth(machine, recording, {"speed_latency": {"tau": tau}})

    def of_speed(lag):
        blocks = machine.blocks(at | {"lag.angle_late": lag}, "a.nc", wanted={"lag.angle_late"})
        return next(b for b in blocks if b.equation == "sensor_speed")

    column, (low, high) = of_speed(0.05).columns["lag.angle_late"], (of_speed(x) for x in (0.04, 0.06))
    moved = (high.residual - low.residual) / 0.02
    inside = slice(20, -20)
    # the column is of a smoothed angle, whose noise is not that of the residual
    assert moved[inside] @ column[inside] / (column[inside] @ column[inside]) == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize(
    "values",
    [
        {"lag.speed_early": 0.4},
        {"speed_latency.tau": 3e-4, "lag.speed_early": 0.3},
        {"lag.speed_filtered": 2.0, "lag.speed_sensor_late": 0.7},
    ],
)
def test_what_makes_a_speed_early_or_late_makes_the_angle_s_noise_another(values):
    machine = machine_of({"a.nc": recorded("parabolic", interval=1e-4)})
    at = {n: p.off for n, p in machine.parameters.items()}
    at |= values
    one, other = (
        next(b for b in machine.blocks(at, "a.nc", disturbed, ()) if b.equation == "sensor_speed")
        for disturbed in (False, True)
    )
    noise = whiten(one.bands, one.usable, (other.residual - one.residual)[:, None])[one.usable]
    assert np.mean(noise**2) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / len(noise)))


@pytest.mark.parametrize("displaced", [0.0, 4.0])
def test_the_torque_is_that_of_currents_that_rise_and_fall_evenly(displaced):
    """Between what is recorded, too: against the products of shape and current in steps of two microseconds."""
    fine, interval, duration = 2e-6, 2e-4, 0.4
    effects = {"hall_displacement": {f"d_{j}": displaced for j in "abc"}}
    runs = make_runs(ACTUATOR, np.zeros((1, 6)), effects=effects)
    settings = {"amplitude": 0.2, "frequency": 2.0}
    position = command_positions("sine", settings, 0.8, ACTUATOR.control_period)
    each = simulate(runs, position, duration, fine)
    many = round(interval / fine)
    angle, current = each["rotor_angle"][0], each["phase_current"][0]
    true = 0.0
    for j in range(3):
        x = ACTUATOR.pole_pairs * (angle - 0.5 * fine * each["rotor_speed"][0]) - PHASE_AXIS[j]
        true = true + (trapezoid_at(x, np.pi / 6.0)[0] * current[:, j]).reshape(-1, many).mean(axis=1)
    machine = machine_of({"a.nc": recorded("sine", effects, settings=settings, theta_0=0.0)})
    values = {n: p.off for n, p in machine.parameters.items()} | {f"hall_displacement.d_{j}": displaced for j in "abc"}
    machine.prepare("a.nc", values)
    state = State(machine.recordings["a.nc"], Point(values, "a.nc", ()))
    found = sum(np.asarray(state.conducting[j].value * state.current[j].value)[: len(true)] for j in range(3))
    assert abs(found @ true / (true @ true) - 1.0) < 1e-3

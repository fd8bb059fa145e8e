"""The actuator's twin: statistics, exact derivatives, and a bench whose effect is named."""

from dataclasses import asdict, replace

import numpy as np
import pytest

from emafault.actuator.commands import command_positions, with_corners
from emafault.actuator.parameters import make_runs
from emafault.actuator.sensors import SensorNoise, measure
from emafault.actuator.simulate import simulate, time_axis
from emafault.config import compose, reference_actuator
from emafault.gap.inference import Problem
from emafault.gap.which import search
from emafault.recording import Recording
from emafault.twins.actuator import ActuatorTwin, rounding_of
from emafault.twins.actuator_layout import COMMUTATIONS, SIZE, SPECIFICATION
from emafault.twins.actuator_noise import channel_spread
from emafault.twins.actuator_statistics import Nominal, _shared, compute

ACTUATOR = reference_actuator()
NOISE = SensorNoise(**compose()["sensors"])
COMMANDS = (
    ("parabolic", {"acceleration": 0.4}, 20.0),
    ("sine", {"amplitude": 0.03, "frequency": 2.0}, 20.0),
    ("ramp", {"speed": -0.2}, 60.0),
)


def bench(effects, seed=0, noise=NOISE, fault=(0.02, 0.0, 0.03, 0.05, 0.0)):
    out = {}
    for n, (command, settings, ambient) in enumerate(COMMANDS):
        health = "healthy" if n == 0 else "unknown"
        vector = np.array([*(np.zeros(5) if n == 0 else fault), ambient - 20.0])
        runs = make_runs(ACTUATOR, vector[None], effects=effects, theta_0=0.4 + n)
        positions = command_positions(command, settings, 0.5, ACTUATOR.control_period)
        measured = measure(simulate(runs, positions, 0.5, 2e-4), runs, noise, seed + n)
        soak = float(measured.pop("ambient_temperature")[0])
        signals = {k: v[0] for k, v in measured.items()}
        out[f"{n}"] = Recording(
            time_axis(0.5, 2e-4), ambient_temperature=soak, attributes={"health": health}, **signals
        )
    return out


def test_statistics_are_as_many_as_specified_and_vanish_without_gap_or_noise():
    silent = SensorNoise(**dict.fromkeys(asdict(NOISE), 0.0))
    recording = bench({}, noise=silent)["0"]
    signals = {n: getattr(recording, n) for n in ("phase_voltage", "phase_current", "phase_current_end", "rotor_speed")}
    signals |= {
        n: getattr(recording, n) for n in ("rotor_angle", "output_position", "commanded_position", "bus_voltage")
    }
    found = compute(Nominal.of(ACTUATOR, recording, 0.4), signals)
    assert len(SPECIFICATION) == SIZE == len(found.values)
    plateau = [m for m, s in enumerate(SPECIFICATION) if s[0].startswith("plateau")]
    assert np.abs(found.values[plateau]).max() < 0.01  # V; the noise of one of them is about 0.05 V


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("way", [np.round, np.floor, np.trunc])
def test_how_a_speed_was_rounded_is_told(way, sign):
    time = 2e-4 * np.arange(2000)
    angle = sign * 60.0 * time**2 + 1e-4 * np.random.default_rng(3).standard_normal(2000)
    speed = 3.0 * way(sign * 120.0 * time / 3.0)
    found = rounding_of([(speed, angle, 2e-4)], 3.0)
    values = sign * np.array([0.3, 1.6, 2.7])
    np.testing.assert_array_equal(found(values), way(values))


@pytest.mark.parametrize("way", [np.round, np.floor, np.trunc])
def test_how_a_speed_was_rounded_is_told_by_all_recordings_together(way):
    """Motions at a steady speed, whose error is that of one place between two steps."""
    time = 2e-4 * np.arange(2000)
    speeds = []
    for number, share in enumerate((-20.35, 20.3, 31.65, -17.75, -26.1, 40.9)):
        angle = 3.0 * share * time + 1e-4 * np.random.default_rng(number).standard_normal(2000)
        speeds.append((np.full(2000, 3.0 * way(share)), angle, 2e-4))
    values = np.array([0.3, -1.6, 2.7])
    np.testing.assert_array_equal(rounding_of(speeds, 3.0)(values), way(values))


@pytest.mark.parametrize("inside", [-0.3, -0.11, -0.02, 0.0, 0.05, 0.19, 0.4])
def test_share_of_a_phase_in_the_interval_of_an_ideal_commutation(inside):
    span, x = 0.2, np.linspace(-0.2, 0.2, 200001)
    own = np.mean(x + inside > 0.0)  # of the interval in which this phase carries the current, beside another
    pair = 0.5 * ((own if inside >= 0.0 else 1.0 - own) + 1.0)
    assert _shared(inside, span) == pytest.approx(own / pair, abs=1e-4)


def test_where_commutations_fall_between_the_recording_instants_leaves_little_trace():
    silent = SensorNoise(**dict.fromkeys(asdict(NOISE), 0.0))
    commutation = [m for m, s in enumerate(SPECIFICATION) if s[0].split(" ")[-1] in COMMUTATIONS]
    assert len(commutation) == 12
    shares = []
    for turn in np.linspace(0.0, 3e-3, 6):  # rad, a part of what the rotor turns in an interval
        runs = make_runs(ACTUATOR, np.zeros((1, 6)), theta_0=0.4 + turn)
        positions = command_positions("parabolic", {"acceleration": 0.4}, 0.5, ACTUATOR.control_period)
        measured = measure(simulate(runs, positions, 0.5, 4e-4), runs, silent, 0)
        soak = float(measured.pop("ambient_temperature")[0])
        recording = Recording(
            time_axis(0.5, 4e-4), ambient_temperature=soak, attributes={}, **{k: v[0] for k, v in measured.items()}
        )
        found = compute(Nominal.of(ACTUATOR, recording, 0.4 + turn), signals_of(recording))
        shares.append((found.values / np.sqrt(found.norm))[commutation])
    assert np.std(shares, axis=0).max() < 0.0015  # 0.007 where the instants count


def signals_of(recording):
    names = ["phase_voltage", "phase_current", "phase_current_end", "rotor_speed", "rotor_angle"]
    return {n: getattr(recording, n) for n in (*names, "output_position", "commanded_position", "bus_voltage")}


def row(label, equation):
    return next(m for m, s in enumerate(SPECIFICATION) if s[0] == label and s[1] == equation)


def test_noise_of_the_current_leaves_no_bias_in_the_inductance():
    silent = SensorNoise(**dict.fromkeys(asdict(NOISE), 0.0))
    recording = bench({}, noise=silent)["1"]
    nominal, signals = Nominal.of(ACTUATOR, recording, 1.4), signals_of(recording)
    m = row("plateau L", "electrical_a")
    clean = compute(nominal, signals).values[m]
    rng = np.random.default_rng(0)
    noisy = []
    for _ in range(30):
        current = signals["phase_current_end"] + 0.1 * rng.standard_normal(signals["phase_current_end"].shape)
        noisy.append(compute(nominal, signals | {"phase_current_end": current}).values[m] - clean)
    # the noise's own square, which a plain regression on di/dt would hold, is many times the scatter
    assert abs(np.mean(noisy)) < 3.0 * np.std(noisy) / np.sqrt(len(noisy))


def test_noise_is_that_of_the_bench_where_a_step_alone_would_not_tell_it(monkeypatch):
    recordings = bench({}, fault=(0.0,) * 5)
    runs = make_runs(ACTUATOR, np.zeros((1, 6)), theta_0=1.0)
    positions = command_positions("step", {"amplitude": 0.02, "time": 0.03}, 0.5, ACTUATOR.control_period)
    measured = measure(simulate(runs, positions, 0.5, 2e-4), runs, NOISE, 9)
    soak = float(measured.pop("ambient_temperature")[0])
    signals = {k: v[0] for k, v in measured.items()}
    recordings["step"] = Recording(time_axis(0.5, 2e-4), ambient_temperature=soak, **signals)
    twin = ActuatorTwin(ACTUATOR, recordings, NOISE)
    hunting = twin._brought["step"].signals

    def spread(signals, nominal):
        # about a commutation a phase that should float carries current now and then
        return channel_spread(signals, nominal) | ({"current": 0.3, "voltage": 1.0} if signals is hunting else {})

    monkeypatch.setattr("emafault.twins.actuator.channel_spread", spread)
    values = np.array([p.off if p.effect else p.mean for p in twin.parameters])
    twin.settle(values, ["0", "1", "2"])
    twin.settle(values, ["step"])
    found = twin._brought["step"].noise
    for channel in ("voltage", "current", "current_end"):
        assert found[channel] == pytest.approx(getattr(NOISE, channel), rel=0.2), channel


def test_harmonics_of_the_ripple_are_not_used_without_the_current_at_an_instant():
    recordings = bench({})
    blind = {n: replace(r, phase_current_end=None) for n, r in recordings.items()}

    def labels(brought):
        return {c.label for c in ActuatorTwin(ACTUATOR, brought, NOISE).cells(list(brought))}

    lost = labels(recordings) - labels(blind)
    assert {"5th harmonic", "7th harmonic"} <= lost and "sector 0" not in lost


def test_another_inductance_leaves_no_trace_in_the_saturation():
    silent = SensorNoise(**dict.fromkeys(asdict(NOISE), 0.0))
    changes = {}
    for effect, values in (
        ("inductance_tolerance", {"L_scale": 1.1}),
        ("inductance_saturation", {"s": 0.03}),
    ):
        recording = bench({effect: values}, noise=silent, fault=(0.0,) * 5)["1"]
        found = compute(Nominal.of(ACTUATOR, recording, 1.4), signals_of(recording))
        changes[effect] = [abs(found.values[row(n, "electrical_a")]) for n in ("plateau L", "plateau i2 di")]
    assert changes["inductance_tolerance"][1] < 0.05 * changes["inductance_tolerance"][0]
    assert changes["inductance_saturation"][1] > 0.2 * changes["inductance_saturation"][0]


def test_derivatives_no_larger_than_the_scatter_are_none():
    class Scattering:
        parameters, hypotheses = [], []

        def cells(self, part):
            return []

        def observed(self, part):
            return np.zeros(0)

        def scatter(self, part):
            return np.array([1.0, 1.0, 0.0])

    problem = Problem(Scattering(), ["a"])
    assert problem.seen(np.array([1.0, 10.0, 1e-9])).tolist() == [0.0, 10.0, 1e-9]


def test_derived_derivatives_agree_with_differences():
    twin = ActuatorTwin(ACTUATOR, bench({}), NOISE, threads=1)
    problem = Problem(twin, twin.names)
    values = np.array([p.off if p.effect else p.mean for p in problem.parameters])
    prediction = problem.predict(values)[0]
    exact = problem.nuisance_jacobian(values, prediction, problem.nuisances)
    for name, step in (("unit_calibration.k_scale", 0.01), ("2.dT", 5.0)):
        m = problem.names[name]
        # a single difference scatters with the switching, the mean over steps either way does so less; the derived
        # one is made of steps in the faults as wide as their prior, and differs by their curvature
        differences = []
        for part in (-1.0, -0.75, -0.5, 0.5, 0.75, 1.0):
            moved = values.copy()
            moved[m] += part * step
            differences.append((problem.predict(moved)[0] - prediction) / (part * step))
        difference = np.mean(differences, axis=0)
        column = exact[:, problem.nuisances.index(m)]
        cosine = column @ difference / np.linalg.norm(column) / np.linalg.norm(difference)
        assert cosine > 0.96, (name, cosine)
        assert np.linalg.norm(column) == pytest.approx(np.linalg.norm(difference), rel=0.05)


@pytest.mark.parametrize("effect", ["current_gain", "voltage_gain", "contact_resistance"])
def test_all_phases_alike_are_another_unit(effect):
    """A change of the three together is one of nuisances, and no fit tells them apart by differences that scatter."""
    twin = ActuatorTwin(ACTUATOR, bench({}), NOISE, threads=1)
    problem = Problem(twin, twin.names)
    hypothesis = next(h for h in twin.hypotheses if h.effect == effect)
    own = problem.effect_parameters(hypothesis)
    values = np.array([p.off if p.effect else p.mean for p in problem.parameters])
    if effect == "contact_resistance":
        values[own] = 0.02  # of which there is no less than none
    twin.settle(values, twin.names)
    problem.set_covariance(values)
    prediction = problem.predict(values)[0]
    base = problem.nuisance_jacobian(values, prediction, problem.nuisances)
    noisy = problem._effect_columns(problem.point(values, prediction, base, problem.nuisances), own)
    exact = problem._together(values, base, noisy, [hypothesis])
    weights = twin.weights_together(effect, values[own])
    by_steps, known = problem.whiten(noisy @ weights), problem.whiten(exact @ weights)
    assert by_steps @ known / np.linalg.norm(by_steps) / np.linalg.norm(known) > 0.97
    assert np.linalg.norm(known) == pytest.approx(np.linalg.norm(by_steps), rel=0.05)
    apart = np.array([1.0, -1.0, 0.0])  # what tells the phases apart is as it was
    assert exact @ (apart / weights) == pytest.approx(noisy @ (apart / weights), rel=1e-6, abs=1e-9)
    free = [*problem.nuisances, *own]
    deviations = {}
    for name, columns in (("noisy", noisy), ("exact", exact)):
        covariance = problem.point(values, prediction, np.concatenate([base, columns], 1), free).covariance[-3:, -3:]
        deviations[name] = np.sqrt(weights @ covariance @ weights) / (weights @ weights)
    assert deviations["exact"] > 2.0 * deviations["noisy"]


@pytest.mark.parametrize(
    ("effects", "named"),
    [
        ({}, ()),
        ({"magnet_temperature": {"alpha_m": -6e-4}}, ("magnet_temperature",)),
        ({"voltage_gain": {"g_a": 1.008, "g_b": 0.995, "g_c": 1.0}}, ("voltage_gain",)),
        ({"speed_latency": {"tau": 2e-3}}, ("speed_latency",)),
    ],
)
def test_the_effect_of_a_bench_is_found_with_its_size(effects, named):
    twin = ActuatorTwin(ACTUATOR, bench(effects, seed=7), NOISE, threads=2)
    problem = Problem(twin, twin.names)
    found = search(problem, twin.hypotheses, 6.0)
    best = found.candidates[0].effects if found.candidates and found.candidates[0].gain > 6.0 else ()
    assert best == named
    if named:
        effect = named[0]
        name, value = next(iter(effects[effect].items()))
        m = problem.names[f"{effect}.{name}"]
        point = found.candidates[0].point
        deviation = np.sqrt(point.covariance[point.free.index(m), point.free.index(m)])
        assert abs(point.values[m] - value) < 4.0 * deviation + 0.02 * abs(value)


def test_threads_change_no_prediction(shop):
    """Without currents at an instant a prediction is a mean over runs with commands of their own, side by side."""
    plans = (("step", {"amplitude": 0.01, "time": 0.03}, 20.0, "unknown"), ("ramp", {"speed": 0.2}, 20.0, "unknown"))
    recordings = {n: replace(r, phase_current_end=None) for n, r in shop.make_bench(plans=plans, duration=0.2).items()}
    found = []
    for threads in (1, 2):
        twin = ActuatorTwin(ACTUATOR, recordings, NOISE, threads=threads)
        values = np.array([p.off if p.effect else p.mean for p in twin.parameters])
        points = np.repeat(values[None], 6, axis=0)
        points[:, twin.index["inertia.scale"]] = np.linspace(0.9, 1.1, 6)
        twin.settle(values, twin.names)
        commands = {name: twin._brought[name].command.copy() for name in twin.names}
        found.append([twin.predict(points * scale, twin.names) for scale in np.linspace(1.0, 1.01, 6)])
        assert all(np.array_equal(twin._brought[name].command, c) for name, c in commands.items())
    assert np.array_equal(*found)


@pytest.mark.parametrize("interval", [2e-4, 6.47e-4, 1e-3])
@pytest.mark.parametrize(
    ("name", "settings", "corners"),
    [
        ("reversal", {"amplitude": 0.0213, "speed": 0.31}, True),
        ("ramp", {"speed": 0.3}, False),
        ("sine", {"amplitude": 0.02, "frequency": 5.0}, False),
        ("parabolic", {"acceleration": 0.5}, False),
        ("step", {"amplitude": 0.02, "time": 0.0333}, False),
    ],
)
def test_corners_of_a_command_between_its_samples_are_put_in(name, settings, corners, interval):
    tick, duration = ACTUATOR.control_period, 0.6
    true = command_positions(name, settings, duration, tick)
    at_ticks = tick * np.arange(len(true))
    time = interval * np.arange(1, int(duration / interval) + 1)
    recorded = np.interp(time, at_ticks, true)
    knots, values = with_corners(time, recorded)
    if not corners:
        assert len(knots) == len(time)
        return
    inside = (at_ticks >= time[0]) & (at_ticks <= time[-1])
    missed = np.abs(np.interp(at_ticks, time, recorded) - true)[inside].max()
    left = np.abs(np.interp(at_ticks, knots, values) - true)[inside].max()
    assert left < 1e-3 * max(missed, 1e-6)


@pytest.mark.parametrize("instant", [0.0301, 0.0303])
def test_an_averaged_prediction_keeps_the_instant_of_a_step(shop, instant, monkeypatch):
    recording = shop.record("step", {"amplitude": 0.01, "time": instant}, 20.0, "healthy", interval=4e-4)
    twin = ActuatorTwin(ACTUATOR, {"step": recording}, NOISE)
    values = np.array([p.off if p.effect else p.mean for p in twin.parameters])
    heavy = values.copy()
    heavy[twin.index["inertia.scale"]] = 1.3
    for point in (heavy, heavy, heavy, values):  # the instant is found anew where a fit has moved
        twin.settle(point, ["step"])
    ticks, simulated = [], twin._simulate

    def counting(tasks):
        ticks.extend(int(np.argmax(task.command > 0.005)) for task in tasks)
        return simulated(tasks)

    monkeypatch.setattr(twin, "_simulate", counting)
    twin.smooth(values, ["step"])
    true = int(np.argmax(command_positions("step", {"amplitude": 0.01, "time": instant}, 0.5, 1e-4) > 0.005))
    assert ticks and max(abs(tick - true) for tick in ticks) <= 1

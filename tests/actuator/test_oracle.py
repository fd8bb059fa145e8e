"""Two simulators written apart must give the same statistics: nominal, faulted and with every effect."""

import numpy as np
import pytest

from emafault.actuator.fixed_step import quantise_by_truncation, simulate_fixed_step
from emafault.actuator.forms import FORMS
from emafault.actuator.parameters import ECCENTRICITY_LAWS, make_runs
from emafault.actuator.simulate import simulate
from emafault.config import reference_actuator
from emafault.effects import EFFECTS
from emafault.errors import InputError

FAULT = [0.08, 0.03, 0.0, 0.12, -0.05, 40.0]
TICKS = 1e-4 * np.arange(10002)
PARABOLIC = 0.15 * TICKS**2
REVERSAL = 0.02 * np.abs((TICKS / 0.1 + 1.0) % 4.0 - 2.0) * -1.0 + 0.02  # 0.2 rad/s to and fro, from rest
#: forms that change the actuator even where the effect is off
ALWAYS = {"back_emf_shape", "bus_voltage", "friction_level", "backlash", "inductance_tolerance", "stribeck"}


def middle(effect: str) -> dict[str, float]:
    """A value well inside the realistic range, different for every parameter."""
    parameters = EFFECTS[effect].parameters
    return {n: p.low + (0.8 - 0.1 * j) * (p.high - p.low) for j, (n, p) in enumerate(parameters.items())}


def statistics(signals: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Means over twelve stretches: what two chaotic switched loops must agree in."""

    def binned(x):
        return x[: len(x) // 12 * 12].reshape(12, -1).mean(1)

    i, v = signals["phase_current"][0], signals["phase_voltage"][0]
    end = signals["phase_current_end"][0]
    return {
        "speed": binned(signals["rotor_speed"][0]),
        "angle": binned(signals["rotor_angle"][0]),
        "position": binned(signals["output_position"][0]),
        "bus": binned(signals["bus_voltage"][0]),
        "current": np.stack([binned(np.abs(i[:, j])) for j in range(3)]),
        "voltage": np.stack([binned(np.abs(v[:, j])) for j in range(3)]),
        "power": binned((v * i).sum(1)),
        "ripple": np.sqrt(binned((end**2).sum(1))),
    }


#: relative, root mean square over the stretches
TOLERANCE = {
    "speed": 2e-4, "angle": 2e-4, "position": 2e-4, "bus": 1e-4,
    "current": 2e-3, "voltage": 3e-3, "power": 3e-3, "ripple": 1.5e-2,
}  # fmt: skip


def assert_equal_statistics(runs, command, duration=0.5, interval=2e-4):
    ours = statistics(simulate_fixed_step(runs, command, duration, interval))
    theirs = statistics(simulate(runs, command, duration, interval))
    for name, tolerance in TOLERANCE.items():
        scale = np.sqrt(np.mean(ours[name] ** 2))
        error = np.sqrt(np.mean((ours[name] - theirs[name]) ** 2))
        assert error < tolerance * scale, f"{name}: {error / scale:.2e}"


def test_check_figures_of_the_reference():
    signals = simulate_fixed_step(make_runs(reference_actuator(), np.zeros((1, 6))), PARABOLIC, 1.0, 2e-4)
    speed = signals["rotor_speed"][0]
    current = np.abs(signals["phase_current"][0]).sum(1) / 2.0
    for t, low, high, i_low, i_high in [
        (0.05, 6.2, 6.5, 0.80, 0.85), (0.10, 13.2, 13.6, 0.855, 0.87), (0.20, 28.1, 28.5, 0.88, 0.89),
        (0.50, 73.1, 73.5, 0.94, 0.95), (1.00, 147.5, 148.5, 1.04, 1.05),
    ]:  # fmt: skip
        n = round(t / 2e-4)
        assert low <= speed[n - 1] <= high
        assert i_low <= current[n - 50 : n].mean() <= i_high


def test_voltages_obey_the_phase_equation():
    """On the plateau v = R i + L di/dt + k w holds for interval means, to the means' own curvature."""
    runs = make_runs(reference_actuator(), np.zeros((1, 6)))
    s = {k: x[0] for k, x in simulate_fixed_step(runs, PARABOLIC, 1.0, 2e-4).items()}
    slope = np.diff(s["phase_current_end"], axis=0, prepend=0.0) / 2e-4
    x = (4 * s["rotor_angle"]) % (2 * np.pi)
    use = (x > np.deg2rad(40)) & (x < np.deg2rad(140)) & (np.arange(5000) > 500)
    design = np.stack([s["phase_current"][use, 0], slope[use, 0], s["rotor_speed"][use]], 1)
    R, L, k = np.linalg.lstsq(design, s["phase_voltage"][use, 0], rcond=None)[0]
    assert R == pytest.approx(1.065, rel=2e-4)
    assert L == pytest.approx(3.6e-4, rel=1e-3)
    assert k == pytest.approx(0.0376, rel=5e-5)


def test_a_finer_step_changes_nothing():
    runs = make_runs(reference_actuator(), np.array([FAULT]))
    coarse, fine = (statistics(simulate_fixed_step(runs, PARABOLIC, 0.3, 2e-4, step)) for step in (2e-6, 5e-7))
    for name in ("speed", "current", "voltage"):
        assert np.sqrt(np.mean((coarse[name] - fine[name]) ** 2)) < 3e-3 * np.sqrt(np.mean(fine[name] ** 2))


def test_events_at_the_steps_only_overshoot_less_the_finer_the_step():
    runs = make_runs(reference_actuator(), np.array([FAULT]))

    def band(**how):
        """Spread of the current at the recording instants about its mean of the interval: the ripple."""
        s = simulate_fixed_step(runs, PARABOLIC, 0.15, 2e-4, **how)
        return float(np.std(s["phase_current_end"] - s["phase_current"]))

    exact = band()
    coarse, fine = (band(step=step, sampled=True) - exact for step in (4e-6, 4e-7))
    assert coarse > 0.02 * exact and abs(fine) < 0.3 * coarse


@pytest.mark.parametrize("fault", [[0.0] * 6, FAULT])
@pytest.mark.parametrize("command", [PARABOLIC, REVERSAL])
def test_nominal(fault, command):
    assert_equal_statistics(make_runs(reference_actuator(), np.array([fault]), theta_0=0.7), command)


@pytest.mark.parametrize("law", ECCENTRICITY_LAWS[1:])
def test_eccentricity_laws(law):
    runs = make_runs(reference_actuator(), np.array([FAULT]), eccentricity_law=law, theta_0=2.0)
    assert_equal_statistics(runs, PARABOLIC)


@pytest.mark.parametrize("effect", EFFECTS)
def test_effects(effect):
    runs = make_runs(reference_actuator(), np.array([FAULT]), effects={effect: middle(effect)}, theta_0=0.7)
    assert_equal_statistics(runs, REVERSAL, 0.3)


@pytest.mark.parametrize("K, C", [(2e3, 400.0), (6e3, 300.0), (2e4, 220.0), (8085.0, 346.0)])
def test_compliance(K, C):
    """Contact is lost and made many times; neither side may lose the shaft."""
    runs = make_runs(reference_actuator(), np.array([FAULT]), effects={"compliance": {"K": K, "C": C}})
    for simulator in (simulate_fixed_step, simulate):
        signals = simulator(runs, REVERSAL, 0.5, 1e-3)
        assert np.max(np.abs(signals["output_position"] - signals["commanded_position"])) < 0.01


@pytest.mark.parametrize("form", FORMS)
def test_forms(form):
    """An alternative form is off where the effect is off, and differs from the library's where it is on."""
    runs = make_runs(reference_actuator(), np.array([FAULT]), theta_0=0.7)
    nominal = simulate_fixed_step(runs, REVERSAL, 0.2, 2e-4)
    if form not in ALWAYS:
        off = simulate_fixed_step(runs, REVERSAL, 0.2, 2e-4, forms=(form,))
        for name, values in nominal.items():
            np.testing.assert_allclose(off[name], values, rtol=1e-12, atol=1e-12)
    runs = make_runs(reference_actuator(), np.array([FAULT]), effects={form: middle(form)}, theta_0=0.7)
    plain = simulate_fixed_step(runs, REVERSAL, 0.2, 2e-4)
    other = simulate_fixed_step(runs, REVERSAL, 0.2, 2e-4, forms=(form,))
    assert all(np.all(np.isfinite(values)) for values in other.values())
    if form != "speed_quantisation":  # rounding belongs to the sensors
        assert any(not np.array_equal(other[name], plain[name]) for name in plain)


def test_truncation_lies_below():
    speed = np.array([-1.2, 0.3, 2.9])
    np.testing.assert_allclose(quantise_by_truncation(speed, 0.5), [-1.5, 0.0, 2.5])


def test_bad_input():
    runs = make_runs(reference_actuator(), np.zeros((1, 6)))
    with pytest.raises(InputError, match="forms: 'lugre'"):
        simulate_fixed_step(runs, PARABOLIC, 0.2, 2e-4, forms=("lugre",))
    with pytest.raises(InputError, match="shorter than"):
        simulate_fixed_step(runs, PARABOLIC[:100], 0.2, 2e-4)
    with pytest.raises(InputError, match="step"):
        simulate_fixed_step(runs, PARABOLIC, 0.2, 2e-4, step=0.0)

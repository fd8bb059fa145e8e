"""Terms that no catalogue lists: each is what it says, and one that is a listed effect by another name acts alike."""

import numpy as np
import pytest

from emafault.actuator.commands import command_positions
from emafault.actuator.fixed_step import simulate_fixed_step
from emafault.actuator.parameters import make_runs
from emafault.actuator.unlisted import SHAPES, acting, remembered, term
from emafault.config import reference_actuator

TABLE = np.array([0.0, 1.0, 3.0, 3.0])


def value(shape, t=0.0, theta=0.0, w=0.0, memory=0.0, **parameters):
    return acting(term("torque", shape, **parameters), t, theta, w, memory, TABLE)


@pytest.mark.parametrize(
    ("got", "wanted"),
    [
        (value("order", theta=2.0, amplitude=0.3, order=2.5, phase=1.0), 0.3 * np.cos(6.0)),
        (value("frequency", t=0.01, amplitude=0.3, frequency=50.0, phase=0.0), 0.3 * np.cos(np.pi)),
        (value("step_change", t=0.1, jump=0.3, time=0.2), 0.0),
        (value("step_change", t=0.3, jump=0.3, time=0.2), 0.3),
        (value("speed", w=-200.0, amplitude=0.1, exponent=2.0), 0.4),
        (value("bump", theta=6.0 + 8.0 * np.pi, depth=0.2, centre=6.0, width=0.1), 0.2),
        (value("bump", theta=6.1, depth=0.2, centre=0.1, width=0.1), 0.2 * np.exp(-0.5 * (2.831853) ** 2)),
        (value("memory", w=-5.0, memory=0.5, gain=0.2, time_constant=1.0), 0.1),
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
    drag = term("torque", "memory", gain=1.0, time_constant=0.1)
    assert remembered(drag, -100.0, 0.0, 0.1) == pytest.approx(1.0 - np.exp(-1.0))
    seal, memory = term("torque", "travel", amplitude=1.0, length=0.5), 0.0
    for _ in range(4000):
        memory = remembered(seal, 10.0, memory, 1e-4)
    assert memory == pytest.approx(1.0, abs=1e-2)
    assert remembered(seal, -10.0, memory, 1e-4) < memory
    assert set(SHAPES) == {"order", "frequency", "step_change", "speed", "bump", "memory", "sweep", "burst", "travel",
                           "table"}  # fmt: skip


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

"""Disturbances of blind cases: each changes what it says and nothing else, the same for the same seed."""

from dataclasses import replace

import numpy as np
import pytest

from emafault.config import reference_actuator
from emafault.errors import InputError
from emafault.withheld.benches import simulate_truth
from emafault.withheld.cases import draw_case, is_disturbed, plain_twin
from emafault.withheld.disturbances import (
    CONTROLLER,
    DISTURBANCES,
    FILTER,
    INSIDE,
    MEASURING,
    OUTSIDE,
    SMALLEST,
    USUAL_SMALLEST,
    Unlisted,
    change,
    draw_controller,
    draw_unlisted,
    with_controller,
)

CHANNELS = ("phase_voltage", "phase_current", "rotor_speed", "rotor_angle", "output_position", "bus_voltage")
WHERE = {"angle": "rotor_angle", "voltage": "phase_voltage", "current": "phase_current"}


def recorded():
    """Made-up signals of one recording."""
    rng, size = np.random.default_rng(1), 1000
    found = {name: rng.normal(0.0, 4.0, (size, 3) if name.startswith("phase") else size) for name in CHANNELS}
    return found | {"time": (np.arange(size) + 1) * 2e-4, "phase_current_end": rng.normal(0.0, 2.0, (size, 3))}


@pytest.mark.parametrize("name", MEASURING.kinds)
def test_only_the_channel_named_changes(name):
    one, other, again = recorded(), recorded(), recorded()
    for signals in (other, again):
        change([Unlisted(name, 0.8, 3)], 0, signals)
    changed = {c for c in CHANNELS if not np.array_equal(one[c], other[c])}
    assert changed == {WHERE[name.rsplit("_", 1)[1]]}
    for c in CHANNELS:
        np.testing.assert_array_equal(other[c], again[c])


@pytest.mark.parametrize("name", [n for n in DISTURBANCES if n not in MEASURING.kinds])
def test_what_acts_in_the_physics_is_all_that_differs_from_the_plain_bench(name):
    case = replace(draw_case("T8", 4), unlisted=(Unlisted(name, 1.0, 5),), fixed_step=True)
    case = replace(case, recordings=case.recordings[:1])
    with_it, without, again = (simulate_truth(c, reference_actuator()) for c in (case, plain_twin(case), case))
    apart = np.abs(with_it[0]["rotor_speed"] - without[0]["rotor_speed"]).max()
    assert 1e-3 < apart < 200.0 and np.all(np.isfinite(with_it[0]["phase_current"]))
    np.testing.assert_array_equal(with_it[0]["rotor_speed"], again[0]["rotor_speed"])


def test_a_third_is_outside_and_every_one_has_its_turn():
    drawn = [draw_unlisted(1, seed, np.random.default_rng(seed))[0] for seed in range(90)]
    assert sum(u.name in OUTSIDE for u in drawn) == 30
    assert {u.name for u in drawn} == set(INSIDE) | set(OUTSIDE)
    shares = [np.log(u.size) / np.log(SMALLEST.get(u.name, USUAL_SMALLEST)) for u in drawn]
    assert 0.0 < min(shares) < 0.1 and 0.9 < max(shares) < 1.0 and abs(np.mean(shares) - 0.5) < 0.1
    assert set(SMALLEST) < set(DISTURBANCES)


def test_what_the_key_tells_is_what_is_put_in():
    told = Unlisted("bearing_order", 0.5, 11).told(40.0)
    assert told["inside"] and told["form"] == "order" and told["equation"] == ["torque"]
    assert told["parameters"]["amplitude"] == {"value": 0.01, "units": "N m"}
    assert told["parameters"]["order"]["value"] % 1.0 > 0.1
    assert Unlisted("seal", 0.5, 11).told(40.0)["form"] is None


def test_another_controller_is_at_most_half_off_and_the_plain_twin_has_the_nominal_one():
    drawn = [draw_controller(seed, np.random.default_rng(seed)) for seed in range(80)]
    values = np.array([f for factors in drawn for name, f in factors.items() if name != FILTER])
    assert values.min() >= 0.5 and values.max() <= 1.5 and np.ptp(values) > 0.8
    assert {name for factors in drawn for name in factors} == {*CONTROLLER, FILTER}
    case = draw_case("T9", 3)
    assert is_disturbed(case) and not is_disturbed(plain_twin(case))
    assert plain_twin(case).effects == case.effects and plain_twin(case).noise_seed == case.noise_seed
    assert with_controller(reference_actuator(), plain_twin(case).controller) == reference_actuator()


def test_an_unknown_disturbance_is_refused():
    with pytest.raises(InputError, match="gremlin"):
        Unlisted("gremlin", 0.5, 0).kind()

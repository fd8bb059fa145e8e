"""The generator's sums against what they are by definition."""

import numpy as np
import pytest

from emafault.withheld.sums import ALPHA, ANGLE_BINS, CELLS, KINDS, PARTS, TIME_BINS, add_up, weights

POLES, HALF_SPEED = 4, 60.0


@pytest.fixture(scope="module")
def visits():
    """A motion there and back, at rest in between."""
    rng = np.random.default_rng(5)
    time = np.arange(3000) * 2e-4
    speed = 100.0 * np.sin(2.0 * np.pi * 2.0 * time) + rng.standard_normal(len(time))
    middle = np.cumsum(speed) * 2e-4
    some = (np.abs(speed) > 5.0).astype(float)
    return middle, speed, some, (time / time[-1] * (TIME_BINS - 1)).astype(int), POLES, HALF_SPEED


def test_what_is_added_up_is_what_the_weights_say(visits):
    features = np.random.default_rng(6).standard_normal((len(KINDS), len(visits[0])))
    sums, power = np.zeros(CELLS), np.zeros(CELLS)
    add_up(*visits, features, sums, power)
    rows = weights(*visits)
    for kind, feature in zip(KINDS, features, strict=True):
        np.testing.assert_allclose(sums[PARTS[kind]], rows[PARTS[kind]] @ feature, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(power, np.square(rows).sum(axis=1), rtol=1e-9)
    assert np.mean(power > 0.0) > 0.9


def test_weights_are_orders_and_cells_of_the_rotor_angle(visits):
    middle, speed, some, time_bin, *_ = visits
    rows = weights(*visits)
    waves = rows[PARTS["torque"]][TIME_BINS:]
    for n, order in enumerate((72, 144, 24, 1)):
        np.testing.assert_allclose(waves[2 * n], np.cos(order * middle) * some, atol=1e-9)
        np.testing.assert_allclose(waves[2 * n + 1], np.sin(order * middle) * some, atol=1e-9)
    in_time = (time_bin == np.arange(TIME_BINS)[:, None]) * some
    np.testing.assert_array_equal(rows[PARTS["torque"]][:TIME_BINS], in_time)
    np.testing.assert_array_equal(rows[PARTS["bus"]].sum(axis=0), np.ones(len(middle)))
    forward = speed > 0.0
    for j in range(3):
        x = (POLES * middle - ALPHA[j]) % (2.0 * np.pi)
        wanted = (x / (2.0 * np.pi) * ANGLE_BINS).astype(int) + ANGLE_BINS * forward
        wanted += 2 * ANGLE_BINS * (np.abs(speed) > HALF_SPEED)
        cells = rows[PARTS[f"voltage_{j}"]][: 4 * ANGLE_BINS]
        np.testing.assert_array_equal(cells, (wanted == np.arange(4 * ANGLE_BINS)[:, None]) * some)
        current = rows[PARTS[f"current_{j}"]].reshape(2, 9, -1)
        orders = [np.ones_like(x), *(g(n * x) for n in (1, 2, 5, 7) for g in (np.cos, np.sin))]
        np.testing.assert_allclose(current[0], np.array(orders) * some * forward, atol=1e-9)
        np.testing.assert_allclose(current[1], np.array(orders) * some * ~forward, atol=1e-9)

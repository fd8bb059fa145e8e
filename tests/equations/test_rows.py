"""Rows that a logger has dropped, or written twice, and what counts time by rows then."""

from dataclasses import replace

import numpy as np
import pytest

from emafault.io.rows import filled, of_rows, stalled, without_rows_twice

from .conftest import recorded


@pytest.mark.parametrize("count", [1, 5, 40])
def test_rows_that_are_missing_are_those_in_which_a_recorder_stood_still(count):
    plain = recorded("reversal")
    short = of_rows(plain, np.delete(np.arange(len(plain.time)), slice(1500, 1500 + count)))
    whole, missing = filled(short)
    assert missing == {1500: count}
    np.testing.assert_allclose(whole.time, plain.time, atol=1e-9)
    np.testing.assert_array_equal(whole.rotor_angle[1500 + count :], plain.rotor_angle[1500 + count :])
    assert np.flatnonzero(stalled(whole)).tolist() == list(range(1500, 1500 + count))


def test_nothing_is_missing_where_only_the_angle_or_the_command_jumps():
    plain = recorded("reversal")
    jump = 0.2 * (np.arange(len(plain.time)) >= 1500)
    for one in (
        plain,
        replace(plain, rotor_angle=plain.rotor_angle + jump),
        replace(plain, commanded_position=plain.commanded_position + 0.01 * jump),
    ):
        assert filled(one) == (one, {})


def test_rows_that_are_there_twice_are_left_out():
    plain = recorded("reversal")
    rows = np.repeat(np.arange(len(plain.time)), np.where(np.arange(len(plain.time)) % 500 == 250, 2, 1))
    once, twice = without_rows_twice(of_rows(plain, rows))
    assert twice == len(rows) - len(plain.time)
    np.testing.assert_allclose(once.time, plain.time, atol=1e-9)
    np.testing.assert_array_equal(once.phase_current, plain.phase_current)


def test_a_recorder_that_stands_still_has_no_row_twice():
    plain = recorded("reversal")
    rows = np.arange(len(plain.time))
    rows[1500:1510] = 1499
    still = of_rows(plain, rows)
    assert stalled(still)[1500:1510].all()
    assert without_rows_twice(still) == (still, 0)

"""What recordings show of their measuring chain by themselves."""

from dataclasses import replace

import numpy as np

from emafault.equations.quality import seen, told

from .conftest import recorded


def test_what_a_range_cuts_off_is_clipped_and_neither_held_nor_a_spike():
    plain = recorded()
    highest = np.sort(plain.phase_current[:, 0])
    for samples in (5, 300):
        current = plain.phase_current.copy()
        current[:, 0] = np.minimum(current[:, 0], highest[-samples])
        channel = seen(replace(plain, phase_current=current))["phase_current"]
        assert channel.clipped > 0.0 and channel.level == highest[-samples]
        assert channel.held == channel.spikes == 0.0
        assert [t["form"] for t in told({"a.nc": {"phase_current": channel}})] == ["clipping"]


def test_samples_that_repeat_within_the_range_are_held():
    plain = recorded()
    current = plain.phase_current.copy()
    rows = np.arange(500, 2500, 100)
    current[rows] = current[rows - 1]
    channel = seen(replace(plain, phase_current=current))["phase_current"]
    assert channel.held > 0.0 and channel.clipped == 0.0

"""One simulated motion, finely and at the recordings' interval."""

import pytest

from .measured import INTERVAL, averaged, simulated


@pytest.fixture(scope="session")
def fine():
    """At 50 kHz."""
    return simulated(0.1 * INTERVAL)


@pytest.fixture(scope="session")
def truth(fine):
    """What the recording must be, without noise."""
    return averaged(fine, 10)

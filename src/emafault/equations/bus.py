"""The bus voltage against the supply's and the current that the inverter draws, by its power."""

import numpy as np

from .dual import Dual
from .point import State, effect_name
from .terms import with_hook


def residual(state: State) -> Dual:
    """Recorded less predicted bus voltage (V)."""
    rec = state.rec
    out = Dual(0.0)
    for m in with_hook("supply"):
        out = out + m.supply(state.p.of(effect_name(m)))
    for m in with_hook("sag"):
        out = out - m.sag(state.p.of(effect_name(m)), rec, state.bus_current)
    assert rec.bus is not None
    return rec.bus - out


def noise_bands(state: State) -> list[np.ndarray]:
    """Diagonal of the noise's covariance (V2)."""
    return [np.full(state.rec.size, state.rec.noise.bus_voltage**2)]

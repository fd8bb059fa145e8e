"""The bus voltage against the supply's and the current that the inverter draws, by its power."""

import numpy as np
from scipy.ndimage import binary_dilation

from .dual import Dual, value_of
from .point import State, effect_name
from .signals import UNRESOLVED
from .terms import with_hook

MEMORY = 5e-3  # s, after which the supply's filter has forgotten a current


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
    """Diagonal of the noise's covariance (V2): the sensor's, and where within an interval the current changes."""
    rec = state.rec
    change = np.abs(np.diff(state.bus_current, prepend=0.0))
    change = np.maximum(change, np.append(change[1:], 0.0))
    unresolved = np.zeros(rec.size)
    for m in with_hook("sag"):
        unresolved = unresolved + value_of(m.sag(state.p.of(effect_name(m)), rec, UNRESOLVED * change))
    return [rec.noise.bus_voltage**2 + unresolved**2]


def usable(state: State) -> np.ndarray:
    """(sample,) where the currents tell the power, and have for as long as the supply remembers."""
    return state.rec.once(("bus", "usable"), lambda: _usable(state.rec))


def _usable(rec) -> np.ndarray:
    reach = max(1, round(MEMORY / rec.interval))
    out = ~binary_dilation(~rec.resolved, np.arange(-reach, reach + 1) >= 0)
    out[0] = False
    return out

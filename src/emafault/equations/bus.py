"""The bus voltage against the supply's and the current that the inverter draws, by its power; where it is not recorded,
that between two phases while the regulator never switches.
"""

import numpy as np
from scipy.ndimage import binary_dilation

from .acquisition import drifted, recorded_late
from .dual import Dual, value_of
from .point import State, effect_name
from .saturated import dropped, line_voltage, saturated
from .signals import UNRESOLVED, Signals
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
    if rec.bus is not None:
        out = recorded_late(state.p, "bus_voltage", out + np.zeros(rec.size), rec.size)
        out = out + drifted(state.p, "bus_voltage", "all", rec)
    return measured(state) - out


def measured(state: State) -> Dual:
    """(sample,) the bus voltage as recorded, or between two phases with what the switches take (V)."""
    rec = state.rec
    if rec.bus is not None:
        return Dual(rec.bus)
    found = saturated(rec.rows_from)
    assert found is not None
    return line_voltage(state, found) + dropped(rec, found)


def shows(rec: Signals) -> bool:
    """Whether a recording has any."""
    return rec.bus is not None or saturated(rec.rows_from) is not None


def noise_bands(state: State) -> list[np.ndarray]:
    """Diagonal of the noise's covariance (V2): the sensor's, and where within an interval the current changes."""
    rec = state.rec
    change = np.abs(np.diff(state.bus_current, prepend=0.0))
    change = np.maximum(change, np.append(change[1:], 0.0))
    unresolved = np.zeros(rec.size)
    for m in with_hook("sag"):
        unresolved = unresolved + value_of(m.sag(state.p.of(effect_name(m)), rec, UNRESOLVED * change))
    sensors = 2.0 * rec.noise.voltage**2 if rec.bus is None else rec.noise.bus_voltage**2
    return [sensors + unresolved**2]


def usable(state: State) -> np.ndarray:
    """(sample,) where the currents tell the power, and have for as long as the supply remembers."""
    rec = state.rec.rows_from
    out = rec.once(("bus", "usable"), lambda: _usable(rec))
    found = None if rec.bus is not None else saturated(rec)
    return out if found is None else out & found.rows


def _usable(rec: Signals) -> np.ndarray:
    reach = max(1, round(MEMORY / rec.interval))
    out = ~binary_dilation(~rec.resolved, np.arange(-reach, reach + 1) >= 0)
    out[0] = False
    return out

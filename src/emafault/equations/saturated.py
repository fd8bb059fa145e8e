"""Where no bus voltage is recorded: intervals in which the current regulator never switches, so that the voltage
between the two phases that conduct is the supply's.

No voltage is beyond the supply's, and a mean over an interval in which the regulator switches is anywhere below it.
Those over intervals in which it does not pile up at one value, within the sensors' noise, with none above, whatever
the pair needs at its speed and current. About a constant speed the largest swing of the ripple makes a pile as well.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import xlogy

from . import electrical
from .dual import Dual
from .point import State
from .signals import Signals
from .terms import bus_resistance

SPREAD = 3.0  # standard deviations of a line voltage, that a pile reaches to either side
CHANCE = 1e-6  # of as many there, were they spread as those below
VARIED = 2.0  # times the width of a pile, that what the pair needs in it must vary by
SAGS = 25  # resistances of the supply that are tried
WORST = 0.25  # of the supply's voltage, that the largest current takes at the last of them


@dataclass(frozen=True)
class Saturated:
    """Intervals at the supply's voltage (sample,) bool, and the direction of the pair, +1, 0 or -1 (sample, phase)."""

    rows: np.ndarray
    pair: np.ndarray


def saturated(rec: Signals) -> Saturated | None:
    """Of a recording; None where there are none."""
    return rec.once(("saturated",), lambda: _saturated(rec))


def _saturated(rec: Signals) -> Saturated | None:
    order = np.argsort(rec.current, axis=1)
    low, rest, high = order.T
    each = np.arange(rec.size)
    settled = np.abs(rec.current[each, rest]) < rec.actuator.hysteresis  # no current passes from phase to phase
    pair = np.zeros((rec.size, 3))
    pair[each, high], pair[each, low] = 1.0, -1.0
    line = (pair * rec.voltage).sum(axis=1)
    pair *= np.sign(line)[:, None]
    line = np.abs(line)
    candidates = settled & (rec.level > rec.actuator.hysteresis) & rec.resolved & ~rec.lost
    candidates[0] = False
    if not candidates.any():
        return None
    noise = np.sqrt(2.0) * rec.noise.voltage
    drawn = (rec.voltage * rec.current).sum(axis=1) / rec.actuator.bus_voltage
    sag = np.asarray(bus_resistance.sag(lambda _: Dual(1.0), rec, drawn).value)
    worst = WORST * rec.actuator.bus_voltage / rec.actuator.current_limit
    tried = (pile(line + R * sag, candidates, noise) for R in np.linspace(0.0, worst, SAGS))
    best = min(tried, key=lambda found: found[0])
    low, high = np.quantile(_needed(rec)[best[1]], [0.1, 0.9])
    if high - low < VARIED * 2.0 * SPREAD * noise:
        return None
    return Saturated(best[1], pair) if best[0] < np.log(CHANCE / SAGS) else None


def _needed(rec: Signals) -> np.ndarray:
    """(sample,) voltage of the pair's back-EMF and resistance (V)."""
    return 2.0 * (rec.actuator.back_emf * np.abs(rec.speed) + rec.actuator.resistance * rec.level)


def pile(line: np.ndarray, candidates: np.ndarray, noise: float) -> tuple[float, np.ndarray]:
    """Log probability of as many values at the top by chance, at most, and (sample,) which these are.

    Chernoff's bound of a Poisson count (Mitzenmacher and Upfal 2017, Probability and Computing, theorem 5.4), which
    does not vanish for a large pile.
    """
    width = 2.0 * SPREAD * noise
    top = float(line[candidates].max())
    middle = float(np.median(line[candidates & (line > top - width)]))
    pile = candidates & (np.abs(line - middle) < 0.5 * width)
    above = int((candidates & (line >= middle + 0.5 * width)).sum())
    below = int((candidates & (line <= middle - 0.5 * width) & (line > middle - 2.5 * width)).sum())
    # of the density below, estimated from twice the width; what lies above the supply belongs to no pile
    expected = 0.5 * (below + 1.0) + 2.0 * above
    excess = max(pile.sum() / expected, 1.0)
    return float(expected * (excess - 1.0 - xlogy(excess, excess))), pile


def line_voltage(state: State, found: Saturated) -> Dual:
    """(sample,) true voltage between the phases of the pair, from the recorded ones (V)."""
    rec = state.rec
    recorded = [Dual(rec.voltage[:, j]) for j in range(3)]
    shown = electrical.recorded(state, recorded)
    total = Dual(np.zeros(rec.size))
    for j in range(3):
        total = total + (2.0 * recorded[j] - shown[j]) * found.pair[:, j]
    return total


def dropped(rec: Signals, found: Saturated) -> np.ndarray:
    """(sample,) what the switches of both phases take of the supply's voltage (V)."""
    return rec.actuator.switch_resistance * (found.pair * rec.current).sum(axis=1)

"""Windows of a recording over which the voltage equation is compared, and the spans that its signals share."""

import numpy as np

from .electrical import Windows
from .loading import Raw
from .signal import Signal

WINDOW = 1e-3  # s, at most: long beside pulses, short beside a motion
PER_TURN = 8  # windows in an electrical turn, at least
FEWEST = 50  # windows
INSTANTS = ("rotor_angle", "output_position", "commanded_position", "phase_current_end")


def span(raw: Raw) -> tuple[float, float]:
    """From when to when (s) all signals are known; instants, of which the ends of intervals alone are taken, one step
    before their first as well."""
    begins = [s.begin - (s.step if s.name in INSTANTS else 0.0) for s in raw.signals()]
    return max(begins), min(s.end for s in raw.signals())


def electrical_turn(raw: Raw, pole_pairs: int) -> float:
    """Shortest electrical turn (s) of a motion, of speeds kept for a fiftieth of it."""
    angle = raw.single["rotor_angle"]
    t = np.linspace(angle.begin, angle.end, 51)
    fastest = np.max(np.abs(np.diff(angle.at(t)) / np.diff(t)))
    return float(2.0 * np.pi / max(pole_pairs * fastest, 1e-9))


def windows_of(
    raw: Raw,
    interval: float,
    pole_pairs: int,
    logger: str = "",
    skew: float = 0.0,
    drift: float = 0.0,
    longest: float = WINDOW,
) -> Windows | None:
    """Windows over what voltages, currents and the angle share; None where that is too short.

    Parameters
    ----------
    logger, skew, drift : the signals of one logger are taken ``skew`` (s) later, their times a part ``drift`` longer
    longest : length of a window (s), at most
    """

    def own(s: Signal, t):
        return (t - skew) / (1.0 + drift) if s.logger == logger else t

    def common(s: Signal, t: float) -> float:
        return t * (1.0 + drift) + skew if s.logger == logger else t

    electrical = [s for s in (*raw.phased["phase_voltage"], *raw.phased["phase_current"]) if s is not None]
    signals = [raw.single["rotor_angle"], *electrical]
    first = max(common(s, s.begin) for s in signals)
    last = min(common(s, s.end) for s in signals)
    length = max(interval, min(longest, electrical_turn(raw, pole_pairs) / PER_TURN))
    count = int((last - first) / length + 1e-6)
    if count < FEWEST:
        return None
    edges = first + length * np.arange(count + 1)
    current = third(raw, "phase_current", lambda s: s.means(own(s, edges)))
    at_edges = third(raw, "phase_current", lambda s: s.at(own(s, edges)))
    angle = raw.single["rotor_angle"]
    voltage = third(raw, "phase_voltage", lambda s: s.means(own(s, edges)))
    return Windows(edges, voltage, current, at_edges, angle.at(own(angle, edges)))


def third(raw: Raw, name: str, value) -> np.ndarray:
    """(sample, 3) of a phased signal; a channel that there is none of is less the sum of the others."""
    columns = [None if s is None else value(s) for s in raw.phased[name]]
    there = [c for c in columns if c is not None]
    return np.stack([-np.sum(there, axis=0) if c is None else c for c in columns], axis=1)

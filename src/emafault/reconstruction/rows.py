"""Which samples of a record carry one phase's voltage equation, chosen by rotor angle.

Over a recording interval the mean voltage equation is exact: V = R i + L (i_end - i_start)/interval + k f w, with
V, i, w the recorded means, as long as f is the trapezoid's mean over the *angle* of the interval. On the plateau f is
+1 or -1. In the off sector, once the free-wheel current is zero, the terminal floats and V = k f w, f being linear in
the angle.
"""

from dataclasses import dataclass, fields

import numpy as np

from ..closed_form import PHASE_AXIS
from ..compiled import compiled
from .features import Signals

OFF_HALF_WIDTH = np.pi / 6.0  # of the inverter's off sector, electrical rad


@dataclass(frozen=True)
class SampleChoice:
    """Rules by which samples are chosen (electrical angles in rad)."""

    pole_pairs: float
    plateau_width: float
    margin: float  # kept clear of every corner
    first: int  # samples dropped at the start
    floating: bool
    zero_current: float  # A, largest measured current that may count as zero
    clear_of_commutation: bool  # drop a sample if the pair in force changes in it or next to it


@dataclass(frozen=True)
class Rows:
    """Samples of one phase of one run; (row,) each."""

    index: np.ndarray  # sample of the record
    floating: np.ndarray  # bool: terminal floats, no current in the equation
    linked: np.ndarray  # bool: shares a measured end current with the row before
    V: np.ndarray  # V
    i: np.ndarray  # A, zero where floating
    didt: np.ndarray  # A/s, zero where floating
    w: np.ndarray  # rad/s
    f: np.ndarray  # mean of the trapezoid over the interval
    df: np.ndarray  # its slope by mechanical angle, 1/rad
    theta: np.ndarray  # mechanical angle at the middle of the interval, rad
    delta: np.ndarray  # half the angle turned in the interval, rad

    def conducting(self) -> "Rows":
        """Without the floating samples."""
        keep = ~self.floating
        return Rows(**{f.name: getattr(self, f.name)[keep] for f in fields(self)})


@compiled
def choose_samples(angle, axis, pole_pairs, plateau_half, off_half, ramp, first, floating):
    """Sample numbers, f, df/dtheta and kind of the intervals of one phase that lie wholly in one sector.

    Parameters
    ----------
    angle : (time,) mechanical angle at the interval's end (rad)
    axis : alpha_j (electrical rad)
    plateau_half, off_half : half widths of the two sectors less the margin (electrical rad)
    ramp : electrical angle over which f rises from 0 to 1
    """
    count = 0
    n_max = len(angle)
    index = np.empty(n_max, np.int64)
    f, df = np.empty(n_max), np.empty(n_max)
    is_floating = np.zeros(n_max, np.bool_)
    for n in range(max(first, 1), n_max):
        x0 = pole_pairs * angle[n - 1] - axis
        x1 = pole_pairs * angle[n] - axis
        centre = np.floor((x0 - 0.5 * np.pi) / np.pi + 0.5)  # plateaus are centred at pi/2 + centre*pi
        middle = 0.5 * np.pi + centre * np.pi
        if abs(x0 - middle) <= plateau_half and abs(x1 - middle) <= plateau_half:
            index[count], f[count], df[count] = n, (1.0 if centre % 2.0 == 0.0 else -1.0), 0.0
            is_floating[count] = False
            count += 1
        elif floating:
            centre = np.floor(x0 / np.pi + 0.5)
            middle = centre * np.pi
            if abs(x0 - middle) <= off_half and abs(x1 - middle) <= off_half:
                sign = 1.0 if centre % 2.0 == 0.0 else -1.0
                index[count], f[count] = n, sign * (0.5 * (x0 + x1) - middle) / ramp
                df[count] = sign * pole_pairs / ramp
                is_floating[count] = True
                count += 1
    return index[:count], f[:count], df[:count], is_floating[:count]


def is_zero(values: np.ndarray, limit: float) -> np.ndarray:
    """Which measured currents (A) are zero but for offset and noise, both judged from the values themselves.

    The median is the offset and the median deviation the noise, so that noise-free records are judged exactly.
    """
    if len(values) == 0:
        return np.zeros(0, bool)
    offset = np.median(values)
    away = np.abs(values - offset)
    return (away <= min(5.0 * 1.4826 * np.median(away) + 1e-9, limit)) & (abs(offset) <= limit)


def phase_rows(signals: Signals, end: np.ndarray, run: int, phase: int, choice: SampleChoice) -> Rows:
    """Samples of one phase; ``end`` (run, time, phase) is the current at the interval's end (A)."""
    ramp = 0.5 * (np.pi - choice.plateau_width)
    index, f, df, floating = choose_samples(
        signals.angle[run],
        PHASE_AXIS[phase],
        choice.pole_pairs,
        0.5 * choice.plateau_width - choice.margin,
        min(OFF_HALF_WIDTH, ramp) - choice.margin,
        max(ramp, 1e-9),
        choice.first,
        choice.floating,
    )
    if choice.clear_of_commutation:
        inside = np.flatnonzero((index >= 2) & (index < signals.speed.shape[1] - 1))
        sector = np.floor((choice.pole_pairs * signals.angle[run] - np.pi / 6.0) / (np.pi / 3.0))
        inside = inside[sector[index[inside] - 2] == sector[index[inside] + 1]]
        index, f, df, floating = index[inside], f[inside], df[inside], floating[inside]
    i, before, after = signals.current[run, index, phase], end[run, index - 1, phase], end[run, index, phase]
    if choice.floating:
        keep = ~floating
        zero = is_zero(i[floating], choice.zero_current)
        zero &= is_zero(before[floating], choice.zero_current) & is_zero(after[floating], choice.zero_current)
        keep[floating] = zero
        index, f, df, floating, i = index[keep], f[keep], df[keep], floating[keep], i[keep]
        before, after = before[keep], after[keep]
    linked = np.zeros(len(index), bool)
    linked[1:] = (np.diff(index) == 1) & ~floating[1:] & ~floating[:-1]
    theta0, theta1 = signals.angle[run, index - 1], signals.angle[run, index]
    return Rows(
        index=index,
        floating=floating,
        linked=linked,
        V=signals.voltage[run, index, phase],
        i=np.where(floating, 0.0, i),
        didt=np.where(floating, 0.0, (after - before) / signals.interval),
        w=signals.speed[run, index],
        f=f,
        df=df,
        theta=0.5 * (theta0 + theta1),
        delta=0.5 * (theta1 - theta0),
    )

"""What voltages were measured against: from duties to terminals, and from terminals or line voltages to the star point.

Where the star point was not measured, phase voltages lack a part common to the three; it is modelled from what the line
voltages themselves tell of each phase.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..actuator.motor import AXIS
from ..actuator.parameters import ActuatorParameters
from ..actuator.shape import trapezoid_swept
from ..errors import InputError
from .loading import Raw
from .signal import Signal

RAMP = np.pi / 6.0  # half of what the plateau leaves of half a turn, electrical rad
CARRIES = 5.0  # standard deviations of a current's noise, above which a switched-off leg still carries it


def star_part(reference: str) -> Callable[[np.ndarray], np.ndarray]:
    """(sample, 3) channels -> (sample, 3) phase voltages but for a part common to the three."""
    return _of_lines if reference == "line_to_line" else _as_they_are


def _as_they_are(x: np.ndarray) -> np.ndarray:
    return x


def _of_lines(x: np.ndarray) -> np.ndarray:
    return (x - np.roll(x, 1, axis=1)) / 3.0  # a-b less c-a is three times a less the mean


def terminals_from_duty(raw: Raw, actuator: ActuatorParameters) -> None:
    """Replace duties by terminal voltages against DC minus, in place: duty times bus voltage, less the switch's drop.

    A leg that is off (no number) is put halfway between the others; ``floating_legs`` says later where it was.

    Raises
    ------
    InputError : duties outside 0 to 1, or no bus voltage to multiply them by
    """
    if "bus_voltage" not in raw.single:
        raise InputError(f"{raw.name}: duties need the bus voltage; name its channel as signals.bus_voltage")
    duties = [s for s in raw.phased["phase_voltage"] if s is not None]
    if len(duties) < 3 or any(not np.array_equal(d.time, duties[0].time) for d in duties):
        raise InputError(f"{raw.name}: three duties sampled together are needed")
    duty = np.stack([d.values for d in duties], axis=1)
    if np.nanmin(duty) < -0.01 or np.nanmax(duty) > 1.01:
        raise InputError(
            f"{raw.name}: duties lie between {np.nanmin(duty):.3g} and {np.nanmax(duty):.3g}, not 0 and 1; say "
            "signals.phase_voltage.unit: percent, or scale"
        )
    bus = raw.single["bus_voltage"].at(duties[0].time)
    terminal = duty * bus[:, None]
    raw.off = np.isnan(duty)
    driven = (~raw.off).sum(axis=1)
    middle = np.where(driven > 0, np.nansum(terminal, axis=1) / np.maximum(driven, 1), 0.5 * bus)
    terminal = np.where(raw.off, middle[:, None], terminal)
    raw.phased["phase_voltage"] = [replace(d, values=v) for d, v in zip(duties, terminal.T)]
    raw.lost.append("voltages are commanded duties times the bus: what dead time and diodes change is not in them")
    if raw.off.any():
        raw.lost.append(
            "a leg that is off has no duty: its voltage is its diode's while it carries current, else modelled"
        )


def floating_legs(raw: Raw, channels: list, back_emf: np.ndarray, actuator: ActuatorParameters) -> list[Signal]:
    """Terminal voltages with those of legs that are off: a rail's while the current runs out, else the star point's and
    the back-EMF.

    Parameters
    ----------
    raw : currents and angle put right
    channels : three terminal voltages, of driven legs without their switch's drop
    back_emf : (3,) V s/rad
    """
    assert raw.off is not None
    time, step = channels[0].time, channels[0].step
    current = np.stack([_during(s, time, step) for s in phase_signals(raw, "phase_current")], axis=1)
    terminal = np.stack([s.values for s in channels], axis=1) - ~raw.off * actuator.switch_resistance * current
    bus = raw.single["bus_voltage"].at(time)
    angle = raw.single["rotor_angle"]
    emf = back_emf * swept(actuator.pole_pairs * angle.at(np.append(time[0] - step, time))) / actuator.pole_pairs / step
    small = CARRIES * float(np.median(np.abs(current[raw.off]))) / 0.6745 if raw.off.any() else 0.0
    for j in range(3):
        off = raw.off[:, j]
        others = [k for k in range(3) if k != j]
        floating = terminal[:, others].mean(axis=1) - emf[:, others].mean(axis=1) + emf[:, j]
        rail = np.where(current[:, j] > 0.0, -actuator.diode_voltage, bus + actuator.diode_voltage)
        value = np.where(np.abs(current[:, j]) > small, rail, floating)
        terminal[:, j] = np.where(off, value, terminal[:, j])
    return [replace(s, values=v) for s, v in zip(channels, terminal.T)]


def _during(signal: Signal, time: np.ndarray, step: float) -> np.ndarray:
    return signal.means(np.append(time[0] - step, time))


def phase_signals(raw: Raw, name: str) -> list[Signal]:
    """Three signals of a phased name; one that was not measured is less the sum of the others."""
    there = [s for s in raw.phased[name] if s is not None]
    if len(there) == 3:
        return there
    if len(there) < 2:
        raise InputError(f"{raw.name}: {name} has {len(there)} channels; two phases at least are needed")
    rest = replace(there[0], values=-there[0].values - there[1].at(there[0].time + _half(there[1])))
    return [rest if s is None else s for s in raw.phased[name]]


def lines_to_phases(raw: Raw) -> list[Signal]:
    """Phase voltages but for a common part from line voltages a-b, b-c, c-a sampled together."""
    three = phase_signals(raw, "phase_voltage")
    values = np.stack([three[0].values, *(s.at(three[0].time + _half(s)) for s in three[1:])], axis=1)
    return [replace(three[0], values=v) for v in _of_lines(values).T]


def _half(signal: Signal) -> float:
    return -0.5 * signal.step if signal.averaged else 0.0


def swept(x: np.ndarray) -> np.ndarray:
    """(edge,) electrical angle -> (interval, 3) integral of the trapezoid over the angle of each interval."""
    return np.stack([np.diff(trapezoid_swept(x - axis, RAMP)[0]) for axis in AXIS], axis=1)


def with_modelled_star(
    part: np.ndarray, current: np.ndarray, rate: np.ndarray, turned: np.ndarray
) -> tuple[np.ndarray, float, np.ndarray]:
    """Phase voltages against the star point, the misfit (V) of the line voltages that they are modelled from, and the
    (3,) k (V s/rad) that these have.

    Each phase's R, L and k are fitted to the differences between phases, in which the star point is not; what these
    leave open, the mean of the three, is then that of R_j i_j + L_j di_j/dt + k_j f_j w.

    Parameters
    ----------
    part : (interval, 3) phase voltages but for a common part (V)
    current : (interval, 3) means (A)
    rate : (interval, 3) of the current over the interval (A/s)
    turned : (interval, 3) f_j w, mean over the interval (rad/s)
    """
    terms = (current, rate, turned)
    lines = [(0, 1), (1, 2)]
    rows = []
    for one, other in lines:
        block = np.zeros((len(part), 9))
        for m, term in enumerate(terms):
            block[:, 3 * m + one], block[:, 3 * m + other] = term[:, one], -term[:, other]
        rows.append(block)
    difference = np.concatenate([part[:, one] - part[:, other] for one, other in lines])
    columns = np.concatenate(rows)
    scale = np.sqrt((columns**2).mean(axis=0)) + 1e-30
    solution = np.linalg.lstsq(columns / scale, difference, rcond=1e-8)[0] / scale
    misfit = float(np.sqrt(np.mean((difference - columns @ solution) ** 2)))
    modelled = sum(term @ solution[3 * m : 3 * m + 3] for m, term in enumerate(terms)) / 3.0
    return part - part.mean(axis=1, keepdims=True) + modelled[:, None], misfit, solution[6:]

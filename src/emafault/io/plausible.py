"""Units, signs, offsets and the angle's zero of one recording, by the physics of the actuator that it is said to be of.

In space vectors x = (2/3) sum_j x_j exp(i alpha_j), in which the star point drops out,

    v = R i + L di/dt - i K w exp(i p theta) (1 + i w tau)

with |K| = k times the trapezoid's fundamental. The argument of K is what the angle's zero is off by, tau what the
channels are late by, which grows with speed and is no mistake.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import log10

import numpy as np

from ..actuator.motor import AXIS
from ..actuator.parameters import ActuatorParameters
from ..errors import InputError
from .motion import MOVING
from .recording import PHASES, Recording
from .scales import CERTAIN, current_scales, largest

FUNDAMENTAL = 24.0 / np.pi**2 * np.sin(np.pi / 6.0)  # of the trapezoid with slopes of 60 degrees
KNOWN = 0.05  # relative standard error below which a coefficient can refuse a recording
#: over those of the actuator; beyond them it is another unit, or another actuator
OF_K, OF_R, OF_BUS = (0.6, 1.6), (0.25, 4.0), (0.5, 1.6)
ABSENT = 0.2  # of k, below which no back-EMF turns with the angle
LARGEST_ANGLE = np.deg2rad(12.0)  # electrical, of the angle's zero; the catalogue's effect has 5 degrees
LINE_TO_LINE = (np.deg2rad(20.0), 1.4)  # angle and size of K from which voltages look measured from line to line
UNBALANCED = 0.35  # of the currents' size, that their sum may be
OFFSET = 0.05  # of the supply, that a voltage may be off by at rest
FROZEN_TURNS, FROZEN = 4.0 * np.pi, 0.05  # electrical rad and s, through which a channel of a phase must change
FINE = 3.0  # steps of its resolution, by which samples of a channel differ that cannot stay the same by chance
LATE = 4  # column of the voltage equation
LATEST = 5.0  # intervals that the angle may be late by
MOST_POLE_PAIRS = 20  # that are tried where those told do not turn with the voltages
LOST = 2.0 * np.pi / 3.0  # electrical rad from sample to sample; from here on a sample cannot be told its sector
FEWEST = 200  # samples in motion
DECADE = 0.08  # of a decimal logarithm, by which a factor is taken for a power of ten
SAME_DESIGN = 0.3  # by which what a file carries of its actuator may differ; gear and pole pairs may not


# --- the actuator that it was recorded on ----------------------------------------------------------------------------


def refuse_other_actuator(path: str, recording: Recording, actuator: ActuatorParameters) -> None:
    """Refuse a recording that carries the numbers of another actuator than the one told.

    Raises
    ------
    InputError : naming the file and the first number that differs
    """
    carried = carried_actuator(recording)
    for name in ("pole_pairs", "gear_ratio", "bus_voltage", "resistance", "back_emf"):
        mine, told = carried.get(name), float(getattr(actuator, name))
        if not isinstance(mine, int | float) or not mine > 0.0:
            continue
        apart = abs(np.log(mine / told))
        if apart > (1e-6 if name in ("pole_pairs", "gear_ratio") else SAME_DESIGN):
            raise InputError(
                f"{path}: was recorded on another actuator, with {name} {mine:.4g} where {told:.4g} is given; name its "
                "own file by --actuator, or its numbers as actuator.KEY=VALUE"
            )


def carried_actuator(recording: Recording) -> Mapping[str, float]:
    """Parameters of the actuator that a file says it is of; none of a file that says nothing."""
    for attribute, key in (("actuator", ""), ("configuration", "actuator")):
        try:
            read = json.loads(recording.attributes.get(attribute, "{}"))
        except ValueError:
            continue
        found = read.get(key, {}) if key and isinstance(read, dict) else read
        if isinstance(found, dict) and found:
            return found
    return {}


# --- channels --------------------------------------------------------------------------------------------------------


def refuse_frozen(path: str, recording: Recording, actuator: ActuatorParameters) -> None:
    """Refuse a channel that stays the same while the rotor turns.

    A voltage or current of a phase changes within turns of the field; any other channel must where its samples
    otherwise differ by noise that is finer resolved than it is large, for most of the motion: what is held for less is
    left out of a diagnosis and told. A speed that stays at its extreme clips.

    Raises
    ------
    InputError : naming the channel and from when to when
    """
    turned = actuator.pole_pairs * np.abs(np.diff(recording.rotor_angle, prepend=recording.rotor_angle[:1])).cumsum()
    by_speed = actuator.pole_pairs * recording.interval * np.abs(recording.rotor_speed).cumsum()
    for variable in ("phase_voltage", "phase_current"):
        for j, values in enumerate(getattr(recording, variable).T):
            _refuse_constant(path, f"{variable} of phase {PHASES[j]}", values, turned, recording)
    for variable in ("rotor_speed", "rotor_angle", "output_position", "bus_voltage"):
        values = getattr(recording, variable)
        if values is None or not (_fine(values) or (variable == "rotor_angle" and np.ptp(values) == 0.0)):
            continue
        clips = (values.min(), values.max()) if variable == "rotor_speed" else ()
        way = by_speed if variable == "rotor_angle" else turned
        _refuse_constant(path, variable, values, way, recording, clips, least=0.5 * float(way[-1]))


def _fine(values: np.ndarray) -> bool:
    """Whether samples differ by several steps of their resolution, so that they do not stay the same by chance."""
    steps = np.abs(np.diff(values))
    steps = steps[steps > 0.0]
    return len(steps) >= FEWEST and float(np.median(steps)) > FINE * float(np.quantile(steps, 0.01))


def _refuse_constant(
    path: str,
    what: str,
    values: np.ndarray,
    turned: np.ndarray,
    recording: Recording,
    but: Sequence[float] = (),
    least: float = FROZEN_TURNS,
) -> None:
    """Refuse values (sample,) that stay the same, other than ``but``, through turns of the field, ``turned`` (rad), of
    at least so many."""
    ends = np.append(np.flatnonzero(np.diff(values) != 0.0), len(values) - 1)
    starts = np.append(0, ends[:-1] + 1)
    long = (turned[ends] - turned[starts] > max(least, FROZEN_TURNS)) & ((ends - starts) * recording.interval > FROZEN)
    long &= ~np.isin(values[starts], but)
    if long.any():
        k = int(np.argmax(long))
        raise InputError(
            f"{path}: {what} stays at {values[starts[k]]:.4g} from {recording.time[starts[k]]:.3g} to "
            f"{recording.time[ends[k]]:.3g} s while the rotor turns; the channel is frozen"
        )


def refuse_unbalanced(path: str, recording: Recording) -> None:
    """Refuse currents that do not add up to nothing, naming the phase whose sign, scale or offset does it.

    Raises
    ------
    InputError : the currents' sum is a third of their size, or one has a scale that no sensor has
    """
    i = recording.phase_current
    size = float(np.median(np.abs(i).sum(axis=1)))
    left = float(np.median(np.abs(i.sum(axis=1)))) / max(size, 1e-12)
    scales = current_scales(recording)
    j = int(np.argmax([abs(scale.off) for scale in scales]))
    scale = scales[j]
    mistaken = abs(scale.off) > largest("current_gain", f"g_{PHASES[j]}")
    if left <= UNBALANCED and not mistaken:
        return
    text = f"their offset is {i.sum(axis=1).mean():.3g} A in all"
    if mistaken:
        wrong = "the wrong sign" if scale.value < 0.0 else f"{scale.value:.3g} times its size"
        text = f"phase {PHASES[j]} has {wrong}"
    raise InputError(
        f"{path}: phase_current of a, b, c add up to {100.0 * left:.0f} % of their size, accepted is next to nothing; "
        f"{text}"
    )


def refuse_bus(path: str, recording: Recording, actuator: ActuatorParameters) -> None:
    """Refuse a bus voltage that is not that of the actuator's supply.

    Raises
    ------
    InputError : naming both
    """
    if recording.bus_voltage is None:
        return
    bus = float(np.median(recording.bus_voltage))
    ratio = bus / actuator.bus_voltage
    if not OF_BUS[0] < ratio < OF_BUS[1]:
        raise InputError(
            f"{path}: bus_voltage is {bus:.4g} V, the actuator's supply has {actuator.bus_voltage:.4g} V; "
            f"{_mistaken(ratio, 'its unit')}"
        )


# --- the voltage equation --------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Fitted:
    """R (ohm), K (V s/rad, complex), the offsets of the voltages (phase,) and their standard errors; ``on_time`` is the
    argument of K (rad) were the angle on time."""

    R: float
    R_error: float
    K: complex
    K_error: float
    on_time: float
    offset: np.ndarray
    offset_error: float


def refuse_implausible(path: str, recording: Recording, actuator: ActuatorParameters) -> None:
    """Refuse voltages and currents whose R, k, zero of the angle or offsets no unit of this actuator has.

    Raises
    ------
    InputError : naming the channel, the factor or angle, and what it looks like
    """
    found = _fit(recording, actuator)
    if found is None:
        return
    nominal = FUNDAMENTAL * actuator.back_emf
    of_k, of_R = abs(found.K) / nominal, found.R / actuator.resistance
    k_known, R_known = found.K_error < KNOWN * max(abs(found.K), nominal), found.R_error < KNOWN * abs(found.R)
    if k_known and of_k < ABSENT:
        _refuse_pole_pairs(path, recording, actuator)
    angle = float(np.angle(found.K))
    certain = abs(angle) > CERTAIN * found.K_error / max(abs(found.K), 1e-30)
    if k_known and certain and abs(angle) > LINE_TO_LINE[0] and of_k > LINE_TO_LINE[1]:
        raise InputError(
            f"{path}: phase_voltage is {of_k:.2f} times a phase's back-EMF, {np.rad2deg(angle):.0f} degrees off, as if "
            "measured from line to line; accepted is against the star point, as emafault import makes it"
        )
    if k_known and not OF_K[0] < of_k < OF_K[1]:
        raise InputError(
            f"{path}: phase_voltage is {of_k:.3g} times the back-EMF that this actuator has at this speed; "
            f"{_mistaken(of_k, 'its unit')}"
        )
    # a zero and a delay that make up for each other at the speeds of the recording are neither
    if k_known and certain and min(abs(angle), np.sign(angle) * found.on_time) > LARGEST_ANGLE:
        where, size = "ahead of" if angle < 0.0 else "behind", np.rad2deg(abs(angle))
        raise InputError(
            f"{path}: rotor_angle is {size:.0f} electrical degrees {where} the back-EMFs; its zero is mistaken"
        )
    if k_known and R_known and not OF_R[0] < of_R < OF_R[1]:
        raise InputError(
            f"{path}: phase_current is {1.0 / of_R:.3g} times what drives this voltage through the winding; "
            f"{_mistaken(1.0 / of_R, 'its unit')}"
        )
    j = int(np.argmax(np.abs(found.offset)))
    off = float(found.offset[j])
    if abs(off) > max(OFFSET * actuator.bus_voltage, CERTAIN * found.offset_error):
        raise InputError(f"{path}: phase_voltage of phase {PHASES[j]} has an offset of {1.5 * off:.3g} V")


def _refuse_pole_pairs(path: str, recording: Recording, actuator: ActuatorParameters) -> None:
    """Refuse another number of pole pairs than the one with which the back-EMFs turn."""
    for pole_pairs in range(1, MOST_POLE_PAIRS + 1):
        found = _fit(recording, replace(actuator, pole_pairs=pole_pairs))
        if found is not None and OF_K[0] < abs(found.K) / (FUNDAMENTAL * actuator.back_emf) < OF_K[1]:
            told = actuator.pole_pairs
            raise InputError(
                f"{path}: the back-EMFs turn {pole_pairs} times with the rotor, given are {told} pole_pairs"
            )


def _fit(r: Recording, a: ActuatorParameters) -> _Fitted | None:
    """The voltage equation fitted to the samples in motion; None where they are too few.

    The angle may be late by a few intervals; at a constant speed nothing tells that from its zero.
    """
    theta, dt = r.rotor_angle, r.interval
    middle = 0.5 * (theta[1:] + theta[:-1])
    w = np.diff(theta) / dt
    half = max(1, round(3e-4 / dt))
    calm = np.convolve(w, np.ones(2 * half + 1) / (2 * half + 1), "same")
    moving = (np.abs(calm) > MOVING) & (a.pole_pairs * np.abs(calm) * dt < LOST)
    if moving.sum() < FEWEST:
        return None
    ends = r.phase_current_end
    rise = np.diff(ends if ends is not None else np.vstack([r.phase_current, r.phase_current[-1:]])[1:], axis=0)
    emf = -1j * calm * np.exp(1j * a.pole_pairs * middle)
    columns = [_vector(r.phase_current[1:]), _vector(rise) / dt, emf, 1j * emf, 1j * calm * emf]
    rhs = _vector(r.phase_voltage[1:])
    # constants: the offsets of three voltages but for a common one
    columns += [np.ones(len(rhs), complex), 1j * np.ones(len(rhs))]
    A = np.stack([np.concatenate([c.real[moving], c.imag[moving]]) for c in columns], axis=1)
    b = np.concatenate([rhs.real[moving], rhs.imag[moving]])
    x, error = _least_squares(A, b)
    A[:, LATE] = 0.0
    on_time = _least_squares(A, b)
    if abs(x[LATE]) > LATEST * a.pole_pairs * dt * abs(complex(x[2], x[3])):
        x, error = on_time
    offset = np.real((x[5] + 1j * x[6]) * np.exp(-1j * AXIS))
    angle = float(np.arctan2(on_time[0][3], on_time[0][2]))
    return _Fitted(x[0], error[0], complex(x[2], x[3]), max(error[2:4]), angle, offset, max(error[5:7]))


def _least_squares(A: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients of the columns and their standard errors; of a column of zeros both are zero."""
    scale = np.sqrt((A**2).mean(axis=0))
    scale[scale == 0.0] = 1.0
    solution, *_ = np.linalg.lstsq(A / scale, b, rcond=1e-9)
    left = float(np.mean((b - A @ (solution / scale)) ** 2))
    spread = np.diag(np.linalg.pinv((A / scale).T @ (A / scale)))
    error = np.sqrt(left * np.maximum(spread, 0.0)) / scale
    return solution / scale, error


def _vector(phases: np.ndarray) -> np.ndarray:
    return phases @ np.exp(1j * AXIS) * (2.0 / 3.0)


def _mistaken(ratio: float, what: str) -> str:
    """What a factor comes of: a power of ten of a unit or probe, anything else of another actuator as well."""
    decade = round(log10(ratio)) if ratio > 0.0 else 0
    if decade and abs(log10(ratio) - decade) < DECADE:
        return f"{what} or its probe is mistaken by a factor of {10.0**decade:g}"
    return f"{what} is mistaken, or the recording is of another actuator (--actuator)"

"""Signals that contradict each other or their sensors: what refuses a recording, and what makes one useless."""

from collections.abc import Callable
from dataclasses import replace
from itertools import permutations

import numpy as np

from ..actuator.motor import AXIS
from ..actuator.parameters import ActuatorParameters
from ..errors import InputError
from .command import refuse_unfollowed
from .lattice import lattice_step
from .motion import MOTION, MOVING, SPIKE, calm_motion
from .plausible import refuse_bus, refuse_frozen, refuse_implausible, refuse_other_actuator, refuse_unbalanced
from .recording import PHASES, Recording
from .scales import largest, speed_scale
from .updates import repeated

SLOWEST_INTERVAL = 1e-3  # s
LEAST_TRAVEL = 0.1  # rad of the rotor; less is standing still
AT_REST = 5.0  # rad/s above what full current reaches from rest
START_POSITION = 3e-3  # rad at the user shaft, from zero
CLIPPED_SHARE = 0.01  # of the samples in motion at one and the same extreme value
CLIPPED_LEAST = 20
CLIPPED_FINE = 4  # samples at one extreme, of a channel whose values otherwise never repeat
CLIPPED_SPEED = 8  # samples of the speed, which lies on a lattice, at an extreme that the angle goes beyond
CLIPPED_MOST = 0.5  # of the samples in motion, that may be lost
FEWEST_SPIKES = 3  # in a recording
LOST = 2 * np.pi / 3  # electrical rad from sample to sample; from here on a sample cannot be told its sector
DRIFT = 3.0  # rad/s, below which a constant speed beside the rate of the angle is no mistake: coarse truncation has it
BENT = 0.5  # rad of the angle beside a constant speed, from which a drift is told from a mistake
WRAPPED = 0.1  # of a turn, that a wrapped angle moves by from sample to sample at most
OF_SPEED, OF_GEAR = (0.4, 2.5), (0.85, 1.18)  # slopes with which signals that are one quantity may go together
TEMPERATURES = (-100.0, 200.0)  # degC that an actuator may have at the start


# --- sensors that are not what the file says -------------------------------------------------------------------------


def refuse_mistaken(path: str, recording: Recording, actuator: ActuatorParameters) -> None:
    """Refuse signals that contradict each other by more than any effect could.

    Raises
    ------
    InputError : naming the file, the variable and what contradicts it
    """
    refuse_other_actuator(path, recording, actuator)
    ambient = recording.ambient_temperature
    if not TEMPERATURES[0] <= ambient <= TEMPERATURES[1]:
        low, high = TEMPERATURES
        raise InputError(f"{path}: ambient_temperature is {ambient:g} degC, accepted is {low:g} to {high:g} degC")
    for variable in ("phase_voltage", "phase_current"):
        dead = np.flatnonzero(np.ptp(getattr(recording, variable), axis=0) == 0.0)
        if len(dead):
            raise InputError(f"{path}: {variable} of phase {PHASES[dead[0]]} never changes; the channel is dead")
    refuse_frozen(path, recording, actuator)
    refuse_bus(path, recording, actuator)
    _refuse_wrapped(path, recording)
    recording = calm_motion(recording)  # a spike is no mistaken sensor
    theta = recording.rotor_angle - recording.rotor_angle[0]
    travel = float(np.ptp(theta))
    if travel > 1.0:
        by_speed = np.cumsum(recording.rotor_speed) * recording.interval
        if not _follows(theta, by_speed)[0] and not _alike_but_for_drift(theta, by_speed, recording.interval):
            _refuse_unlike(path, "rotor_speed", "the rate of rotor_angle", theta, by_speed)
        _refuse_speed(path, recording)
    if travel > 5.0:
        by_shaft = actuator.gear_ratio * (recording.output_position - recording.output_position[0])
        _refuse_unlike(
            path,
            "output_position",
            f"rotor_angle over the gear ratio {actuator.gear_ratio:g}",
            theta,
            by_shaft,
            OF_GEAR,
        )
        by_rotor = theta / actuator.gear_ratio
        of_shaft, of_command = (
            np.std(values - by_rotor) for values in (recording.output_position, recording.commanded_position)
        )
        if of_command < 0.2 * of_shaft and of_shaft > 5e-4:
            raise InputError(
                f"{path}: output_position and commanded_position are swapped: the command goes with the rotor"
            )
    refuse_unfollowed(path, recording, actuator)
    if recording.phase_current_end is not None:
        order = _best_order(_correlation(recording.phase_current, recording.phase_current_end))
        if order is not None and order != (0, 1, 2):
            raise InputError(f"{path}: phase_current_end has its phases in another order than phase_current")
    if travel * actuator.pole_pairs > 4 * np.pi:
        whole = not any(clipped(recording))  # what is cut off says nothing of units
        if whole:
            refuse_unbalanced(path, recording)
        _refuse_swapped_phases(path, recording, actuator)
        if whole:
            refuse_implausible(path, recording, actuator)


def held(recording: Recording) -> np.ndarray:
    """(sample,) bool: where a voltage or current repeats the sample before and is none of the interval's own; a current
    at an interval's end is one of the next interval, too. Coarse steps repeat by themselves."""
    out = np.zeros(len(recording.time), bool)
    for channel in ("phase_voltage", "phase_current", "phase_current_end"):
        values = getattr(recording, channel)
        for x in values.T if values is not None else ():
            same = repeated(x)
            if same.any() and lattice_step(x) == 0.0:
                out |= same
                if channel == "phase_current_end":
                    out[1:] |= same[:-1]
    return out


def bridged(recording: Recording, rows: np.ndarray) -> Recording:
    """A recording whose signals go straight across some rows (sample,) bool."""
    at, kept = np.arange(len(rows)), np.flatnonzero(~rows)
    names = ("phase_voltage", "phase_current", "phase_current_end", "bus_voltage", *MOTION)
    found = {n: x for n in names if (x := getattr(recording, n)) is not None}
    across = {
        n: np.column_stack([np.interp(at, kept, c[kept]) for c in x.reshape(len(rows), -1).T]).reshape(x.shape)
        for n, x in found.items()
    }
    return replace(recording, **across)  # type: ignore[arg-type]


def _follows(wanted: np.ndarray, got: np.ndarray, slopes: tuple[float, float] = OF_SPEED) -> tuple[bool, float, float]:
    """Whether ``got`` goes with ``wanted``: slope near one and alike; both figures."""
    slope = float(wanted @ got / max(wanted @ wanted, 1e-30))
    likeness = float(np.corrcoef(wanted, got)[0, 1]) if np.ptp(got) > 0 else 0.0
    return likeness >= 0.8 and slopes[0] < slope < slopes[1], slope, likeness


def _alike_but_for_drift(wanted: np.ndarray, got: np.ndarray, interval: float) -> bool:
    """Whether an integrated speed follows an angle once a constant speed is taken off: a coarsely truncated speed has
    one."""
    from scipy.signal import detrend  # a second to import, and seldom needed

    time = np.arange(len(wanted)) * interval
    drift, bent, other = np.polyfit(time, got - wanted, 1)[0], detrend(wanted), detrend(got)
    return bool(abs(drift) < DRIFT and np.ptp(bent) > BENT and _follows(bent, other)[0])


def _refuse_unlike(
    path: str, variable: str, what: str, wanted: np.ndarray, got: np.ndarray, slopes: tuple[float, float] = OF_SPEED
) -> None:
    """Refuse ``got`` unless it follows ``wanted`` with a slope near one."""
    follows, slope, likeness = _follows(wanted, got, slopes)
    if not follows:
        raise InputError(
            f"{path}: {variable} is not {what} (slope {slope:.2g}, correlation {likeness:.2f}); "
            "sensors, units or signs are mistaken"
        )


def _refuse_wrapped(path: str, recording: Recording) -> None:
    """Refuse an angle that is wrapped to one turn."""
    turned, turn = np.diff(recording.rotor_angle), 2.0 * np.pi
    beyond = turned - recording.interval * recording.rotor_speed[1:]
    jumps = np.abs(beyond) > 0.5 * turn
    if jumps.any() and np.all(np.abs(np.abs(turned[jumps]) - turn) < WRAPPED * turn):
        raise InputError(
            f"{path}: rotor_angle jumps by a turn {jumps.sum()} times, it is wrapped; accepted is an unwrapped angle, "
            "as numpy.unwrap gives it"
        )


def _refuse_speed(path: str, recording: Recording) -> None:
    """Refuse a speed with another scale than any sensor of it has."""
    scale, most = speed_scale(recording), largest("speed_scale", "scale")
    if abs(scale.off) > most:
        raise InputError(
            f"{path}: rotor_speed is {scale.value:.3g} times the rate of rotor_angle, accepted is {1.0 - most:g} to "
            f"{1.0 + most:g}; the unit or scale of one of them is mistaken"
        )


def _correlation(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(3, 3) correlation of the columns of a with those of b."""
    a, b = a - a.mean(0), b - b.mean(0)
    scale = np.sqrt(np.outer((a * a).sum(0), (b * b).sum(0)))
    return (a.T @ b) / np.maximum(scale, 1e-30)


def _best_order(score: np.ndarray, margin: float = 0.5) -> tuple[int, ...] | None:
    """Order of columns with the largest sum of scores; None where the right order is nearly as good."""
    totals = {order: sum(score[j, m] for j, m in enumerate(order)) for order in permutations(range(3))}
    best = max(totals, key=lambda o: totals[o])
    return best if best == (0, 1, 2) or totals[best] > totals[0, 1, 2] + margin else None


def _refuse_swapped_phases(path: str, recording: Recording, actuator: ActuatorParameters) -> None:
    """Voltages regressed on all currents, their rises and all back-EMF shapes show which of them belong to which phase.

    At speed the rise of a current takes more voltage than its resistance where L p w is beyond R, and goes with the
    difference of the other two: without it these would seem to drive the phase.
    """
    theta, dt = recording.rotor_angle, recording.interval
    middle = 0.5 * (theta[1:] + theta[:-1])
    half = max(1, round(3e-4 / dt))
    w = np.gradient(middle, dt)
    w = np.convolve(w, np.ones(2 * half + 1) / (2 * half + 1), "same")
    moving = (np.abs(w) > MOVING) & (actuator.pole_pairs * np.abs(w) * dt < LOST)
    if moving.sum() < 200:
        return
    x = actuator.pole_pairs * middle[moving, None] - AXIS
    shape = np.clip(np.arcsin(np.sin(x)) * 6.0 / np.pi, -1.0, 1.0) * actuator.back_emf * w[moving, None]
    mean, ends = recording.phase_current, recording.phase_current_end
    rise = np.gradient(mean, axis=0)[1:] if ends is None else np.diff(ends, axis=0)
    driven = [mean[1:][moving] * actuator.resistance, rise[moving] * actuator.inductance / dt]
    driven = [values - values.mean(1, keepdims=True) for values in driven]
    columns = np.concatenate([*driven, shape, np.ones((len(shape), 1))], axis=1)
    scale = np.sqrt((columns**2).mean(0))
    if np.any(scale < 1e-9):
        return
    solution, *_ = np.linalg.lstsq(columns / scale, recording.phase_voltage[1:][moving], rcond=1e-6)
    gains = (solution / scale[:, None]).T  # (phase, column), 1 where all is as the file says
    share = np.array([(values**2).sum() for values in driven])
    of_current = np.tensordot(share / share.sum(), gains[:, :6].reshape(3, 2, 3), (0, 1))
    of_current += 1.0 / 3.0 - of_current.mean(1, keepdims=True)
    of_shape = gains[:, 6:9]
    size = np.sqrt((shape**2).mean())
    if np.trace(of_current) < -0.5:
        raise InputError(f"{path}: phase_current has the wrong sign against phase_voltage; it counts into the motor")
    by_current = _best_order(of_current, 1.0)
    by_shape = _best_order(of_shape, 1.0) if size > 0.15 else (0, 1, 2)
    if by_current is None or by_shape is None:
        return
    letters = "".join(PHASES[m] for m in (by_current if by_shape == (0, 1, 2) else by_shape))
    if by_current != (0, 1, 2) and by_shape == (0, 1, 2):
        raise InputError(
            f"{path}: phase_current has its phases swapped: phase_voltage a, b, c goes with the currents {letters}"
        )
    if by_current != (0, 1, 2):
        raise InputError(
            f"{path}: phase_voltage has its phases swapped: a, b, c go with the currents and back-EMFs of {letters}"
        )
    if by_shape != (0, 1, 2):
        raise InputError(
            f"{path}: rotor_angle does not go with the phases: the back-EMFs of a, b, c are those of {letters}"
        )
    if size > 0.15 and np.trace(of_shape) < -1.0:
        raise InputError(f"{path}: rotor_angle is half an electrical turn off: every back-EMF has the wrong sign")


# --- recordings that are whole but of no use -------------------------------------------------------------------------


def useless(recording: Recording, actuator: ActuatorParameters):
    """Yield (variable, rule) for what makes a recording unusable."""
    recording = calm_motion(recording)
    theta, dt = recording.rotor_angle, recording.interval
    travel = float(np.ptp(theta))
    command = recording.commanded_position
    if np.ptp(command) < 1e-7 and abs(command[0]) < 1e-7:
        yield "commanded_position", "never moves; a recording in motion is needed"
    if travel < LEAST_TRAVEL:
        yield "rotor_angle", f"never moves (by {travel:.2g} rad); a recording in motion is needed"
    if dt > SLOWEST_INTERVAL * 1.001:
        yield "time", f"has an interval of {1e3 * dt:.3g} ms; 1 ms or less is accepted"
    step = actuator.pole_pairs * np.abs(np.diff(theta))
    if travel > LEAST_TRAVEL and step[step > LOST].sum() > 0.5 * step.sum():
        yield "time", "is sampled too slowly: through most of the motion a sample spans more than a commutation sector"
    speed = min(abs(theta[1] - theta[0]) / dt, float(np.abs(recording.rotor_speed[1])))
    reached = 2.0 * actuator.back_emf * actuator.current_limit / actuator.inertia * 2.0 * dt  # from rest by then
    if speed > AT_REST + 1.5 * reached:
        yield "rotor_speed", f"is {speed:.3g} rad/s at the start; a recording starts at rest"
    at = float(np.median(recording.output_position[:3]))
    if abs(at) > START_POSITION:
        yield "output_position", f"is {at:.3g} rad at the start; a recording starts at zero"
    yield from broken(recording)


def broken(recording: Recording):
    """Yield (variable, rule) for channels that do not show through most of a motion, or all of it, what they should."""
    yield from clipped(recording)
    dt = recording.interval
    stuck = _longest_constant(recording.rotor_angle, np.abs(recording.rotor_speed) > 10.0)
    if stuck * dt > 5e-3 and stuck > 10:
        yield "rotor_angle", f"stays exactly the same for {1e3 * stuck * dt:.0f} ms while the rotor turns"


def clipped(recording: Recording):
    """Yield (variable, rule) for channels whose samples at one extreme value leave too little of the motion."""
    moving, w = _motion(recording)
    if moving.sum() < 3 * CLIPPED_LEAST:
        return
    for variable, cut in cut_off(recording).items():
        lost = (cut & moving[:, None]).any(axis=1).sum()
        if lost > CLIPPED_MOST * moving.sum():
            j = int(np.argmax(cut.sum(axis=0)))
            level = getattr(recording, variable)[cut[:, j], j][0]
            yield variable, f"clips: phase {PHASES[j]} is at {level:.4g} in {cut[:, j].sum()} samples"
    for extreme in (np.max, np.min):
        level, count, _ = _at_extreme(recording.rotor_speed[moving], extreme)
        beyond = np.abs(w[moving][recording.rotor_speed[moving] == level]) - abs(level)
        if abs(level) > 1e-9 and count >= CLIPPED_SPEED and np.mean(beyond > 0.02 * abs(level) + 1.0) > 0.5:
            yield "rotor_speed", f"clips: {level:.4g} rad/s in {count} samples while the rotor turns faster"


def cut_off(recording: Recording) -> dict[str, np.ndarray]:
    """Samples that a channel's range cuts off, (sample, phase) by variable: those at one extreme value, where a
    hundredth of the motion or more is; none of channels that have none."""
    moving, _ = _motion(recording)
    if moving.sum() < 3 * CLIPPED_LEAST:
        return {}
    least = max(CLIPPED_LEAST, CLIPPED_SHARE * moving.sum())
    out = {}
    for variable in ("phase_voltage", "phase_current", "phase_current_end"):
        values = getattr(recording, variable)
        cut = np.zeros((len(moving), 3), bool)
        for j in range(3) if values is not None else ():
            for extreme in (np.max, np.min):
                level, count, beside = _at_extreme(values[moving, j], extreme)
                enough = count >= max(least, 5 * beside)
                if not enough and count >= CLIPPED_FINE and beside < 1.5:
                    enough = lattice_step(values[:, j]) == 0.0  # of a coarse channel values repeat anyway
                if abs(level) > 1e-9 and enough:
                    cut[:, j] |= values[:, j] == level
        if cut.any():
            out[variable] = cut
    return out


def spikes(values: np.ndarray) -> np.ndarray:
    """(spike,) samples at which the sum of channels (sample, channel) stands out of both its neighbours, which are
    alike, as one of the channels does; none where there are few. What a gain or a lag of a channel leaves of the motion
    in the sum is none: there the channel does more, or nothing, or the next sample does the opposite."""
    together = values.sum(axis=1)
    size = np.zeros(len(values))
    size[1:-1] = np.abs(together[1:-1] - 0.5 * (together[:-2] + together[2:]))
    scale = float(np.median(size[1:-1])) / 0.6745
    summed = _standing_out(together[:, None])
    half = 0.5 * np.abs(summed[:, 0])
    alone = np.abs(summed - _standing_out(values)).min(axis=1) < half
    alone &= np.abs(np.roll(together, 1) - np.roll(together, -1)) < half
    out = np.flatnonzero((size > SPIKE * scale) & (size >= np.roll(size, 1)) & (size >= np.roll(size, -1)) & alone)
    told = scale > 1e-9 * float(np.abs(values).max())  # else most sums are the same, of a converter's coarse steps
    return out if told and len(out) >= FEWEST_SPIKES else out[:0]


def _standing_out(values: np.ndarray) -> np.ndarray:
    """(sample, channel) by how much at least samples lie above both their neighbours or, negative, below."""
    out = np.zeros(values.shape)
    before, after = values[1:-1] - values[:-2], values[1:-1] - values[2:]
    less = np.minimum(np.abs(before), np.abs(after))
    out[1:-1] = np.where(before * after > 0.0, np.sign(before) * less, 0.0)
    return out


def without_spikes(current: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Phase currents (sample, phase) less their spikes, which are told from the motion by the sum of the phases: with
    the mean of both neighbours there; and (spike,) the samples."""
    rows = spikes(current)
    mean = 0.5 * (current[rows - 1] + current[rows + 1])
    phase = np.argmax(np.abs(current[rows] - mean), axis=1)
    out = current.copy()
    out[rows, phase] = mean[np.arange(len(rows)), phase]
    return out, rows


def _motion(recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """(sample,) where the rotor moves, and the angle's rate (rad/s)."""
    dt, theta = recording.interval, recording.rotor_angle
    half = max(1, round(1e-3 / dt))
    w = np.zeros(len(theta))
    w[half:-half] = (theta[2 * half :] - theta[: -2 * half]) / (2 * half * dt)
    return np.abs(w) > MOVING, w


def _at_extreme(values: np.ndarray, extreme: Callable) -> tuple[float, int, float]:
    """Extreme value, how often it occurs, and how often the three values next to it do on average."""
    levels: list[float] = []
    counts: list[int] = []
    rest = values
    while len(rest) and len(levels) < 4:
        levels.append(float(extreme(rest)))
        others = rest[rest != levels[-1]]
        counts.append(len(rest) - len(others))
        rest = others
    return levels[0], counts[0], float(np.mean(counts[1:])) if len(counts) > 1 else float(counts[0])


def _longest_constant(values: np.ndarray, where: np.ndarray) -> int:
    """Longest run of samples that are exactly equal to the one before, where ``where`` holds."""
    same = (np.diff(values) == 0.0) & where[1:]
    ends = np.flatnonzero(~np.concatenate([[False], same, [False]]))  # each run of the same lies between two of these
    return int(np.diff(ends).max()) - 1

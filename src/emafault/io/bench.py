"""A bench: a folder of recordings of one actuator, read, checked and split into what explores and what confirms.

A file that is not in the format, recordings of two units and sensors that belong to other channels refuse the bench. A
recording that is whole but useless (it stands still, a channel clips, it is sampled too slowly) is set aside with a
warning, and the bench is refused only if none is left.
"""

from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import dataclass
from itertools import combinations, permutations
from pathlib import Path

import numpy as np

from ..actuator.commands import jumps_of
from ..actuator.motor import AXIS
from ..actuator.parameters import ActuatorParameters
from ..errors import InputError
from ..io.recording import PHASES, Recording, read_recording, recordings_in

SLOWEST_INTERVAL = 1e-3  # s
LEAST_TRAVEL = 0.1  # rad of the rotor; less is standing still
AT_REST = 5.0  # rad/s above what full current reaches from rest
START_POSITION = 3e-3  # rad at the user shaft, from zero
MOVING = 2.0  # rad/s
CLIPPED_SHARE = 0.01  # of the samples in motion at one and the same extreme value
CLIPPED_LEAST = 20
CLIPPED_FINE = 8  # samples in a channel whose values otherwise never repeat
COARSE = np.pi / 6  # electrical rad from sample to sample: two samples in a commutation sector
LOST = 2 * np.pi / 3  # from here on a sample cannot be told its sector
DRIFT = 3.0  # rad/s, below which a constant speed beside the rate of the angle is no mistake: coarse truncation has it
BENT = 0.5  # rad of the angle beside a constant speed, from which a drift is told from a mistake
SAME_CONDITION = 2.0  # K
TEMPERATURES = (-100.0, 200.0)  # degC that an actuator may be soaked at


@dataclass(frozen=True)
class Bench:
    """Recordings by file name, and warnings: what was set aside and what these recordings cannot tell."""

    name: str
    recordings: dict[str, Recording]
    warnings: list[dict]


def read_bench(path: str | Path, actuator: ActuatorParameters) -> Bench:
    """Read and check a folder of recordings, or a single one.

    Raises
    ------
    InputError : naming the file, the variable and the rule broken
    """
    path = Path(path)
    files = recordings_in([path])
    recordings = {file.name: read_recording(file) for file in files}
    name = path.resolve().name if path.is_dir() else path.stem
    return check_bench(name, recordings, actuator, {f.name: str(f) for f in files})


def check_bench(
    name: str,
    recordings: Mapping[str, Recording],
    actuator: ActuatorParameters,
    paths: Mapping[str, str] | None = None,
) -> Bench:
    """Check recordings that have been read; ``paths`` gives how messages name them.

    Raises
    ------
    InputError : recordings of two units, sensors that belong to other channels, or no recording that can be used
    """
    shown = paths or {n: n for n in recordings}
    units: dict[str, str] = {}
    for n, recording in recordings.items():
        unit = recording.attributes.get("unit", "")
        if unit not in ("", "unknown"):
            units.setdefault(unit, n)
    if len(units) > 1:
        (one, first), (other, second) = list(units.items())[:2]
        raise InputError(
            f"{shown[second]}: unit is '{other}', that of {first} is '{one}'; a bench holds recordings of one unit"
        )
    kept: dict[str, Recording] = {}
    warnings: list[dict] = []
    for n, recording in recordings.items():
        refuse_mistaken(shown[n], recording, actuator)
        copy = next((o for o, other in kept.items() if _same(recording, other)), None)
        found = (("time", f"holds the same data as {copy}"),) if copy else tuple(useless(recording, actuator))
        if found:
            variable, rule = found[0]
            warnings.append(_warning("set aside", f"{n}: {variable} {rule}; the recording is set aside", n, variable))
        else:
            kept[n] = recording
    if not kept:
        first = next(iter(recordings))
        rule = warnings[0]["message"].removeprefix(f"{first}: ").removesuffix("; the recording is set aside")
        none_left = "; no recording of the bench can be used" if len(recordings) > 1 else ""
        raise InputError(f"{shown[first]}: {rule}{none_left}")
    return Bench(name, kept, warnings + limits(kept, actuator))


def _warning(kind: str, message: str, file: str | None = None, variable: str | None = None) -> dict:
    return {"kind": kind, "file": file, "variable": variable, "message": message}


def _same(one: Recording, other: Recording) -> bool:
    return len(one.time) == len(other.time) and np.array_equal(one.phase_voltage, other.phase_voltage)


# --- sensors that are not what the file says -------------------------------------------------------------------------


def refuse_mistaken(path: str, recording: Recording, actuator: ActuatorParameters) -> None:
    """Refuse signals that contradict each other by more than any effect could.

    Raises
    ------
    InputError : naming the file, the variable and what contradicts it
    """
    ambient = recording.ambient_temperature
    if not TEMPERATURES[0] <= ambient <= TEMPERATURES[1]:
        low, high = TEMPERATURES
        raise InputError(f"{path}: ambient_temperature is {ambient:g} degC, accepted is {low:g} to {high:g} degC")
    theta = recording.rotor_angle - recording.rotor_angle[0]
    travel = float(np.ptp(theta))
    if travel > 1.0:
        by_speed = np.cumsum(recording.rotor_speed) * recording.interval
        if not _follows(theta, by_speed)[0] and not _alike_but_for_drift(theta, by_speed, recording.interval):
            _refuse_unlike(path, "rotor_speed", "the rate of rotor_angle", theta, by_speed)
    if travel > 5.0:
        by_shaft = actuator.gear_ratio * (recording.output_position - recording.output_position[0])
        _refuse_unlike(
            path, "output_position", f"rotor_angle over the gear ratio {actuator.gear_ratio:g}", theta, by_shaft
        )
        by_rotor = theta / actuator.gear_ratio
        of_shaft, of_command = (
            np.std(values - by_rotor) for values in (recording.output_position, recording.commanded_position)
        )
        if of_command < 0.2 * of_shaft and of_shaft > 5e-4:
            raise InputError(
                f"{path}: output_position and commanded_position are swapped: the command goes with the rotor"
            )
    if recording.phase_current_end is not None:
        order = _best_order(_correlation(recording.phase_current, recording.phase_current_end))
        if order is not None and order != (0, 1, 2):
            raise InputError(f"{path}: phase_current_end has its phases in another order than phase_current")
    if travel * actuator.pole_pairs > 4 * np.pi:
        _refuse_swapped_phases(path, recording, actuator)


def _follows(wanted: np.ndarray, got: np.ndarray) -> tuple[bool, float, float]:
    """Whether ``got`` goes with ``wanted``: slope near one and alike; both figures."""
    slope = float(wanted @ got / max(wanted @ wanted, 1e-30))
    likeness = float(np.corrcoef(wanted, got)[0, 1]) if np.ptp(got) > 0 else 0.0
    return likeness >= 0.8 and 0.4 < slope < 2.5, slope, likeness


def _alike_but_for_drift(wanted: np.ndarray, got: np.ndarray, interval: float) -> bool:
    """Whether an integrated speed follows an angle once a constant speed is taken off: a coarsely truncated speed has
    one."""
    from scipy.signal import detrend  # a second to import, and seldom needed

    time = np.arange(len(wanted)) * interval
    drift, bent, other = np.polyfit(time, got - wanted, 1)[0], detrend(wanted), detrend(got)
    return bool(abs(drift) < DRIFT and np.ptp(bent) > BENT and _follows(bent, other)[0])


def _refuse_unlike(path: str, variable: str, what: str, wanted: np.ndarray, got: np.ndarray) -> None:
    """Refuse ``got`` unless it follows ``wanted`` with a slope near one."""
    follows, slope, likeness = _follows(wanted, got)
    if not follows:
        raise InputError(
            f"{path}: {variable} is not {what} (slope {slope:.2g}, correlation {likeness:.2f}); "
            "sensors, units or signs are mistaken"
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
    """Voltages regressed on all currents and on all back-EMF shapes show which of them belong to which phase."""
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
    current = recording.phase_current[1:][moving] * actuator.resistance
    columns = np.concatenate([current - current.mean(1, keepdims=True), shape, np.ones((len(shape), 1))], axis=1)
    scale = np.sqrt((columns**2).mean(0))
    if np.any(scale < 1e-9):
        return
    solution, *_ = np.linalg.lstsq(columns / scale, recording.phase_voltage[1:][moving], rcond=1e-6)
    gains = (solution / scale[:, None]).T  # (phase, column), 1 where all is as the file says
    of_current = gains[:, :3] - gains[:, :3].mean(1, keepdims=True) + 1.0 / 3.0
    of_shape = gains[:, 3:6]
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
    yield from clipped(recording)
    stuck = _longest_constant(theta, np.abs(recording.rotor_speed) > 10.0)
    if stuck * dt > 5e-3 and stuck > 10:
        yield "rotor_angle", f"stays exactly the same for {1e3 * stuck * dt:.0f} ms while the rotor turns"


def clipped(recording: Recording):
    """Yield (variable, rule) for channels that sit at one extreme value in a hundredth of the motion or more."""
    dt, theta = recording.interval, recording.rotor_angle
    half = max(1, round(1e-3 / dt))
    w = np.zeros(len(theta))
    w[half:-half] = (theta[2 * half :] - theta[: -2 * half]) / (2 * half * dt)
    moving = np.abs(w) > MOVING
    if moving.sum() < 3 * CLIPPED_LEAST:
        return
    least = max(CLIPPED_LEAST, CLIPPED_SHARE * moving.sum())
    channels = {"phase_voltage": recording.phase_voltage, "phase_current": recording.phase_current}
    if recording.phase_current_end is not None:
        channels["phase_current_end"] = recording.phase_current_end
    for variable, values in channels.items():
        for j, letter in enumerate(PHASES):
            for extreme in (np.max, np.min):
                level, count, beside = _at_extreme(values[moving, j], extreme)
                if abs(level) > 1e-9 and count > 5 * beside and count >= (least if beside > 1.5 else CLIPPED_FINE):
                    yield variable, f"clips: phase {letter} is at {level:.4g} in {count} samples"
    for extreme in (np.max, np.min):
        level, count, _ = _at_extreme(recording.rotor_speed[moving], extreme)
        beyond = np.abs(w[moving][recording.rotor_speed[moving] == level]) - abs(level)
        if count >= CLIPPED_FINE and np.mean(beyond > 0.02 * abs(level) + 1.0) > 0.5:
            yield "rotor_speed", f"clips: {level:.4g} rad/s in {count} samples while the rotor turns faster"


def _at_extreme(values: np.ndarray, extreme: Callable) -> tuple[float, int, float]:
    """Extreme value, how often it occurs, and how often the three values next to it do on average."""
    distinct, counts = np.unique(values, return_counts=True)
    if extreme is np.max:
        distinct, counts = distinct[::-1], counts[::-1]
    return float(distinct[0]), int(counts[0]), float(np.mean(counts[1:4])) if len(counts) > 1 else float(counts[0])


def _longest_constant(values: np.ndarray, where: np.ndarray) -> int:
    """Longest run of samples that are exactly equal to the one before, where ``where`` holds."""
    run = best = 0
    for same in (np.diff(values) == 0.0) & where[1:]:
        run = run + 1 if same else 0
        best = max(best, run)
    return best


# --- what these recordings cannot tell -------------------------------------------------------------------------------


def limits(recordings: Mapping[str, Recording], actuator: ActuatorParameters) -> list[dict]:
    """Warnings that limit what can be claimed."""
    out = []

    def say(message: str, file: str | None = None, variable: str | None = None) -> None:
        out.append(_warning("limits", message, file, variable))

    if len(recordings) == 1:
        say("a single recording: nothing is held out, so that how far the gap shrinks cannot be checked")
    ambient = [r.ambient_temperature for r in recordings.values()]
    if np.ptp(ambient) < 15.0:
        say(
            f"all recordings were soaked within {np.ptp(ambient):.1f} K: what depends on temperature cannot be told "
            "from what does not",
            variable="ambient_temperature",
        )
    if not any(r.health == "healthy" for r in recordings.values()):
        say("no recording is called healthy: a fault and this unit's own tolerance are told apart by priors alone")
    turns = {
        d: any(np.maximum(d * np.diff(r.rotor_angle), 0.0).sum() > 10.0 for r in recordings.values()) for d in (1, -1)
    }
    if not all(turns.values()):
        say("the rotor turns in one direction only: a constant load, an asymmetric friction and an offset look alike")
    for variable, what in (("phase_current_end", "inductances"), ("bus_voltage", "the supply")):
        lacking = [n for n, r in recordings.items() if getattr(r, variable) is None]
        if lacking:
            which = (
                "no recording" if len(lacking) == len(recordings) else f"not every recording ({lacking[0]} does not)"
            )
            say(f"{which} holds {variable}: {what} can be judged less well", variable=variable)
    for n, r in recordings.items():
        step = actuator.pole_pairs * np.abs(np.diff(r.rotor_angle))
        if step[step > COARSE].sum() > 0.5 * step.sum():
            say(
                f"{n}: fewer than two samples in a commutation sector through most of the motion: the electrical "
                "equations of this recording tell little",
                n,
                "time",
            )
    return out


# --- split -----------------------------------------------------------------------------------------------------------


def split_bench(recordings: Mapping[str, Recording]) -> tuple[list[str], list[str]]:
    """Names of the recordings that explore and of those that confirm; the same for the same recordings in any order.

    Whole conditions (health, command and temperature) go to one side. Explore keeps a healthy recording where there is
    one and one of the unknown fault where confirm has it; about three in ten confirm, such that both sides
    spread over temperatures, commands and directions and neither is of steps alone.
    """
    names = sorted(recordings)
    number = round(len(names) / 3.5) if len(names) > 2 else len(names) - 1
    conditions = _conditions({n: recordings[n] for n in names})
    if len(conditions) == 1 and len(names) > 1:
        conditions = [[n] for n in names]  # repetitions of one condition: by recording is all there is
    steps = {n for n in names if len(jumps_of(recordings[n].commanded_position))}
    reach = {n: _reach(recordings[n]) for n in names}
    best: tuple[float, tuple[str, ...]] | None = None
    for size in range(1, len(conditions)):
        if size > number:
            break
        chosen = combinations(conditions, size)
        for count, choice in enumerate(chosen):
            if count > 20_000:
                break
            confirm = tuple(sorted(n for condition in choice for n in condition))
            if not 0 < len(confirm) <= max(number, 1):
                continue
            explore = [n for n in names if n not in confirm]
            if not _allowed(recordings, explore, confirm):
                continue
            cost = _cost(recordings, explore, confirm, steps, reach) + 2.0 * (number - len(confirm))
            if best is None or (cost, confirm) < best:
                best = (cost, confirm)
    held = list(best[1]) if best else []
    return [n for n in names if n not in held], held


def _conditions(recordings: Mapping[str, Recording]) -> list[list[str]]:
    """Recordings of the same health, command and temperature together."""
    found: list[list[str]] = []
    for n, r in recordings.items():
        for condition in found:
            o = recordings[condition[0]]
            close = abs(o.ambient_temperature - r.ambient_temperature) < SAME_CONDITION
            if close and o.health == r.health != "seeded" and _same_command(o, r):
                condition.append(n)
                break
        else:
            found.append([n])
    return found


def _same_command(one: Recording, other: Recording) -> bool:
    end = min(one.time[-1], other.time[-1])
    ticks = np.linspace(0.0, end, 50)
    a, b = (np.interp(ticks, r.time, r.commanded_position) for r in (one, other))
    return bool(np.max(np.abs(a - b)) < 0.02 * max(np.ptp(a), np.ptp(b), 1e-6))


def _allowed(recordings: Mapping[str, Recording], explore: Sequence[str], confirm: Sequence[str]) -> bool:
    inside = {recordings[n].health for n in explore}
    if any(r.health == "healthy" for r in recordings.values()) and "healthy" not in inside:
        return False
    return all(recordings[n].health in ("seeded", *inside) for n in confirm)


def _reach(recording: Recording) -> np.ndarray:
    """Current (A) and speed (rad/s) that a hundredth of a recording exceeds."""
    signals = (recording.phase_current, recording.rotor_speed)
    return np.array([max(float(np.quantile(np.abs(x), 0.99)), 1e-9) for x in signals])


def _cost(
    recordings: Mapping[str, Recording],
    explore: Sequence[str],
    confirm: Sequence[str],
    steps: Set[str],
    reach: Mapping[str, np.ndarray],
) -> float:
    """What a split lacks: range of temperature, current, speed, commands and directions in explore, spread and kinds in
    confirm."""

    def ambient(names: Sequence[str]) -> np.ndarray:
        return np.array([recordings[n].ambient_temperature for n in names])

    def kinds(names: Sequence[str]) -> list[tuple[str, bool]]:
        rs = [recordings[n] for n in names]
        return [(r.attributes.get("command", "unknown"), bool(r.rotor_angle[-1] >= r.rotor_angle[0])) for r in rs]

    every = ambient([*explore, *confirm])
    width = max(float(np.ptp(every)), 1.0)
    telling = [n for n in explore if n not in steps] or explore  # a temperature met after a step alone is hardly met
    cost = 2.0 * (1.0 - float(np.ptp(ambient(telling))) / width)
    cost += abs(float(ambient(confirm).mean() - every.mean())) / width
    if len(confirm) > 1:
        cost += 0.5 * max(0.0, 0.5 - float(np.ptp(ambient(confirm))) / width)
    inside = kinds(explore)
    cost += 1.0 * sum(kind not in inside for kind in kinds(confirm)) / len(confirm)
    cost += 0.5 * (1.0 - len(set(kinds(confirm))) / len(confirm))
    # what shows at large currents or high speeds alone must be there to be fitted
    largest = np.max([reach[n] for n in recordings], axis=0)
    cost += float(np.sum(1.0 - np.max([reach[n] for n in explore], axis=0) / largest))
    healths = {r.health for r in recordings.values()}
    cost += 0.5 * sum(h not in {recordings[n].health for n in confirm} for h in healths) / len(healths)
    # after a step an actuator hunts, and how it does proves little: neither side is made of such recordings alone
    cost += sum(set(side) <= steps for side in (explore, confirm)) * (len(steps) < len(recordings))
    total = sum(r.time[-1] for r in recordings.values())
    share = sum(recordings[n].time[-1] for n in confirm) / total
    return cost + 2.0 * max(0.0, share - 0.4)

"""Which recordings of a bench explore and which confirm."""

from collections.abc import Callable, Mapping, Sequence
from itertools import combinations
from math import comb

import numpy as np

from ..actuator.commands import jumps_of
from .recording import Recording

SAME_CONDITION = 2.0  # K
MOST = 4000  # splits that are looked at: all of them where there are no more, else those that exchanges lead to
TURN, PARTS = 2.0 * np.pi, 36  # rad of the rotor, and what it is looked at in
STARTS = (0.5, 0.0, 0.75, 0.25, 0.9, 0.1, 0.6, 0.4)  # share of the step at which an even choice begins

#: what a choice of recordings to confirm lacks, given their places in order of name; None where it is not allowed
Lack = Callable[[tuple[int, ...]], float | None]


def split_bench(recordings: Mapping[str, Recording]) -> tuple[list[str], list[str]]:
    """Names of the recordings that explore and of those that confirm; the same for the same recordings in any order.

    Whole conditions (health, command and temperature) go to one side. Explore keeps a healthy recording where there is
    one and one of the unknown fault where confirm has it; about three in ten confirm, such that both sides
    spread over temperatures, commands and directions and neither is of steps alone.
    """
    names = sorted(recordings)
    given = [recordings[n] for n in names]
    number = round(len(names) / 3.5) if len(names) > 2 else len(names) - 1
    conditions = _conditions(given)
    if len(conditions) == 1 and len(names) > 1:
        conditions = [[n] for n in range(len(names))]  # repetitions of one condition: by recording is all there is
    sizes = range(1, min(number, len(conditions) - 1) + 1)
    lack = _lack(given, number)
    if sum(comb(len(conditions), size) for size in sizes) <= MOST:
        confirm = _of_all(conditions, sizes, lack)
    else:
        confirm = _by_exchanges(_in_order(conditions, given), number, lack)
    return [n for k, n in enumerate(names) if k not in confirm], [names[k] for k in confirm]


def _of_all(conditions: Sequence[Sequence[int]], sizes: Sequence[int], lack: Lack) -> tuple[int, ...]:
    """The choice that lacks least of all there are; empty where none is allowed."""
    best: tuple[float, tuple[int, ...]] | None = None
    for size in sizes:
        for chosen in combinations(conditions, size):
            confirm = _together(chosen)
            found = lack(confirm)
            if found is not None and (best is None or (found, confirm) < best):
                best = found, confirm
    return best[1] if best else ()


def _by_exchanges(conditions: Sequence[Sequence[int]], number: int, lack: Lack) -> tuple[int, ...]:
    """A choice that lacks little: spread evenly over conditions in order, then bettered by exchanges one by one.

    Looks at no more than ``MOST`` choices, from several starts where there is time, so that the time goes with the
    number of recordings and not with that of their choices.
    """
    best: tuple[float, tuple[int, ...]] | None = None
    left = MOST
    for start in STARTS:
        held = _spread(conditions, number, lack, start)
        if not held:
            continue
        confirm = _together([conditions[k] for k in held])
        here = float(lack(confirm) or 0.0), confirm
        better = True
        while better and left > 0:
            better = False
            for out in [*held, None]:  # None: one more is taken, none given back
                for k in range(len(conditions)):
                    if k in held or left <= 0 or (out is not None and out not in held):
                        continue
                    trial = [*(m for m in held if m != out), k]
                    confirm = _together([conditions[m] for m in trial])
                    found, left = lack(confirm), left - 1
                    if found is not None and (found, confirm) < here:
                        here, held, better = (found, confirm), trial, True
        best = here if best is None or here < best else best
    return best[1] if best else ()


def _spread(conditions: Sequence[Sequence[int]], number: int, lack: Lack, start: float) -> list[int]:
    """Every so many of the conditions, from a share ``start`` of the step, then whatever there is room for."""
    step = len(conditions) / number
    even = [int((k + start) * step) for k in range(min(number, len(conditions)))]
    held: list[int] = []
    for k in dict.fromkeys([*even, *range(len(conditions))]):
        if sum(len(conditions[m]) for m in held) == number:
            break
        if lack(_together([conditions[m] for m in (*held, k)])) is not None:
            held.append(k)
    return held


def _together(conditions: Sequence[Sequence[int]]) -> tuple[int, ...]:
    return tuple(sorted(n for condition in conditions for n in condition))


def _in_order(conditions: Sequence[Sequence[int]], recordings: Sequence[Recording]) -> list[Sequence[int]]:
    """Conditions by command and direction, then temperature."""
    return sorted(conditions, key=lambda c: (_kind(recordings[c[0]]), recordings[c[0]].ambient_temperature, c[0]))


def _conditions(recordings: Sequence[Recording]) -> list[list[int]]:
    """Recordings of the same health, command and temperature together."""
    found: list[list[int]] = []
    for n, r in enumerate(recordings):
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


def _kind(recording: Recording) -> tuple[str, bool]:
    """Command, and whether the rotor ends ahead of where it began."""
    forward = bool(recording.rotor_angle[-1] >= recording.rotor_angle[0])
    return recording.attributes.get("command", "unknown"), forward


def _reach(recording: Recording) -> list[float]:
    """Current (A) and speed (rad/s) that a hundredth of a recording exceeds."""
    signals = (recording.phase_current, recording.rotor_speed)
    return [max(float(np.quantile(np.abs(x), 0.99)), 1e-9) for x in signals]


def _passed(recording: Recording) -> np.ndarray:
    """(part,) bool: parts of its turn that the rotor is in at any time."""
    return np.bincount((np.mod(recording.rotor_angle, TURN) / TURN * PARTS).astype(int) % PARTS, minlength=PARTS) > 0


def _lack(recordings: Sequence[Recording], number: int) -> Lack:
    """What a split lacks, as a function of the recordings that confirm.

    Range of temperature, current, speed, commands and directions in explore, spread and kinds in confirm, angles of the
    rotor in both, and recordings that confirm, of which ``number`` are wanted.
    """
    count = len(recordings)
    ambient = np.array([r.ambient_temperature for r in recordings])
    kinds = [_kind(r) for r in recordings]
    healths = [r.health for r in recordings]
    steps = np.array([bool(len(jumps_of(r.commanded_position))) for r in recordings])
    reach = np.array([_reach(r) for r in recordings])
    duration = [float(r.time[-1]) for r in recordings]
    largest, total = reach.max(axis=0), sum(duration)
    passed = np.array([_passed(r) for r in recordings])
    width = max(float(np.ptp(ambient)), 1.0)

    def lack(confirm: tuple[int, ...]) -> float | None:
        if not 0 < len(confirm) <= max(number, 1):
            return None
        chosen = np.array(confirm)
        free = np.ones(count, bool)
        free[chosen] = False
        explore = np.flatnonzero(free)
        inside = {healths[k] for k in explore}
        if "healthy" in healths and "healthy" not in inside:
            return None
        if any(healths[k] != "seeded" and healths[k] not in inside for k in confirm):
            return None
        telling = explore[~steps[explore]]  # a temperature met after a step alone is hardly met
        of_confirm = ambient[chosen]
        cost = 2.0 * (1.0 - float(np.ptp(ambient[telling if len(telling) else explore])) / width)
        cost += abs(float(of_confirm.mean() - ambient[[*explore, *chosen]].mean())) / width
        if len(confirm) > 1:
            cost += 0.5 * max(0.0, 0.5 - float(np.ptp(of_confirm)) / width)
        met, asked = {kinds[k] for k in explore}, [kinds[k] for k in confirm]
        cost += 1.0 * sum(kind not in met for kind in asked) / len(confirm)
        cost += 0.5 * (1.0 - len(set(asked)) / len(confirm))
        # what shows at large currents or high speeds alone must be there to be fitted
        cost += float(np.sum(1.0 - reach[explore].max(axis=0) / largest))
        # of what sits at an angle a recording that does not pass it says nothing
        cost += sum(
            1.0 - float(passed[side].any(axis=0).sum()) / passed.any(axis=0).sum() for side in (explore, chosen)
        )
        every = set(healths)
        cost += 0.5 * sum(h not in {healths[k] for k in confirm} for h in every) / len(every)
        # after a step an actuator hunts, and how it does proves little: neither side is made of such recordings alone
        cost += sum(bool(steps[side].all()) for side in (explore, chosen)) * (not steps.all())
        cost += 2.0 * max(0.0, sum(duration[k] for k in confirm) / total - 0.4)
        return cost + 2.0 * (number - len(confirm))

    return lack

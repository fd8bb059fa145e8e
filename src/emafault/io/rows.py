"""Rows that a recording lacks or has twice, as a logger's that has dropped or repeated some and counts time by what it
wrote, and those in which it stood still."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .motion import AROUND, MOVING, jumps, without_spikes_of_motion
from .recording import VARIABLES, Recording


def without_rows_twice(recording: Recording) -> tuple[Recording, int]:
    """The recording less rows that repeat the one before in all channels, and how many there are.

    Where time went on, by the command or by the angle of a rotor that turns, the recorder has stood still.
    """
    twice = np.zeros(len(recording.time), bool)
    for before, last in _repeats([x for n in VARIABLES if (x := getattr(recording, n)) is not None]):
        on = _went_on(recording.commanded_position, before, last)
        if on is None:
            turns = abs(recording.rotor_speed[last]) > MOVING
            on = not turns or _makes_up(recording.rotor_angle, before, last)
        twice[before + 1 : last + 1] = not on
    return (of_rows(recording, np.flatnonzero(~twice)), int(twice.sum())) if twice.any() else (recording, 0)


def stalled(recording: Recording) -> np.ndarray:
    """(sample,) bool: where the recorder stood still while the rotor turned: voltages, currents and angle repeat the
    sample before to the last digit, and time went on, by the command or by the angle."""
    out = np.zeros(len(recording.time), bool)
    for before, last in _repeats((recording.phase_voltage, recording.phase_current, recording.rotor_angle)):
        command = _went_on(recording.commanded_position, before, last)
        out[before + 1 : last + 1] = command or (command is None and _makes_up(recording.rotor_angle, before, last))
    return out


def filled(recording: Recording) -> tuple[Recording, dict[int, int]]:
    """The recording with the row before in the place of each that is missing, as if the recorder had stood still there,
    and how many are missing from which row on.

    In that interval the angle goes on by several times the speed there, and the command by more as well.
    """
    missing = {}
    for jump in jumps(without_spikes_of_motion(recording)):
        swept = recording.interval * recording.rotor_speed[jump.row]
        count = round(jump.size / swept) if jump.missing and swept else 0
        if count > 0:
            missing[jump.row] = count
    if not missing:
        return recording, {}
    times = np.ones(len(recording.time), int)
    for row, count in missing.items():
        times[row - 1] += count
    return of_rows(recording, np.repeat(np.arange(len(times)), times)), missing


def of_rows(recording: Recording, rows: np.ndarray) -> Recording:
    """Some rows of a recording, one interval after the other."""
    found = {n: x[rows] for n in VARIABLES if (x := getattr(recording, n)) is not None}
    time = recording.time[0] + recording.interval * np.arange(len(rows))
    return replace(recording, **found | {"time": time})


def _repeats(channels: Sequence[np.ndarray]) -> list[tuple[int, int]]:
    """The sample before and the last of each run of samples that repeat the one before in all channels."""
    same = [(np.diff(x.reshape(len(x), -1), axis=0) == 0.0).all(axis=1) for x in channels]
    edges = np.flatnonzero(np.diff(np.concatenate([[False], np.all(same, axis=0), [False]])))
    return [(int(before), int(last)) for before, last in edges.reshape(-1, 2)]


def _went_on(command: np.ndarray, before: int, last: int) -> bool | None:
    """Whether time went on from one sample to another by a command, which has no noise; None where it changes with few
    samples around and does not tell."""
    around = last - before + AROUND
    inside = np.diff(command[before : last + 1])
    beside = np.diff(command[max(0, before - around) : before + 1]), np.diff(command[last : last + around + 1])
    if np.mean(np.concatenate(beside) != 0.0) <= 0.5:
        return None
    return bool(inside.any()) or _makes_up(command, before, last)


def _makes_up(x: np.ndarray, before: int, last: int) -> bool:
    """Whether a signal that has repeated samples up to the last makes up for them with the next."""
    after = np.abs(np.diff(x[last + 1 : last + 1 + last - before + AROUND]))
    return bool(len(after) and abs(x[last + 1] - x[last]) > (1.0 + 0.5 * (last - before)) * np.median(after))

"""Rows that a recording lacks or has twice, as a logger's that has dropped or repeated some and counts time by what it
wrote."""

from dataclasses import replace

import numpy as np

from .motion import jumps, without_spikes_of_motion
from .recording import VARIABLES, Recording
from .sensors import MOVING, makes_up, repeats, went_on


def without_rows_twice(recording: Recording) -> tuple[Recording, int]:
    """The recording less rows that repeat the one before in all channels, and how many there are.

    Where time went on, by the command or by the angle of a rotor that turns, the recorder has stood still.
    """
    twice = np.zeros(len(recording.time), bool)
    for before, last in repeats([x for n in VARIABLES if (x := getattr(recording, n)) is not None]):
        on = went_on(recording.commanded_position, before, last)
        if on is None:
            turns = abs(recording.rotor_speed[last]) > MOVING
            on = not turns or makes_up(recording.rotor_angle, before, last)
        twice[before + 1 : last + 1] = not on
    return (of_rows(recording, np.flatnonzero(~twice)), int(twice.sum())) if twice.any() else (recording, 0)


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

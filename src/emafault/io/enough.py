"""Which part of a large bench a diagnosis takes: as if fewer recordings had been made, and shorter ones.

The time of a diagnosis goes with the number of samples, what it tells with the root of it. Recordings are left out
evenly over conditions, and cut to begin shortly before their motion, so that each begins at rest with its winding at
the ambient temperature, as the format has it. One may be longer than the others, for what is slow.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..errors import InputError
from .bench import Bench
from .motion import without_outliers
from .recording import VARIABLES, Recording

SAMPLES = 100_000  # that a diagnosis takes unless told otherwise
LEAST = 1000  # that are worth a diagnosis
SHORTEST = 1.0  # s, of what is left of a recording that is cut
REST = 0.05  # s, that are left before the rotor begins to move
STILL = 0.1  # rad of the rotor, within which it has not begun to
FEWEST = 5  # recordings
OF_ONE = 1.0 / 3.0  # of the samples, that the longest recording may have


def within(bench: Bench, samples: int = SAMPLES) -> Bench:
    """A bench of no more samples than wanted, with a warning that says what of it is left; of more, where a second of
    each of the fewest recordings that tell anything has more.

    Raises
    ------
    InputError : a number of samples that tells nothing
    """
    if samples < LEAST:
        raise InputError(f"samples: got {samples}, accepted is {LEAST} or more")
    recordings = bench.recordings
    lengths = {n: len(r.time) for n, r in recordings.items()}
    if sum(lengths.values()) <= samples:
        return bench
    least = {n: min(lengths[n], round(SHORTEST / r.interval)) for n, r in recordings.items()}
    longest = max(sorted(lengths), key=lambda n: lengths[n])
    one = min(lengths[longest], max(least[longest], int(OF_ONE * samples)))
    order = _by_condition(recordings, [n for n in recordings if n != longest])
    count = len(order)
    while count > FEWEST - 1 and sum(least[n] for n in _evenly(order, count)) > samples - one:
        count -= 1
    names = _evenly(order, count)
    cap = _cap([lengths[n] for n in names], samples - one)
    kept = {n: _cut(recordings[n], max(least[n], min(lengths[n], cap))) for n in names}
    kept[longest] = _cut(recordings[longest], one)
    of_all, taken = sum(lengths.values()), sum(len(r.time) for r in kept.values())
    if taken == of_all:
        return bench
    cut = sum(len(r.time) < lengths[n] for n, r in kept.items())
    message = (
        f"{len(kept)} of {len(recordings)} recordings are taken, {cut} of them in part: {taken} of {of_all} samples, "
        "spread over conditions; --samples takes more"
    )
    warning = {"kind": "samples", "file": None, "variable": None, "message": message}
    return Bench(bench.name, {n: kept[n] for n in recordings if n in kept}, [*bench.warnings, warning])


def spread(recordings: Mapping[str, Recording], names: Sequence[str], count: int) -> list[str]:
    """Names of so many of the recordings, spread over temperatures, health and commands."""
    return sorted(_evenly(_by_condition(recordings, names), count))


def _by_condition(recordings: Mapping[str, Recording], names: Sequence[str]) -> list[str]:
    return sorted(
        names,
        key=lambda n: (
            recordings[n].ambient_temperature, recordings[n].health, str(recordings[n].attributes.get("command")), n,
        ),
    )  # fmt: skip


def _evenly(order: Sequence[str], count: int) -> set[str]:
    """So many of an order, at equal distances."""
    return {order[k] for k in np.linspace(0, len(order) - 1, count).round().astype(int)}


def _cap(lengths: Sequence[int], samples: int) -> int:
    """The most that each of the lengths may have for their sum to be no more than ``samples``."""
    left = samples
    for n, length in enumerate(sorted(lengths)):
        share = left // (len(lengths) - n)
        if length > share:
            return share
        left -= length
    return max(lengths)


def _cut(recording: Recording, count: int) -> Recording:
    """So many samples of a recording, from shortly before the rotor begins to move."""
    size = len(recording.time)
    if count >= size:
        return recording
    angle = without_outliers(recording.rotor_angle)[0]
    moves = int(np.argmax(np.abs(angle - angle[0]) > STILL))
    first = min(max(0, moves - round(REST / recording.interval)), size - count)
    part = slice(first, first + count)
    values = {n: getattr(recording, n) for n in VARIABLES}
    time = recording.time[part] - first * recording.interval
    return replace(recording, time=time, **{n: v[part].copy() for n, v in values.items() if v is not None})

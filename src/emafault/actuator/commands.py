"""Position commands at the user shaft, sampled at the control ticks."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..delays import filtered
from ..errors import InputError, one_line, shown
from ..places import file_at
from .grammar import CONTROLLER

LARGEST_POSITION = 100.0  # rad of a commanded position
CORNER = 20.0  # times the bends beside it, from which a bend of a recorded command is a corner
JUMP = 20.0  # times the rises beside it, from which a rise of a recorded command is a jump
LEAST_JUMP = 5e-4  # rad
WIDEST_JUMP = 3  # intervals; a control tick has at most two samples within it
LEAST_TURN = 1e-7  # rad in an interval by which the command's slope changes at a corner


def parabolic(t, *, acceleration):
    """Constant acceleration (rad/s2) from rest."""
    return 0.5 * acceleration * t * t


def ramp(t, *, speed):
    """Constant speed (rad/s)."""
    return speed * t


def step(t, *, amplitude, time):
    """A step of ``amplitude`` (rad) at ``time`` (s)."""
    return np.where(t >= time, amplitude, 0.0)


def sine(t, *, amplitude, frequency):
    """A sine of ``amplitude`` (rad) and ``frequency`` (Hz)."""
    return amplitude * np.sin(2.0 * np.pi * frequency * t)


def chirp(t, *, amplitude, frequency_start, frequency_end):
    """A sine of ``amplitude`` (rad) whose frequency (Hz) rises linearly over the record."""
    rate = (frequency_end - frequency_start) / max(t[-1], 1e-12)
    return amplitude * np.sin(2.0 * np.pi * (frequency_start * t + 0.5 * rate * t * t))


def reversal(t, *, amplitude, speed):
    """Constant speed (rad/s) to and fro between +amplitude and -amplitude (rad), starting from zero."""
    phase = (speed * t / amplitude + 1.0) % 4.0
    return amplitude * np.where(phase < 2.0, phase - 1.0, 3.0 - phase)


COMMANDS: dict[str, Callable[..., np.ndarray]] = {f.__name__: f for f in (parabolic, ramp, step, sine, chirp, reversal)}


def command_positions(name: str, settings: Mapping, duration: float, control_period: float) -> np.ndarray:
    """Sample a command at the control ticks.

    Parameters
    ----------
    name : one of ``COMMANDS`` or ``file`` (settings: path of a text file with columns time (s) and position (rad))
    settings : the command's own settings (SI)

    Returns
    -------
    (tick+1,) user-shaft angle (rad)

    Raises
    ------
    InputError : an unknown command or setting, or a file that cannot be read
    """
    ticks = control_period * np.arange(round(duration / control_period) + 2)
    if name == "file":
        return read_command(settings["path"], duration, control_period)
    if name not in COMMANDS:
        raise InputError(f"command: got '{name}', accepted are {', '.join(COMMANDS)} and file")
    try:
        return np.asarray(COMMANDS[name](ticks, **settings), float)
    except TypeError as error:
        raise InputError(f"command {name}: {error}") from error


def read_command(path: str | Path, duration: float, control_period: float) -> np.ndarray:
    """Read a command from a CSV or white-space file with two columns, time (s) and position (rad).

    Raises
    ------
    InputError : a missing or unreadable file, or time that does not increase
    """
    what = "command file"
    path = file_at(path, what)
    try:
        text = path.read_text(encoding="utf-8").replace(",", " ").splitlines()
        rows = [line for line in text if line.strip() and not line.lstrip().startswith("#")]
        if rows and not rows[0].split()[0].replace(".", "").replace("-", "").replace("e", "").isdigit():
            rows = rows[1:]
        table = np.array([[float(cell) for cell in row.split()] for row in rows])
    except (ValueError, OSError) as error:
        raise InputError(f"{what} {shown(path)}: not a table of numbers ({one_line(error)})") from error
    if table.ndim != 2 or table.shape[1] != 2 or len(table) < 2 or not np.all(np.diff(table[:, 0]) > 0):
        raise InputError(f"{what} {shown(path)}: two columns, increasing time (s) and position (rad), are accepted")
    if not np.all(np.abs(table[:, 1]) <= LARGEST_POSITION):
        raise InputError(f"{what} {shown(path)}: positions up to {LARGEST_POSITION:g} rad are accepted")
    return resample(table[:, 0], table[:, 1], duration, control_period)


def seen_by_controller(
    command: np.ndarray, entries: Sequence[Mapping[str, Any]], control_period: float, position_gain: float
) -> np.ndarray:
    """A command (..., tick) as a controller compares it with the position, by entries of ``unlisted``: through its
    filter, and ahead by what it feeds forward of the command's speed, over the position gain (1/s)."""
    out = command
    for entry in (e for e in entries if e["place"] in CONTROLLER):
        if entry["form"] == "command_filter":
            out = np.apply_along_axis(filtered, -1, out, entry["time_constant"] / control_period)
        else:
            out = out + entry["gain"] / position_gain * np.gradient(command, control_period, axis=-1)
    return out


def resample(time: np.ndarray, position: np.ndarray, duration: float, control_period: float) -> np.ndarray:
    """Interpolate positions (rad) at times (s) linearly to the control ticks; before the first, from zero at t = 0."""
    ticks = control_period * np.arange(round(duration / control_period) + 2)
    if time[0] > 0.0:
        first = position[0] - (position[1] - position[0]) / (time[1] - time[0]) * time[0]
        time, position = np.concatenate([[0.0], time]), np.concatenate([[first], position])
    return np.interp(ticks, time, position)


def jumps_of(position: np.ndarray) -> np.ndarray:
    """(jump, 2) last sample before and first after each step of a recorded command (sample,), rad.

    A step that takes a control tick may be recorded on its way, over several samples where these are closer.
    """
    rises = np.diff(position, prepend=position[:1], append=position[-1:])  # rises[n] leads to sample n
    found: list[tuple[int, int]] = []
    for width in range(1, WIDEST_JUMP + 1):
        before = np.arange(len(position) - width)
        total = np.abs(position[before + width] - position[before])
        quiet = np.maximum(np.abs(rises[before]), np.abs(rises[before + width + 1]))
        jumps = np.flatnonzero((total > JUMP * quiet) & (total > LEAST_JUMP))
        known = {n for start, end in found for n in range(start, end + 1)}
        found += [(int(n), int(n) + width) for n in jumps if known.isdisjoint(range(n, n + width + 1))]
    return np.array(sorted(found), dtype=int).reshape(-1, 2)


def with_corners(time: np.ndarray, position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A recorded command with the corners between its samples put in, where two straight lines meet.

    Where a ramp turns round within a recording interval the chord between the samples misses the turn, and the actuator
    on the chord lags behind the recorded one as if its control were slow. (sample,) time (s) and position (rad).
    """
    if len(time) < 6:
        return time, position
    slope = np.diff(position)
    bend = np.diff(slope)  # bend[k] at sample k + 1
    # between samples n and n + 1: both ends bend, their neighbours hardly
    n = np.arange(2, len(position) - 3)
    left, middle, right = slope[n - 1], slope[n], slope[n + 1]
    turn = right - left
    quiet = np.maximum(np.abs(bend[n - 2]), np.abs(bend[n + 1]))
    share = np.divide(middle - right, left - right, out=np.zeros(len(n)), where=turn != 0.0)
    found = (np.abs(turn) > CORNER * quiet) & (np.abs(turn) > LEAST_TURN) & (share > 0.01) & (share < 0.99)
    at, share = n[found], share[found]
    step = time[1] - time[0]
    times = np.concatenate([time, time[at] + share * step])
    positions = np.concatenate([position, position[at] + share * slope[at - 1]])
    order = np.argsort(times, kind="stable")
    return times[order], positions[order]

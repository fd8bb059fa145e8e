"""Simulation of batches of runs: noise-free recorded signals from run records and a command."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from ..compiled import attributed
from ..errors import InputError
from .conduction import LANES
from .grammar import MOST_TERMS
from .kernel import run_batch
from .state import RUN_STATE, has_extras
from .unlisted import no_terms

PHASE_SIGNALS = ("phase_voltage", "phase_current", "phase_current_end")
SIGNALS = (*PHASE_SIGNALS, "rotor_speed", "rotor_angle", "output_position", "bus_voltage")


def time_axis(duration: float, interval: float) -> np.ndarray:
    """(time,) ends of the recording intervals (s)."""
    return interval * np.arange(1, round(duration / interval) + 1)


def commanded_position(command: np.ndarray, control_period: float, time: np.ndarray) -> np.ndarray:
    """Command at the recording instants (rad): linear between ticks; (run, tick+1) -> (run, time)."""
    where = np.minimum(time / control_period, command.shape[-1] - 1.000001)
    low = where.astype(int)
    part = where - low
    return command[..., low] * (1.0 - part) + command[..., low + 1] * part


def simulate(
    runs: np.ndarray,
    command: np.ndarray,
    duration: float,
    interval: float,
    threads: int = 1,
    terms: np.ndarray | None = None,
    table: np.ndarray | None = None,
) -> dict[str, np.ndarray]:
    """Simulate runs of equal length and return their recorded signals without noise.

    Parameters
    ----------
    runs : (run,) records of ``RUN_DTYPE``
    command : (tick+1,) or (run, tick+1) commanded user-shaft angle at the control ticks (rad)
    duration, interval : length of the record and of one recording interval (s)
    threads : runs are shared out over so many threads; the result does not depend on it
    terms : (term, number) or (run, term, number) causes that no catalogue lists, rows of ``unlisted.term``
    table : (entry,) what a term of shape ``table`` follows, an entry every ``unlisted.TABLE_STEP``

    Returns
    -------
    phase_voltage (V), phase_current (A), phase_current_end (A): (run, time, phase); rotor_speed (rad/s),
    rotor_angle (rad), output_position (rad), commanded_position (rad), bus_voltage (V): (run, time)

    Raises
    ------
    InputError : an interval or duration that is not positive, or more terms than ``grammar.MOST_TERMS``
    """
    if not (interval > 0.0 and duration >= interval):
        raise InputError(
            f"interval {interval} s and duration {duration} s: both must be positive, the interval shorter"
        )
    time = time_axis(duration, interval)
    command = np.ascontiguousarray(np.atleast_2d(command), dtype=float)
    n = len(runs)
    out = _run(runs, command, np.full(n, float(interval)), np.full(n, len(time)), threads, terms, table)
    position = commanded_position(command, float(runs["control_period"][0]), time)
    out["commanded_position"] = np.broadcast_to(position, (n, len(time))).copy() if len(command) == 1 else position
    return out


def simulate_each(
    runs: np.ndarray, commands: Sequence[np.ndarray], interval: Sequence[float], records: Sequence[int]
) -> list[dict[str, np.ndarray]]:
    """Simulate runs that differ in command (each (tick+1,), rad), interval (s) and number of records.

    Returns
    -------
    for every run the signals of ``simulate`` but the command, without the axis of the runs
    """
    command = np.empty((len(runs), max(map(len, commands))))
    for row, given in zip(command, commands, strict=True):
        row[: len(given)], row[len(given) :] = given, given[-1]
    out = _run(runs, command, np.asarray(interval, float), np.asarray(records, int))
    return [{name: values[r, :n] for name, values in out.items()} for r, n in enumerate(records)]


def ways(runs: np.ndarray) -> np.ndarray:
    """(run,) the way each takes: 0 in the lanes, 1 in them with extras, 2 segment by segment.

    Those of one way go best together: extras hold up the lanes beside them.
    """
    extras = np.array([has_extras(run) for run in attributed(runs)], int)
    return np.where(runs["compliance_K"] > 0.0, 2, extras)


def _run(
    runs: np.ndarray,
    command: np.ndarray,
    interval: np.ndarray,
    records: np.ndarray,
    threads: int = 1,
    terms: np.ndarray | None = None,
    table: np.ndarray | None = None,
) -> dict[str, np.ndarray]:
    """Recorded signals of ``run_batch``, as long as those of the longest run."""
    rows_of_terms = no_terms() if terms is None else np.ascontiguousarray(terms, float)
    if rows_of_terms.ndim == 2:
        rows_of_terms = rows_of_terms[None]
    if rows_of_terms.shape[1] > MOST_TERMS:
        raise InputError(f"terms: got {rows_of_terms.shape[1]}, accepted are {MOST_TERMS} at most")
    wander = np.zeros(2) if table is None else np.ascontiguousarray(table, float)
    shape = len(runs), int(records.max())
    shapes = [(*shape, 3)] * len(PHASE_SIGNALS) + [shape] * (len(SIGNALS) - len(PHASE_SIGNALS))
    ends = np.cumsum([np.prod(s) for s in shapes])
    # in one piece, which the next call gets again; many large ones go back to the system, and new pages cost as much
    # as the simulation
    pieces = np.split(np.empty(ends[-1]), ends[:-1])
    out = {name: piece.reshape(s) for name, piece, s in zip(SIGNALS, pieces, shapes, strict=True)}
    given = attributed(runs)
    # lanes left empty would cost more than those held up
    way = ways(runs) if len(runs) > LANES else np.zeros(len(runs), int)
    parts = []
    for alike in (np.flatnonzero(way == w) for w in range(3)):
        shares = min(4 * threads, -(-len(alike) // LANES)) if threads > 1 else 1
        parts += [rows for rows in np.array_split(alike, max(1, shares)) if len(rows)]

    def part(rows: np.ndarray) -> None:
        state = attributed(np.zeros(LANES if len(rows) > 1 else 1, RUN_STATE))  # one alone goes faster by itself
        unlisted = rows_of_terms, wander
        run_batch(state, given, rows, command, interval, records, *unlisted, *(out[name] for name in SIGNALS))

    if threads <= 1 or len(parts) < 2:
        for rows in parts:
            part(rows)
    else:
        with ThreadPoolExecutor(threads) as pool:
            list(pool.map(part, parts))
    return out

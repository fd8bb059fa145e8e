"""Causes that no catalogue lists, as terms of both simulations: what acts, where, and along what.

A term is a row of numbers, made by ``term``; what wanders at random comes as a table over time. The fixed-step
simulation evaluates every term in the middle of each step. The event-driven one holds it over a piece of time, at the
value that it has in the piece's middle (``longest_hold``), so that a run without terms pays nothing.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..compiled import compiled
from .grammar import COORDINATES, KNOTS, MACHINE, SOURCES, of_recording

PLACES = tuple(MACHINE)
AT_TORQUE, AT_EMF, AT_RESISTANCE, AT_DRAG, AT_TORQUE_CONSTANT, AT_INERTIA, OF_ALL_EMF, OF_ALL_RESISTANCE = (
    0, 1, 4, 7, 8, 9, 10, 11,
)  # fmt: skip
BY_SPEED, BY_SPEED_SQUARED = 12, 13
CURRENT, DECAY = list(COORDINATES).index("current"), float(SOURCES.index("decay"))
#: form -> names of its parameters, in the order of the row. SI; w is the rotor's speed and theta its angle, unwrapped.
SHAPES = {
    "order": ("amplitude", "order", "phase"),  # amplitude cos(order theta + phase)
    "frequency": ("amplitude", "frequency", "phase"),  # amplitude cos(2 pi frequency t + phase)
    "step_change": ("jump", "time"),
    "pulse": ("jump", "time", "until"),
    "power": ("at_100_rad_s", "exponent"),  # at_100_rad_s (|w| / 100)^exponent
    "bump": ("depth", "centre", "width"),  # Gaussian about an angle of the turn; width is its standard deviation
    # gain times its source filtered, or what that lacks of one; a place in SOURCES
    "memory": ("gain", "time_constant", "source"),
    "sweep": ("amplitude", "frequency", "rate", "phase"),  # a frequency that glides
    "burst": ("amplitude", "time", "decay", "frequency"),  # rings from a time on
    "travel": ("amplitude", "length"),  # against the motion, built up anew over a length after each reversal (Dahl)
    "table": ("amplitude",),  # amplitude times the table, linear between its entries
    # cubic spline (not-a-knot) through values at the knots, constant beyond them; a place in COORDINATES
    "function": ("coordinate", "from", "to", *(f"at_{n + 1}" for n in range(KNOTS))),
}
TABLE_STEP = 1e-3  # s between entries of the table
CUBIC = 4 * (KNOTS - 1)  # coefficients of a spline
_WIDTH = 2 + 3 + CUBIC
ORDER, FREQUENCY, STEP, PULSE, POWER, BUMP, MEMORY, SWEEP, BURST, TRAVEL, WANDER, FUNCTION = range(len(SHAPES))
TWO_PI = 2.0 * np.pi
HOLD = 5.0e-5  # s, that a term is held at most
HELD_OVER = 0.2  # rad of a wave, or of a bump's width, that it is held over
SHORTEST_HOLD = 2.0e-6  # s
RIPPLE_HOLD = 5.0e-6  # s, of what follows the current, which takes about 30 us from one switching to the next


def term(place: str, shape: str, **parameters: float) -> np.ndarray:
    """(number,) row of one term; a place of ``PLACES`` and a shape of ``SHAPES`` with all of its parameters."""
    row = np.zeros(_WIDTH)
    row[0], row[1] = PLACES.index(place), list(SHAPES).index(shape)
    numbers = [parameters[name] for name in SHAPES[shape]]
    if shape == "function":
        from scipy.interpolate import CubicSpline

        low, high = numbers[1], numbers[2]
        spline = CubicSpline(np.linspace(low, high, KNOTS), numbers[3:], bc_type="not-a-knot")
        numbers[3:] = spline.c.T.ravel()
    row[2 : 2 + len(numbers)] = numbers
    return row


def row_of(entry: Mapping[str, Any], place: str = "") -> np.ndarray:
    """(number,) row of an entry of a configuration, its own place in the machine or another; a phase left out is 0."""
    numbers = {n: v for n, v in entry.items() if n not in ("place", "form", "along", "values", "source")}
    if entry["form"] == "function":
        numbers["coordinate"] = list(COORDINATES).index(entry["along"])
        numbers |= {f"at_{n + 1}": v for n, v in enumerate(entry["values"])}
    if entry["form"] == "memory":
        numbers["source"] = SOURCES.index(entry["source"])
    return term(place or entry["place"], entry["form"], **{"phase": 0.0} | numbers)


def in_machine(
    entries: Sequence[Mapping[str, Any]], runs: int, seed: int = 0, first_run: int = 0, recording: str = ""
) -> np.ndarray:
    """Terms of the entries that act in the machine.

    Parameters
    ----------
    entries : as a configuration has them, checked
    runs, seed, first_run : a phase left out is drawn for each run by its number
    recording : name of the recording that is replayed, if any

    Returns
    -------
    (run, term, number) rows of ``term``
    """
    mine = [of_recording(e, recording) for e in entries if e["place"] in MACHINE]
    rows = np.array([row_of(e) for e in mine]).reshape(len(mine), _WIDTH)
    out = np.repeat(rows[None], runs, axis=0)
    for m, entry in enumerate(mine):
        if entry["form"] == "frequency" and "phase" not in entry:
            out[:, m, 4] = [drawn_phase(seed, first_run + r, m) for r in range(runs)]
    return out


def drawn_phase(seed: int, run: int, number: int) -> float:
    """Phase (rad) of a wave in time in one run."""
    return float(np.random.default_rng([seed, 5, run, number]).uniform(0.0, TWO_PI))


def no_terms() -> np.ndarray:
    """(0, number) terms: nothing acts that is not listed."""
    return np.zeros((0, _WIDTH))


@compiled
def acting(row, t, theta, w, current, turned, temperature, memory, table):
    """Value of a term.

    Parameters
    ----------
    row : (number,) of ``term``
    t, theta, w : time (s), angle (rad) and speed (rad/s) of the rotor
    current, turned, temperature : what else a ``function`` may go along (A, rad, degC)
    memory : the term's state
    table : (entry,) what a table follows
    """
    shape, a, b, c, d = int(row[1]), row[2], row[3], row[4], row[5]
    if shape == ORDER:
        return a * np.cos(b * theta + c)
    if shape == FREQUENCY:
        return a * np.cos(TWO_PI * b * t + c)
    if shape == STEP:
        return a if t >= b else 0.0
    if shape == PULSE:
        return a if b <= t < c else 0.0
    if shape == POWER:
        return a * (abs(w) / 100.0) ** b
    if shape == BUMP:
        away = theta - b - TWO_PI * np.floor((theta - b) / TWO_PI + 0.5)
        return a * np.exp(-0.5 * (away / c) ** 2)
    if shape == MEMORY:
        return a * (1.0 - memory if c == DECAY else memory)
    if shape == SWEEP:
        return a * np.cos(TWO_PI * t * (b + 0.5 * c * t) + d)
    if shape == BURST:
        return a * np.exp(-(t - b) / c) * np.sin(TWO_PI * d * (t - b)) if t >= b else 0.0
    if shape == TRAVEL:
        return -a * memory
    if shape == FUNCTION:
        x = (w, current, turned, t, temperature)[int(a)]
        step = (c - b) / (KNOTS - 1)
        x = min(max(x, b), c)
        n = min(int((x - b) / step), KNOTS - 2)
        x -= b + n * step
        at = 5 + 4 * n
        return row[at + 3] + x * (row[at + 2] + x * (row[at + 1] + x * row[at]))
    where = min(t / TABLE_STEP, len(table) - 1.001)
    low = int(where)
    return a * (table[low] + (where - low) * (table[low + 1] - table[low]))


@compiled
def remembered(row, w, current, memory, dt):
    """State of a term after dt (s) at speed w (rad/s) and with a current (A)."""
    shape = int(row[1])
    if shape == MEMORY:
        source = 1.0  # from the start
        if row[4] < 2.0:
            source = abs(w) / 100.0 if row[4] == 1.0 else 0.25 * current * current
        return memory + (source - memory) * (1.0 - np.exp(-dt / row[3]))
    if shape == TRAVEL:
        return memory + w * dt * (1.0 - memory * np.sign(w)) / row[3]
    return memory


@compiled
def add_up(terms, t, theta, w, current, turned, temperature, memory, table, added):
    """Fill ``added`` (place,) with what all terms (term, number) do.

    In the torque are drag and what goes with the speed as well, in each phase what all have; arguments as of
    ``acting``.
    """
    added[:] = 0.0
    for m in range(len(terms)):
        place = int(terms[m, 0])
        added[place] += acting(terms[m], t, theta, w, current, turned, temperature, memory[m], table)
    added[AT_TORQUE] += (added[BY_SPEED] + added[BY_SPEED_SQUARED] * w / 100.0) * w / 100.0
    added[AT_TORQUE] -= np.sign(w) * added[AT_DRAG]
    for j in range(3):
        added[AT_EMF + j] += added[OF_ALL_EMF]
        added[AT_RESISTANCE + j] += added[OF_ALL_RESISTANCE]


@compiled
def longest_hold(terms, t, w):
    """Time (s) over which the terms (term, number) may be held from t (s) on at speed w (rad/s)."""
    hold = HOLD
    for m in range(len(terms)):
        shape, b, c, d = int(terms[m, 1]), terms[m, 3], terms[m, 4], terms[m, 5]
        rate = 0.0
        if shape == ORDER:
            rate = abs(b * w)
        elif shape == FREQUENCY:
            rate = TWO_PI * abs(b)
        elif shape == BUMP:
            rate = abs(w) / c
        elif shape == SWEEP:
            rate = TWO_PI * abs(b + c * t)
        elif shape == BURST:
            rate = TWO_PI * abs(d)
        if terms[m, 0] == AT_TORQUE_CONSTANT or (shape == FUNCTION and terms[m, 2] == CURRENT):
            hold = min(hold, RIPPLE_HOLD)
        if rate * hold > HELD_OVER:
            hold = max(HELD_OVER / rate, SHORTEST_HOLD)
        if (shape == STEP or shape == PULSE or shape == BURST) and t < b < t + hold:
            hold = b - t
        if shape == PULSE and t < c < t + hold:
            hold = c - t
    return hold


@compiled
def followed(row, t, theta, w, current, turned, temperature):
    """(time,) values of a term, whose state begins at zero, along (time,) arrays of what ``acting`` takes."""
    out, memory, nothing = np.empty(len(t)), 0.0, np.zeros(2)
    for n in range(len(t)):
        if n > 0:
            memory = remembered(row, w[n], current[n], memory, t[n] - t[n - 1])
        out[n] = acting(row, t[n], theta[n], w[n], current[n], turned[n], temperature, memory, nothing)
    return out

"""Causes that no catalogue lists, as terms of the fixed-step simulation: what acts, where, and along what.

The event-driven run knows nothing of them, so that a nominal run pays nothing. A term is a row of numbers, made by
``term``; what wanders at random comes as a table over time.
"""

import numpy as np

from ..compiled import compiled

#: where a term acts: added to the driving torque (N m), to a phase's back-EMF as a share of it, to its resistance (ohm)
PLACES = ("torque", "emf_a", "emf_b", "emf_c", "resistance_a", "resistance_b", "resistance_c")
#: form -> names of its parameters, in the order of the row. SI; w is the rotor's speed and theta its angle, unwrapped.
SHAPES = {
    "order": ("amplitude", "order", "phase"),  # amplitude cos(order theta + phase)
    "frequency": ("amplitude", "frequency", "phase"),  # amplitude cos(2 pi frequency t + phase)
    "step_change": ("jump", "time"),
    "speed": ("amplitude", "exponent"),  # against the motion, amplitude (|w| / 100)^exponent
    "bump": ("depth", "centre", "width"),  # Gaussian about an angle of the turn; width is its standard deviation
    "memory": ("gain", "time_constant"),  # against the motion, gain times |w| / 100 filtered
    "sweep": ("amplitude", "frequency", "rate", "phase"),  # a frequency that glides
    "burst": ("amplitude", "time", "decay", "frequency"),  # rings from a time on
    "travel": ("amplitude", "length"),  # against the motion, built up anew over a length after each reversal (Dahl)
    "table": ("amplitude",),  # amplitude times the table, linear between its entries
}
TABLE_STEP = 1e-3  # s between entries of the table
_WIDTH = 2 + max(len(names) for names in SHAPES.values())
ORDER, FREQUENCY, STEP, SPEED, BUMP, MEMORY, SWEEP, BURST, TRAVEL, WANDER = range(len(SHAPES))
TWO_PI = 2.0 * np.pi


def term(place: str, shape: str, **parameters: float) -> np.ndarray:
    """(number,) row of one term; a place of ``PLACES`` and a shape of ``SHAPES`` with all of its parameters."""
    row = np.zeros(_WIDTH)
    row[0], row[1] = PLACES.index(place), list(SHAPES).index(shape)
    for n, name in enumerate(SHAPES[shape]):
        row[2 + n] = parameters[name]
    return row


def no_terms() -> np.ndarray:
    """(0, number) terms: nothing acts that is not listed."""
    return np.zeros((0, _WIDTH))


@compiled
def acting(row, t, theta, w, memory, table):
    """Value of a term at time t (s), angle (rad) and speed (rad/s) of the rotor; ``memory`` is its state."""
    shape, a, b, c, d = int(row[1]), row[2], row[3], row[4], row[5]
    if shape == ORDER:
        return a * np.cos(b * theta + c)
    if shape == FREQUENCY:
        return a * np.cos(TWO_PI * b * t + c)
    if shape == STEP:
        return a if t >= b else 0.0
    if shape == SPEED:
        return -a * np.sign(w) * (abs(w) / 100.0) ** b
    if shape == BUMP:
        away = theta - b - TWO_PI * np.floor((theta - b) / TWO_PI + 0.5)
        return a * np.exp(-0.5 * (away / c) ** 2)
    if shape == MEMORY:
        return -a * memory * np.sign(w)
    if shape == SWEEP:
        return a * np.cos(TWO_PI * t * (b + 0.5 * c * t) + d)
    if shape == BURST:
        return a * np.exp(-(t - b) / c) * np.sin(TWO_PI * d * (t - b)) if t >= b else 0.0
    if shape == TRAVEL:
        return -a * memory
    where = min(t / TABLE_STEP, len(table) - 1.001)
    low = int(where)
    return a * (table[low] + (where - low) * (table[low + 1] - table[low]))


@compiled
def remembered(row, w, memory, dt):
    """State of a term after dt (s) at speed w (rad/s)."""
    shape = int(row[1])
    if shape == MEMORY:
        return memory + (abs(w) / 100.0 - memory) * (1.0 - np.exp(-dt / row[3]))
    if shape == TRAVEL:
        return memory + w * dt * (1.0 - memory * np.sign(w)) / row[3]
    return memory

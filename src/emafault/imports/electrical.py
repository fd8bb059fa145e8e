"""Phase order, signs, direction and pole pairs at once: the voltage equation under every order of the channels.

In space vectors x = (2/3) sum_j x_j exp(i 2 pi j/3), in which the star point drops out,

    v = R i + L di/dt + K d/dt [exp(i s n theta)] / (i s n)

holds for the right order and signs of the voltages, direction s and pole pairs n, with R and L not negative and K
complex: its argument is where the rotor's zero lies. Over a window all terms are differences of integrals and of values
at its ends, without derivative.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations, product

import numpy as np

from .voltages import swept

MOST_POLE_PAIRS = 12  # that are tried
WINDOW = 1e-3  # s, or the longest at which the fastest electrical turn still has eight of them
ORDERS = list(permutations(range(3)))
SIGNS = [np.array(s) for s in product((1, -1), repeat=3)]
_AXES = np.exp(2j * np.pi / 3.0 * np.arange(3))


@dataclass(frozen=True)
class Windows:
    """Means over the windows (window,) of one recording, and values at their edges."""

    edges: np.ndarray  # (window+1,) s
    voltage: np.ndarray  # (window, 3) mean, in the channels' order; of line voltages their star equivalent's channels
    current: np.ndarray  # (window, 3) mean
    current_edge: np.ndarray  # (window+1, 3)
    angle_edge: np.ndarray  # (window+1,) mechanical rad


@dataclass(frozen=True)
class Reading:
    """One reading: the phase of each voltage channel, its sign, direction of the phases and pole pairs."""

    pole_pairs: float
    direction: int
    order: tuple[int, ...]
    signs: tuple[int, ...]


def space_vector(phases: np.ndarray) -> np.ndarray:
    """(..., 3) -> (...) complex."""
    return phases @ _AXES * (2.0 / 3.0)


def misfits(recordings: Sequence[Windows], star, pole_pairs: Sequence[float]) -> dict[Reading, float]:
    """Mean square misfit (V^2) of every reading, all recordings together, each with its own R, L and zero of the angle.

    Parameters
    ----------
    star : (window, 3) channels, in order and with their signs -> (window, 3) phase voltages but for a common part
    """
    total: dict[Reading, float] = {}
    count = sum(len(w.voltage) for w in recordings)
    for w in recordings:
        tried = [(o, s) for o in ORDERS for s in SIGNS]
        v = np.stack([space_vector(star(_read(w.voltage, o, s))) for o, s in tried], axis=1)
        rhs = np.concatenate([v.real, v.imag])
        for n, d in product(pole_pairs, (1, -1)):
            columns = regressors(w, n, d)
            whole, _ = _not_negative(columns, rhs)
            for (o, s), found in zip(tried, whole):
                key = Reading(n, d, o, tuple(int(x) for x in s))
                total[key] = total.get(key, 0.0) + float(found) / count
    return total


def sharp_misfits(recordings: Sequence[Windows], star, pole_pairs: int) -> dict[Reading, float]:
    """The same for one number of pole pairs, with the trapezoid as the back-EMF's shape where it fits better.

    Each reading has the zero that its sine has: K = -i k exp(i zero) times the trapezoid's fundamental.
    """
    total: dict[Reading, float] = {}
    count = sum(len(w.voltage) for w in recordings)
    for w, d in product(recordings, (1, -1)):
        h = np.diff(w.edges)
        columns = regressors(w, pole_pairs, d)
        for o, s in product(ORDERS, SIGNS):
            v = space_vector(star(_read(w.voltage, o, s)))
            rhs = np.concatenate([v.real, v.imag])[:, None]
            sine, solution = _not_negative(columns, rhs)
            zero = float(np.angle(solution[-2, 0] + 1j * solution[-1, 0])) + 0.5 * np.pi
            turned = space_vector(swept(d * pole_pairs * w.angle_edge + zero)) / pole_pairs / h
            shape = np.concatenate([turned.real, turned.imag])[:, None]
            trapezoid, _ = _not_negative(np.concatenate([columns[:, :2], shape], axis=1), rhs)
            key = Reading(pole_pairs, d, o, tuple(int(x) for x in s))
            total[key] = total.get(key, 0.0) + float(min(sine[0], trapezoid[0])) / count
    return total


def _not_negative(columns: np.ndarray, rhs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sums of squared residuals (rhs,) and solutions with R and L not negative: at best the current tells nothing."""
    whole, solution = _squares(columns, rhs)
    backward = (solution[0] < 0.0) | (solution[1] < 0.0)
    if backward.any():
        whole[backward], solution[2:, backward] = _squares(columns[:, 2:], rhs[:, backward])
    return whole, solution


def unexplained(w: Windows, star, pole_pairs: int, time_constant: float, explaining: slice) -> float:
    """What is left of the voltages with some of the regressors, over what is left without; of the best reading of all.

    Parameters
    ----------
    time_constant : L/R (s), which is not fitted here: it looks like a lag of the currents
    explaining : regressors that are tried, of R, Re K and Im K
    """
    # one sign of all is the other's
    v = space_vector(np.stack([star(_read(w.voltage, o, s)) for o in ORDERS for s in SIGNS[:4]], axis=1))
    rhs = np.concatenate([v.real, v.imag])
    left = np.inf
    for direction in (1, -1):
        both = regressors(w, pole_pairs, direction)
        columns = np.column_stack([both[:, 0] + time_constant * both[:, 1], both[:, 2:]])
        others = np.delete(columns, explaining, axis=1)
        left = min(left, float(np.min(_left(columns, rhs) / np.maximum(_left(others, rhs), 1e-30))))
    return left


def _left(columns: np.ndarray, rhs: np.ndarray) -> np.ndarray:
    """Sums of squared residuals (rhs,) by the normal equations: fast, and exact enough for ratios."""
    seen = (rhs**2).sum(axis=0)
    if not columns.shape[1]:
        return seen
    size = np.sqrt((columns**2).sum(axis=0)) + 1e-30
    projected = (columns / size).T @ rhs
    gram = (columns / size).T @ (columns / size) + 1e-12 * np.eye(len(size))
    return seen - (projected * np.linalg.solve(gram, projected)).sum(axis=0)


def _read(channels: np.ndarray, order: Sequence[int], signs: np.ndarray) -> np.ndarray:
    """Phases a, b, c from channels that are of the phases ``order``."""
    out = np.empty_like(channels)
    out[:, list(order)] = channels * signs
    return out


def regressors(w: Windows, pole_pairs: float, direction: int) -> np.ndarray:
    """(2 window, 4) columns of R, L, Re K and Im K; real parts above imaginary ones."""
    h = np.diff(w.edges)
    turn = np.exp(1j * direction * pole_pairs * w.angle_edge)
    emf = np.diff(turn) / h / (1j * direction * pole_pairs)
    columns = [space_vector(w.current), np.diff(space_vector(w.current_edge)) / h, emf, 1j * emf]
    return np.stack([np.concatenate([c.real, c.imag]) for c in columns], axis=1)


def _squares(columns: np.ndarray, rhs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sums of squared residuals (rhs,) and solutions."""
    solution = np.linalg.lstsq(columns, rhs, rcond=None)[0]
    return ((rhs - columns @ solution) ** 2).sum(axis=0), solution


def best(total: dict[Reading, float]) -> Reading:
    """The reading that fits best; of equals, that which changes least."""
    floor = min(total.values())
    return min(total, key=lambda r: (total[r] > floor * (1.0 + 1e-9), _changes(r), total[r]))


def _changes(r: Reading) -> int:
    return sum(k != m for k, m in enumerate(r.order)) + sum(s < 0 for s in r.signs) + (r.direction < 0)


def runner_up(total: dict[Reading, float], chosen: Reading, differs) -> tuple[Reading | None, float]:
    """The best of the readings that ``differs`` from the chosen one, None where there is none, and its margin."""
    rivals = {r: x for r, x in total.items() if differs(r, chosen)}
    if not rivals:
        return None, np.inf
    other = min(rivals, key=lambda r: rivals[r])
    return other, rivals[other] / max(total[chosen], 1e-12)

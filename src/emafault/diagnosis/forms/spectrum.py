"""Lines in a spectrum: how far a power stands above what is around it."""

from collections.abc import Callable, Sequence

import numpy as np


def above(power: np.ndarray, width: int) -> np.ndarray:
    """(bin,) power over the mean level of ``width`` bins around: of noise, distributed as Exp(1)."""
    count = max(1, len(power) // width)
    parts = np.array_split(power, count)
    middle = np.cumsum([0, *(len(p) for p in parts[:-1])]) + [0.5 * len(p) for p in parts]
    level = np.interp(np.arange(len(power)), middle, _medians(parts)) / np.log(2.0)
    return power / np.maximum(level, 1e-300)


def _medians(parts: list[np.ndarray]) -> np.ndarray:
    """Median of each part; the first ones are longer by one, if any are."""
    longer = sum(len(p) > len(parts[-1]) for p in parts)
    same = [some for some in (parts[:longer], parts[longer:]) if some]
    return np.concatenate([np.median(np.array(some), axis=1) for some in same])


def refined(at: float, half: float, likelihood: Callable[[Sequence[float]], list[float]]) -> tuple[float, float]:
    """Where a log likelihood, of several values at once, is largest near ``at``, and its standard deviation there."""
    best, deviation = at, half
    for _ in range(3):
        grid = best + half * np.linspace(-1.0, 1.0, 5)
        values = np.array(likelihood(grid.tolist()), float)
        k = int(np.clip(np.argmax(values), 1, len(grid) - 2))
        curvature = (values[k - 1] - 2.0 * values[k] + values[k + 1]) / (grid[1] - grid[0]) ** 2
        best, half = float(grid[k]), half / 2.0
        if curvature < 0.0:  # the parabola's top
            slope = (values[k + 1] - values[k - 1]) / (2.0 * (grid[1] - grid[0]))
            best += float(np.clip(-slope / curvature, -half, half))
            deviation = float(1.0 / np.sqrt(-curvature))
    return best, deviation

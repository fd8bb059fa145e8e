"""The minimum of a convex quadratic within bounds."""

import numpy as np

from .evidence import Definite

TURNS = 10  # times the number of variables, after which what has been reached is taken
LEVEL = 1e-6  # slope over the root of a variable's own curvature, up to which there is nothing to be gained


def minimum_within(A: np.ndarray, right: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """(variable,) x that minimises x'Ax/2 - right'x with low <= x <= high, ``A`` positive definite.

    The primal active-set method (Nocedal and Wright 2006, Numerical Optimization, section 16.5): from zero, or the
    nearest point within the bounds, along what never increases; what is held at a bound is let go again where the
    minimum lies inside.
    """
    free = Definite(A).solve(right)
    if np.all((low <= free) & (free <= high)):
        return free
    x = np.clip(np.zeros(len(right)), low, high)
    side = np.zeros(len(right), int)  # of the bound that holds a variable, 0: none
    for _ in range(TURNS * len(right)):
        k = np.flatnonzero(side == 0)
        held = np.flatnonzero(side)
        along = Definite(A[np.ix_(k, k)]).solve(right[k] - A[np.ix_(k, held)] @ x[held]) - x[k] if len(k) else x[k]
        room = np.where(along > 0.0, high[k] - x[k], low[k] - x[k])
        with np.errstate(all="ignore"):
            share = np.where(along != 0.0, room / along, np.inf)
        first = int(np.argmin(share)) if len(k) else 0
        if len(k) and share[first] < 1.0:
            x[k] += max(share[first], 0.0) * along
            at = k[first]
            side[at] = 1 if along[first] > 0.0 else -1
            x[at] = high[at] if side[at] > 0 else low[at]
            continue
        x[k] += along
        inward = side * (A @ x - right) / np.sqrt(np.diag(A))  # positive: the minimum lies inside
        worst = int(np.argmax(inward))
        if inward[worst] <= LEVEL:
            break
        side[worst] = 0
    return x

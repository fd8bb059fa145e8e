"""Prior of sets: by how many listed effects, described forms and remainders they hold."""

from collections.abc import Iterable, Sequence
from functools import cache
from math import inf, lgamma, log

import numpy as np

from .model import LISTED, WORDS, Unit
from .sets import OTHER_FORM

SIZE_PRIOR = (0.40, 0.35, 0.15, 0.10)  # of no, one, two, three listed effects
ONE_MORE_FORM = 0.3  # of a bench with any number of described forms, to have one more
REMAINDER_PRIOR = 0.05  # of each equation to have one
REMAINDER_ODDS = float(np.log(REMAINDER_PRIOR / (1.0 - REMAINDER_PRIOR)))  # the same as log odds
OTHER_FORM_PRIOR = 0.2  # of an effect, to take one


class SetPrior:
    """Prior of the sets of some units.

    Parameters
    ----------
    units : everything that a set may hold
    variants : (unit, variant) that it may be held as
    sizes : probability of no, one, two, ... listed effects
    """

    def __init__(self, units: Sequence[Unit], variants: Iterable[tuple[str, int]], sizes: Sequence[float]):
        self.units = {u.id: u for u in units}
        self.sizes = sizes
        self.shapes: dict[str, int] = {}  # kinds of own form that a unit may take
        for unit, variant in variants:
            self.shapes[unit] = max(self.shapes.get(unit, 0), variant // OTHER_FORM)
        kinds = [u.kind for u in units]
        self.counts = sum(k in LISTED for k in kinds), len(WORDS), kinds.count("remainder")
        self.of_controller = {u.id for u in units if u.of_controller}
        self.among = {u.id: log(u.among) for u in units}

    def log_of(self, members: Sequence[tuple[str, int]]) -> float:
        """Prior of a set by how many of each kind it holds, spread evenly over the sets of its size.

        Described forms come one after the other, each of any kind: a set has the orders that they may come in.
        """
        kinds = [self.units[u].kind for u, _ in members]
        listed = sum(k in LISTED for k in kinds)
        controls = sum(u in self.of_controller for u, _ in members)
        forms, left = kinds.count("form") - controls, kinds.count("remainder")
        n_listed, n_forms, n_left = self.counts
        own = [u for u, v in members if v >= OTHER_FORM]
        if listed >= len(self.sizes):
            return -inf
        value = log(self.sizes[listed]) - _log_choose(n_listed, listed)
        value += log(1.0 - ONE_MORE_FORM) + forms * log(ONE_MORE_FORM / n_forms) + lgamma(forms + 1)
        value -= sum(self.among[u] for u, _ in members)
        value += sum(log(OTHER_FORM_PRIOR / self.shapes[u]) for u in own)
        value += (listed + forms - len(own)) * log(1.0 - OTHER_FORM_PRIOR)
        left, n_left = left + controls, n_left + len(self.of_controller)
        return value + left * log(REMAINDER_PRIOR) + (n_left - left) * log(1.0 - REMAINDER_PRIOR)


@cache
def _log_choose(n: int, k: int) -> float:
    return float(np.sum(np.log(np.arange(n - k + 1, n + 1)))) - float(np.sum(np.log(np.arange(1, k + 1))))

"""Whether what an equation leaves wanders: by the same local level model in all recordings, against white noise that an
autoregression colours.

The filter that weighs the rows takes such a level up, so that no column shows it: it is a remainder all the same.
"""

import numpy as np

from .constancy import log_mean
from .fit import Bench
from .model import SETTINGS
from .search import REMAINDER_PRIOR


def log_odds(bench: Bench) -> dict[str, float]:
    """Log posterior odds by equation, those of the controller left out.

    Parameters
    ----------
    bench : whose weights are of what the leading set leaves
    """
    ratios: dict[str, list[np.ndarray]] = {}
    for carried in bench.carried.values():
        for equation, weights in carried.items():
            if equation not in SETTINGS and weights.wandering:
                ratios.setdefault(equation, []).append(np.array(weights.wandering))
    prior = np.log(REMAINDER_PRIOR / (1.0 - REMAINDER_PRIOR))
    out = {}
    for equation, each in ratios.items():
        shares = np.sum(each, axis=0)[1:]  # the first is none
        out[equation] = log_mean(shares.tolist()) + float(prior)
    return out

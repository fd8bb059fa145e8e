"""Whether what an equation leaves wanders: by the same local level model in all recordings, against white noise that an
autoregression colours.

The filter that weighs the rows takes such a level up, so that no column shows it: it is a remainder all the same.
"""

from collections.abc import Sequence

import numpy as np

from .constancy import log_mean
from .evidence import CLEAR
from .fit import Bench
from .model import SETTINGS
from .set_prior import REMAINDER_ODDS


def log_odds(bench: Bench, confirm: Sequence[str] = ()) -> dict[str, float]:
    """Log posterior odds by equation, those of the controller left out.

    Parameters
    ----------
    bench : whose weights are of what the leading set leaves
    confirm : recordings of it that confirm: what the others do not show, or these do not clearly, is not there
    """
    explored, confirming = (
        _ratios(bench, part) for part in ([r for r in bench.recordings if r not in confirm], confirm)
    )
    out: dict[str, float] = {}
    for equation, ratios in explored.items():
        out[equation] = log_mean(ratios.tolist()) + REMAINDER_ODDS
        if confirm:
            every = log_mean((ratios + confirming.get(equation, 0.0)).tolist()) + REMAINDER_ODDS
            shown = out[equation] > 0.0 and every - out[equation] >= CLEAR
            out[equation] = every if shown else min(out[equation], REMAINDER_ODDS)
    return out


def _ratios(bench: Bench, recordings: Sequence[str]) -> dict[str, np.ndarray]:
    """Log likelihood ratio of each share by which a level may wander, by equation, over recordings."""
    out: dict[str, np.ndarray] = {}
    for r in recordings:
        for equation, weights in bench.carried[r].items():
            if equation not in SETTINGS and weights.wandering:
                out[equation] = out.get(equation, 0.0) + np.array(weights.wandering[1:])  # the first is none
    return out
